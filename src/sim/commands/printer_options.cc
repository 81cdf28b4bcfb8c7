#include "sim/commands/printer_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/option_values.h"
#include "files/new_file.h"
#include "sim/print/named_number.h"
#include "sim/print/printer.h"

namespace trammel::app {

namespace {

using CameraFaults = std::vector<sim::CameraFault>;

template <sim::CameraFaultKind kind>
void AddCameraFault(double at_s, CameraFaults& faults) {
  sim::CameraFault fault;
  fault.kind = kind;
  fault.at_s = at_s;
  if (kind == sim::CameraFaultKind::kHalfJpeg) fault.duration_s = 0;
  faults.push_back(fault);
}

constexpr sim::NamedNumber<PrinterFaults> kPrinterFaults[] = {
    {"refuse-move", [](double v, PrinterFaults& f) { f.klipper.refuse_move = sim::WholeOf(v); }},
    {"shutdown-at-laser-move",
     [](double v, PrinterFaults& f) { f.klipper.shutdown_at_laser_move = sim::WholeOf(v); }},
    {"shutdown-at", [](double v, PrinterFaults& f) { f.klipper.shutdown_at_s = v; }},
    {"restart-at", [](double v, PrinterFaults& f) { f.klipper.restart_at_s = v; }},
    {"weak-nozzle",
     [](double v, PrinterFaults& f) {
       f.klipper.weak_heater = "extruder";
       f.klipper.weak_heater_c = v;
     }},
    {"weak-bed",
     [](double v, PrinterFaults& f) {
       f.klipper.weak_heater = "heater_bed";
       f.klipper.weak_heater_c = v;
     }},
    {"blind-to-heaters", [](double v, PrinterFaults& f) { f.klipper.verify_heaters = v == 0; }},
    {"deaf-tools", [](double v, PrinterFaults& f) { f.klipper.deaf_tools = v != 0; }},
    {"included-tools", [](double v, PrinterFaults& f) { f.klipper.included_tools = v != 0; }},
    {"printing", [](double v, PrinterFaults& f) { f.klipper.printing_at_start = v != 0; }},
    {"error", [](double v, PrinterFaults& f) { f.klipper.error_at_start = v != 0; }},
    {"startup", [](double v, PrinterFaults& f) { f.klipper.startup_s = v; }},
    {"close-at", [](double v, PrinterFaults& f) { f.server.close_at_s = v; }},
    {"close-at-laser-move",
     [](double v, PrinterFaults& f) { f.server.close_at_laser_move = sim::WholeOf(v); }},
    {"refuse-for", [](double v, PrinterFaults& f) { f.server.refuse_for_s = v; }},
    {"silent-from", [](double v, PrinterFaults& f) { f.server.silent_from_s = v; }},
};

constexpr sim::NamedNumber<CameraFaults> kCameraFaults[] = {
    {"camera-stall-at", AddCameraFault<sim::CameraFaultKind::kStall>},
    {"camera-close-at", AddCameraFault<sim::CameraFaultKind::kClose>},
    {"camera-half-at", AddCameraFault<sim::CameraFaultKind::kHalfJpeg>},
    {"camera-size-at", AddCameraFault<sim::CameraFaultKind::kSizeChange>},
    {"camera-black-at", AddCameraFault<sim::CameraFaultKind::kBlack>},
    {"camera-laserless-at", AddCameraFault<sim::CameraFaultKind::kLaserAbsent>},
    {"camera-drop",
     [](double v, CameraFaults& f) {
       sim::CameraFault fault;
       fault.kind = sim::CameraFaultKind::kDropFrames;
       fault.fraction = std::min(1.0, v);
       f.push_back(fault);
     }},
};

}  // namespace

std::string PrinterFaultNames() { return sim::NamesOf(kPrinterFaults); }
std::string CameraFaultNames() { return sim::NamesOf(kCameraFaults); }

Result<void> SetFault(const std::string& text, PrinterFaults* printer, CameraFaults* camera) {
  const auto named = TRY(sim::ParseNamedValue("--fault", text));
  constexpr double kLargest = 1e6;
  if (!(named.value >= 0 && named.value <= kLargest)) {
    return Fail(fmt::format("--fault {}: its number must be within 0 ... {}", text.substr(0, 60),
                            kLargest));
  }
  if (printer != nullptr && TRY(sim::SetNamed(kPrinterFaults, named, *printer))) return {};
  if (camera != nullptr && TRY(sim::SetNamed(kCameraFaults, named, *camera))) return {};
  std::string names = printer != nullptr ? PrinterFaultNames() : "";
  if (camera != nullptr) names += (names.empty() ? "" : ", ") + CameraFaultNames();
  return sim::NoSuchName("--fault", text, names);
}

namespace {

constexpr std::uint64_t kCellStream =
    0x7a9;  // generator stream of the seed; laser and print use others

nlohmann::json TruthOf(const sim::ProbedTap& tap, std::size_t number) {
  nlohmann::json truth = {{"format", 1},
                          {"tap", number},
                          {"x_mm", tap.x_mm},
                          {"y_mm", tap.y_mm},
                          {"surface_z_mm", tap.surface_z_mm},
                          {"reported_z_mm", tap.reported_z_mm},
                          {"latency_s", tap.latency_s},
                          {"contact_z_mm", nullptr},
                          {"contact_time_s", nullptr}};
  if (!tap.truth) return truth;
  truth["contact_z_mm"] = tap.truth->contact_z_mm;
  truth["contact_time_s"] = tap.truth->contact_time_s;
  truth["touch_z_mm"] = tap.truth->touch_z_mm;
  truth["touch_time_s"] = tap.truth->touch_time_s;
  truth["snap_z_mm"] = tap.truth->snap_z_mm;
  truth["peak_force_g"] = tap.truth->peak_force_g;
  return truth;
}

}  // namespace

Result<std::optional<sim::LoadCellConfig>> LoadCellOf(const CellArguments& arguments,
                                                      std::uint64_t seed) {
  if (arguments.name.empty()) {
    if (arguments.truth.empty() && !arguments.bed_height_mm && !arguments.pulls_back) return {};
    return Fail("--tap-truth, --bed-height and --pull-back need --load-cell");
  }
  // Below the end stop, whatever the tilt, so that homing does not touch the bed.
  constexpr double kLowestMm = -0.15;
  constexpr double kHighestMm = -0.05;
  constexpr double kSteepest = 1e-4;
  Random random = Random(seed).Fork(kCellStream);
  sim::LoadCellConfig config;
  const sim::CellTraits drawn = sim::DrawCellTraits(random);
  if (arguments.name == "drawn") {
    config.cell = drawn;
  } else {
    const Result<sim::CellTraits> named = sim::CellByName(arguments.name);
    if (!named) return Fail("--load-cell: " + named.error().message + ", or drawn");
    config.cell = *named;
  }
  const double height_mm = random.Uniform(kLowestMm, kHighestMm);
  config.surface_z_mm = arguments.bed_height_mm.value_or(height_mm);
  config.tilt_x = random.Uniform(-kSteepest, kSteepest);
  config.tilt_y = random.Uniform(-kSteepest, kSteepest);
  config.pulls_back = arguments.pulls_back;
  config.seed = random.Bits();
  return config;
}

Result<TapTruthFile> TapTruthFile::Create(const std::string& path) {
  TapTruthFile file;
  file.path_ = path;
  TRY(files::WriteWholeFile(path, "", files::IfThere::kRefuse));
  return file;
}

Result<void> TapTruthFile::Write(const sim::VirtualKlipper& klipper, bool rest) {
  const std::vector<sim::ProbedTap>& taps = klipper.history().taps;
  for (; written_ < taps.size(); ++written_) {
    if (!rest && written_ + 1 == taps.size() && !taps[written_].truth) break;
    const std::string line = TruthOf(taps[written_], written_ + 1)
                                 .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    TRY(files::AppendLine(path_, line));
  }
  return {};
}

namespace {

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

void AddCameraOptions(CLI::App& command, CameraArguments& arguments) {
  command
      .add_option("--camera-port", arguments.port,
                  "serve the camera on the head there; 0 takes a free one")
      ->check(CLI::Range(0, 65535));
  command.add_option("--camera-frame", arguments.frame, "size of the camera's frames in px")
      ->capture_default_str();
  command
      .add_option("--camera-fps", arguments.frames_per_s, "frames per second of the machine's time")
      ->check(NumberIn(1.0, 240.0))
      ->capture_default_str();
  command.add_option("--camera-truth", arguments.truth_file,
                     "file for what each frame really shows (JSON lines)");
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
    const CameraArguments& arguments, const std::vector<sim::CameraFault>& faults,
    const MachineWorld& world, std::shared_ptr<const sim::MachineSource> machine) {
  const auto size = ParseWholePair(arguments.frame);
  if (!size) {
    return Fail(fmt::format("the camera's frame {}: must be WIDTHxHEIGHT, for example 640x360",
                            arguments.frame.substr(0, 40)));
  }
  sim::CameraServerOptions options;
  options.port = arguments.port.value_or(0);
  options.truth_file = arguments.truth_file;
  options.condition = world.condition;
  options.view.frame_width_px = size->first;
  options.view.frame_height_px = size->second;
  options.frames_per_s = arguments.frames_per_s * world.speed;
  options.machine_time_scale = world.speed;
  options.faults = faults;
  const sim::MountedRig rig = TRY(RigOf(arguments, world.seed));
  options.view.mount = rig.mount;
  options.view.rig = rig.rig;
  const Random optics = sim::LaserRandom(world.seed, world.condition);
  if (!arguments.rig_truth.empty()) {
    TRY(sim::WriteRigTruth(arguments.rig_truth, rig, sim::DrawHeadOptics(world.condition, optics),
                           world.seed));
  }
  return sim::CameraServer::Start(options, std::move(machine), optics);
}

}  // namespace trammel::app
