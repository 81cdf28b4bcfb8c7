// A virtual printer with its camera, served to a trammel that runs in a process of its own.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/camera/camera_server.h"
#include "sim/camera/machine_host.h"
#include "sim/moonraker/server.h"
#include "support/temporary_folder.h"
#include "support/trammel_process.h"

namespace trammel::test {

/// A printer whose heaters, axes and firmware lose no time; everything else as the usual one.
[[nodiscard]] sim::KlipperConfig QuickKlipper(double laser_limit_s = 600);
/// 160 x 120 px at 60 frames/s: as many frames per millimetre as the paper at twice its speed.
[[nodiscard]] sim::CameraServerOptions QuickCamera();

struct ShopOptions {
  std::uint64_t seed = 7;
  double pressure_advance_s = 0.03;  ///< the truth
  sim::KlipperConfig klipper = QuickKlipper();
  /// MachineOptions::hurry; 1 where moments of a print, or a macro's patience, are the point.
  double hurry = 5;
  sim::KlipperFaults faults;
  sim::ServerFaults server;
  std::string api_key;
  std::shared_ptr<sim::VirtualSpoolman> spoolman;  ///< none: Moonraker knows of none
  sim::CameraServerOptions camera = QuickCamera();
  bool with_camera = true;
  /// Content of trammel.toml beyond the quick calibration's settings; section -> lines.
  std::map<std::string, std::string> config;
  /// Whatever has to live as long as the shop.
  std::shared_ptr<void> neighbour;
};

[[nodiscard]] ShopOptions WithoutCamera();

/// State that a calibration must preserve.
struct PrinterLook {
  std::string state;  ///< "ready", "shutdown", …
  bool laser = false;
  bool lights = false;
  double nozzle_target_c = 0;
  double bed_target_c = 0;
  bool powered = true;                     ///< the heaters; false after a shutdown
  bool printing = false;                   ///< true if printing a file, or paused
  std::string print_file;                  ///< the file being or last printed
  int restarts = 0;                        ///< so far
  std::map<std::string, double> settings;  ///< pressure advance and limits: kept over a restart
  std::map<std::string, double> gcode;     ///< G-code state: lost by one
};

/// One sentence for everything that is neither as it was nor safe by other means: a printer in
/// shutdown has cut its heaters, one that restarted has its heaters off and a fresh G-code state.
[[nodiscard]] std::vector<std::string> NotAsItWas(const PrinterLook& before,
                                                  const PrinterLook& after);

/// Counts the lines with this text that the printer read.
[[nodiscard]] int TimesRead(const sim::VirtualKlipper& klipper, const std::string& text);

class MachineShop {
 public:
  /// Throws std::runtime_error where a socket cannot be had.
  explicit MachineShop(ShopOptions options = {});
  ~MachineShop();

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_.path(); }
  [[nodiscard]] std::string address() const;
  [[nodiscard]] sim::PrinterServer& server() { return *server_; }
  [[nodiscard]] sim::CameraServer& camera() { return *camera_; }
  [[nodiscard]] sim::MachineHost& machine() { return *machine_; }
  /// Seconds since the machine began.
  [[nodiscard]] double MachineTime() const;

  void With(const std::function<void(sim::VirtualKlipper&)>& function) const;
  /// Runs G-code as if from the printer's own screen, and waits until it was read.
  void Script(const std::string& gcode) const;
  /// Presses the first button of the dialog that trammel opened last.
  void Confirm() const;
  [[nodiscard]] PrinterLook Look() const;

  /// Runs the calibration with the shop's settings: `pa calibrate --printer … --out rec` and more.
  [[nodiscard]] std::unique_ptr<TrammelProcess> Calibrate(std::vector<std::string> more = {},
                                                          const ProcessLimits& limits = {}) const;
  /// Any command of trammel in the shop's folder.
  [[nodiscard]] ProcessEnd Run(const std::vector<std::string>& arguments) const;

  /// Waits until the machine is so; throws std::runtime_error with `what` after kEnough_s, or where
  /// the process ended first.
  void WaitUntil(const std::function<bool(sim::VirtualKlipper&)>& so, const std::string& what,
                 TrammelProcess& process) const;
  /// Waits until the process said these words on standard error.
  void WaitUntilSaid(const std::string& words, TrammelProcess& process) const;
  /// Starts trammel serve, and waits until it serves.
  [[nodiscard]] std::unique_ptr<TrammelProcess> Serve() const;
  /// Until filament is being laid, at least `lines` slow-fast-slow lines' beads after the first.
  void WaitUntilPrinting(TrammelProcess& process) const;
  /// Until the n-th sweep (from 1) is under way: laser on, head at scanning speed.
  void WaitUntilSweeping(int sweep, TrammelProcess& process) const;

  /// Lists the unsafe or changed parts; retries for a while, since motion may still be queued.
  [[nodiscard]] std::vector<std::string> Faulty(const PrinterLook& before,
                                                double patience_s = 5) const;

 private:
  ShopOptions options_;
  TemporaryFolder folder_;
  std::shared_ptr<sim::MachineHost> machine_;
  std::unique_ptr<sim::CameraServer> camera_;
  std::unique_ptr<sim::PrinterServer> server_;
};

}  // namespace trammel::test
