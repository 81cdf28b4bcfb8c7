// Command-line options of a virtual printer: faults, a load cell, the truth of its taps.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "sim/camera/camera_server.h"
#include "sim/klipper/config.h"
#include "sim/klipper/machine.h"
#include "sim/moonraker/hub.h"
#include "sim/print/conditions.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct PrinterFaults {
  sim::KlipperFaults klipper;
  sim::ServerFaults server;
};

/// Returns the names, separated by commas.
[[nodiscard]] std::string PrinterFaultNames();
[[nodiscard]] std::string CameraFaultNames();

/// Parses NAME=NUMBER into the fault of that name.
/// @param camera  null if there is no camera.
/// Error (kInput): another form, a number outside 0 … 1e6, or an unknown name.
[[nodiscard]] Result<void> SetFault(const std::string& text, PrinterFaults* printer,
                                    std::vector<sim::CameraFault>* camera);

struct CellArguments {
  std::string name;  ///< from sim::CellNames(), "drawn", or empty: no load cell
  std::optional<double> bed_height_mm;
  bool pulls_back = false;
  std::string truth;  ///< new file for the taps' truth; empty: none
};

/// Returns the load cell, if any. Missing values are drawn from the seed.
/// Error (kInput): there is no such cell, or a truth file is requested without one.
[[nodiscard]] Result<std::optional<sim::LoadCellConfig>> LoadCellOf(const CellArguments& arguments,
                                                                    std::uint64_t seed);

/// Writes a line of JSON for each tap, as soon as the nozzle has released.
class TapTruthFile {
 public:
  /// Error (kInput): the file exists or cannot be written.
  [[nodiscard]] static Result<TapTruthFile> Create(const std::string& path);
  /// Writes what is new. @param rest  The last one, too, however it stands.
  /// Error (kInput): it cannot be written.
  Result<void> Write(const sim::VirtualKlipper& klipper, bool rest);

 private:
  std::string path_;
  std::size_t written_ = 0;
};

struct CameraArguments {
  std::optional<int> port;  ///< none: no camera; 0: a free one
  std::string frame = "1280x720";
  double frames_per_s = 30;      ///< per second of the machine
  bool rig_error = false;        ///< the head is built as the seed says, not as the paper draws it
  std::vector<std::string> rig;  ///< NAME=NUMBER, after what is drawn
  std::string truth_file;        ///< truth per frame; empty: none
  std::string rig_truth;         ///< a new file; empty: none

  [[nodiscard]] bool rigged() const { return rig_error || !rig.empty() || !rig_truth.empty(); }
};

/// Properties of the world beside the machine's state, for the camera.
struct MachineWorld {
  std::uint64_t seed = 0;
  sim::Condition condition;
  double speed = 1;  ///< machine seconds per second of the host, 0.1 … 1000
};

void AddCameraOptions(CLI::App& command, CameraArguments& arguments);

/// Errors: (kInput) an invalid frame size; a rig's value; an existing truth file; and those of
/// CameraServer::Start.
[[nodiscard]] Result<std::unique_ptr<sim::CameraServer>> StartCamera(
    const CameraArguments& arguments, const std::vector<sim::CameraFault>& faults,
    const MachineWorld& world, std::shared_ptr<const sim::MachineSource> machine);

}  // namespace trammel::app
