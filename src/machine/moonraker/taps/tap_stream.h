// Live taps of a printer, through Moonraker.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "machine/moonraker/link/address.h"
#include "machine/net/wait.h"

namespace trammel::machine {

/// All called on the connection's thread: they must return quickly and not call the stream. Times
/// are of HostNow().
struct TapStreamEvents {
  /// Receives an object with "time", "force" and "moves", as sent by dump_taps or built by
  /// TapBuilder.
  std::function<void(const nlohmann::json& tap, double received_s)> on_tap;
  /// Height of the nozzle's trigger point as the printer reports it: console, probe.last_z_result,
  /// or probe.last_probe_position if Klipper has removed that.
  std::function<void(double z_mm, double received_s)> on_firmware_z;
  /// Receives a macro's call of the remote method.
  std::function<void(const nlohmann::json& arguments, double received_s)> on_call;
  /// News of the link and the firmware, for users.
  std::function<void(const std::string& text)> on_news;
};

struct TapStreamOptions {
  MoonrakerOptions moonraker;
  std::string remote_method;  ///< Registered where not empty.
  /// Delay before a rejected stream is requested again, > 0.
  double ask_again_s = 2;
};

/// Subscribes to load_cell_probe/dump_taps, load_cell/dump_force and motion_report/dump_trapq of
/// the printer's first load cell, again after every restart and reconnect. Taps with moves are
/// passed on unchanged; before the first of them, taps are built from forces and moves.
class TapStream {
 public:
  virtual ~TapStream() = default;
  /// Sends G-code without waiting for its end; errors arrive as news.
  virtual void Send(const std::string& script) = 0;
  /// Returns the extruder's temperature, if reported.
  [[nodiscard]] virtual std::optional<double> NozzleTemperature() const = 0;
};

/// Opens a stream. A printer without a load cell is reported as news, since the next restart may
/// add one.
/// Errors: those of ConnectToMoonraker.
[[nodiscard]] Result<std::unique_ptr<TapStream>> OpenTapStream(const TapStreamOptions& options,
                                                               TapStreamEvents events,
                                                               const WaitLimit& limit);

/// Probe result on Klipper's console.
struct ConsoleResult {
  double z_mm = 0;
  bool less_offset = false;  ///< the probe's z_offset has been taken off
};

/// Parses "// probe at 1.0,2.0 is z=0.5", Klipper's format until January 2026, and the later "//
/// probe: at 1.0,2.0 bed will contact at z=0.5". Absent for other lines, including the summary of
/// several samples ("Result: …", "probe accuracy results: …").
[[nodiscard]] std::optional<ConsoleResult> ProbeResult(const std::string& line);

}  // namespace trammel::machine
