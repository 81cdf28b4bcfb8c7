// The camera of a virtual printer on the command line: in the printer's process or in its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "sim/camera/camera_server.h"
#include "sim/camera/machine_wire.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct CameraArguments {
  std::string frame = "1280x720";
  double frames_per_s = 30;      ///< per second of the machine
  bool rig_error = false;        ///< the head is built as the seed says, not as the paper draws it
  std::vector<std::string> rig;  ///< NAME=NUMBER, after what is drawn
  std::string rig_truth;         ///< a new file; empty: none

  [[nodiscard]] bool rigged() const { return rig_error || !rig.empty() || !rig_truth.empty(); }
};

/// @param prefix  of the options' names: "--" or "--camera-".
void AddCameraOptions(CLI::App& command, const std::string& prefix, CameraArguments& arguments);

/// What it serves, 0: a free port; where the truth goes, empty: nowhere.
struct CameraPlace {
  int port = 0;
  std::string truth_file;
};

/// Errors: (kInput) a frame's size that is none; a rig's value; a truth file that is there; and
/// those of CameraServer::Start.
[[nodiscard]] Result<std::unique_ptr<sim::CameraServer>> StartCamera(
    const CameraArguments& arguments, const CameraPlace& place,
    const std::vector<sim::CameraFault>& faults, const sim::MachineWorld& world,
    std::shared_ptr<const sim::MachineSource> machine);

}  // namespace trammel::app
