// What a virtual printer can be told on the command line: faults, a load cell, the truth of its
// taps.
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

/// Names, separated by commas.
[[nodiscard]] std::string PrinterFaultNames();
[[nodiscard]] std::string CameraFaultNames();

/// Reads NAME=NUMBER into what the name belongs to.
/// @param camera  null where there is no camera to go wrong.
/// Error (kInput): another form, a number outside 0 … 1e6, or a name that is not there.
[[nodiscard]] Result<void> SetFault(const std::string& text, PrinterFaults* printer,
                                    std::vector<sim::CameraFault>* camera);

struct CellArguments {
  std::string name;  ///< of sim::CellNames(), "drawn", or empty: no load cell
  std::optional<double> bed_height_mm;
  bool pulls_back = false;
  std::string truth;  ///< new file for the taps' truth; empty: none
};

/// The load cell, or none. What is not said is drawn from the seed.
/// Error (kInput): there is no such cell, or a truth is wanted without one.
[[nodiscard]] Result<std::optional<sim::LoadCellConfig>> LoadCellOf(const CellArguments& arguments,
                                                                    std::uint64_t seed);

/// A line of JSON for each tap, as soon as the nozzle has let go.
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
  std::string truth_file;        ///< of each frame; empty: none
  std::string rig_truth;         ///< a new file; empty: none

  [[nodiscard]] bool rigged() const { return rig_error || !rig.empty() || !rig_truth.empty(); }
};

/// What the camera has to know of the world beside the machine's state.
struct MachineWorld {
  std::uint64_t seed = 0;
  sim::Condition condition;
  double speed = 1;  ///< machine seconds per second of the host, 0.1 … 1000
};

void AddCameraOptions(CLI::App& command, CameraArguments& arguments);

/// Errors: (kInput) a frame's size that is none; a rig's value; a truth file that is there; and
/// those of CameraServer::Start.
[[nodiscard]] Result<std::unique_ptr<sim::CameraServer>> StartCamera(
    const CameraArguments& arguments, const std::vector<sim::CameraFault>& faults,
    const MachineWorld& world, std::shared_ptr<const sim::MachineSource> machine);

}  // namespace trammel::app
