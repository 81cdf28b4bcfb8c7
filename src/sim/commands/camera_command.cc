#include "sim/commands/camera_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>
#include <utility>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/number_range.h"
#include "app/option_values.h"
#include "sim/camera/machine_link.h"
#include "sim/commands/commands.h"
#include "sim/commands/printer_options.h"
#include "sim/print/world.h"

namespace trammel::app {

namespace {

struct SimCameraArguments {
  std::string machine;
  CameraArguments camera;
  CameraPlace place;
  std::vector<std::string> faults;
  std::optional<double> for_s;
};

Result<void> ServeCamera(const SimCameraArguments& arguments) {
  std::vector<sim::CameraFault> faults;
  for (const std::string& fault : arguments.faults) {
    TRY(SetFault(fault, nullptr, &faults));
  }
  const EndOfServing end;
  const auto machine = TRY(sim::RemoteMachine::Connect(arguments.machine));
  const auto camera =
      TRY(StartCamera(arguments.camera, arguments.place, faults, machine->world(), machine));
  const int port = camera->port();
  TRY(machine->Announce(port));
  fmt::print("listening http://127.0.0.1:{}\n", port);
  std::fflush(stdout);
  Result<void> link;
  end.Wait(arguments.for_s, [&] {
    link = machine->Check();
    return !link;
  });
  return link;
}

Result<sim::MountedRig> RigOf(const CameraArguments& arguments, std::uint64_t seed) {
  constexpr std::uint64_t kRigStream = 0x726967;
  sim::MountedRig rig;
  if (arguments.rig_error) rig = sim::DrawHeadRig(Random(seed).Fork(kRigStream));
  for (const std::string& text : arguments.rig) {
    if (!TRY(sim::SetNamed(sim::kHeadRigNumbers, TRY(sim::ParseNamedValue("--rig", text)), rig))) {
      return sim::NoSuchName("--rig", text, sim::NamesOf(sim::kHeadRigNumbers));
    }
  }
  return rig;
}

}  // namespace

void AddCameraOptions(CLI::App& command, const std::string& prefix, CameraArguments& arguments) {
  command.add_option(prefix + "frame", arguments.frame, "size of the camera's frames in px")
      ->capture_default_str();
  command
      .add_option(prefix + "fps", arguments.frames_per_s, "frames per second of the machine's time")
      ->check(NumberIn(1.0, 240.0))
      ->capture_default_str();
  command.add_flag("--rig-error", arguments.rig_error,
                   "laser and camera sit on the head as the seed says: turned, shifted, out of "
                   "focus, at another scale");
  command.add_option("--rig", arguments.rig,
                     "NAME=NUMBER, one of the head's true values, may be given again; names: " +
                         sim::NamesOf(sim::kHeadRigNumbers));
  command.add_option("--rig-truth", arguments.rig_truth,
                     "new file for how laser and camera really sit");
}

Result<std::unique_ptr<sim::CameraServer>> StartCamera(
    const CameraArguments& arguments, const CameraPlace& place,
    const std::vector<sim::CameraFault>& faults, const sim::MachineWorld& world,
    std::shared_ptr<const sim::MachineSource> machine) {
  const auto size = ParseWholePair(arguments.frame);
  if (!size) {
    return Fail(fmt::format("the camera's frame {}: must be WIDTHxHEIGHT, for example 640x360",
                            arguments.frame.substr(0, 40)));
  }
  sim::CameraServerOptions options;
  options.port = place.port;
  options.truth_file = place.truth_file;
  options.condition = world.condition;
  options.view.frame_width_px = size->first;
  options.view.frame_height_px = size->second;
  options.frames_per_s = arguments.frames_per_s * world.speed;
  options.machine_time_scale = world.speed;
  options.faults = faults;
  const sim::MountedRig rig = TRY(RigOf(arguments, world.seed));
  options.view.mount = rig.mount;
  options.view.rig = rig.rig;
  const Random eye = sim::LaserEyeOf(world.seed, world.condition);
  if (!arguments.rig_truth.empty()) {
    TRY(sim::WriteRigTruth(arguments.rig_truth, rig, sim::DrawHeadEye(world.condition, eye),
                           world.seed));
  }
  return sim::CameraServer::Start(options, std::move(machine), eye);
}

void AddSimCamera(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<SimCameraArguments>();
  CLI::App* camera = parent.add_subcommand(
      "camera", "be the camera on a virtual printer's head: MJPEG, on this machine only");
  camera
      ->add_option("--machine", arguments->machine,
                   "the socket that trammel-sim printer made with --machine-socket")
      ->required();
  camera->add_option("--port", arguments->place.port, "of 127.0.0.1; 0 takes a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  AddCameraOptions(*camera, "--", arguments->camera);
  camera->add_option("--truth", arguments->place.truth_file,
                     "file for what each frame really shows (JSON lines)");
  camera->add_option("--fault", arguments->faults,
                     "NAME=NUMBER, may be given again; names: " + CameraFaultNames());
  camera->add_option("--for", arguments->for_s, "s after which it ends by itself")
      ->check(NumberIn(0.0, 1e6));
  camera->callback([arguments, &exit_code] {
    const Result<void> done = ServeCamera(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
