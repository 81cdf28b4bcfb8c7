// trammel sim printer: the virtual printer as a server, until it is interrupted.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "sim/camera_http.h"
#include "sim/camera_server.h"
#include "sim/conditions.h"
#include "sim/machine_host.h"
#include "sim/moonraker/server.h"
#include "sim/scan_recorder.h"
#include "sim/world.h"

namespace trammel::app {
namespace {

struct PrinterArguments {
  int port = 7125;
  std::string unix_socket;
  std::string api_key;
  std::uint64_t seed = 0;
  std::optional<double> pressure_advance_s;
  std::string condition = "matte-black-dark";
  double speed = 1;
  double laser_limit_s = 30;
  double heater_limit_s = 1800;
  std::optional<int> camera_port;  // none: no camera; 0: a free one
  std::string camera_frame = "1280x720";
  double camera_frames_per_s = 30;  // per second of the machine
  std::vector<std::string> faults;
  std::optional<double> for_s;
  std::string truth;
};

// Where the faults of the command line go.
struct Faults {
  sim::KlipperFaults klipper;
  sim::ServerFaults server;
  std::vector<sim::CameraFault> camera;
};

struct FaultSwitch {
  const char* name;
  void (*set)(double value, Faults&);
};

template <sim::CameraFaultKind kind>
void AddCameraFault(double at_s, Faults& faults) {
  sim::CameraFault fault;
  fault.kind = kind;
  fault.at_s = at_s;
  if (kind == sim::CameraFaultKind::kHalfJpeg) fault.duration_s = 0;
  faults.camera.push_back(fault);
}

constexpr FaultSwitch kFaults[] = {
    {"refuse-move", [](double v, Faults& f) { f.klipper.refuse_move = static_cast<int>(v); }},
    {"refuse-laser-move",
     [](double v, Faults& f) { f.klipper.refuse_laser_move = static_cast<int>(v); }},
    {"shutdown-at-laser-move",
     [](double v, Faults& f) { f.klipper.shutdown_at_laser_move = static_cast<int>(v); }},
    {"restart-at-laser-move",
     [](double v, Faults& f) { f.klipper.restart_at_laser_move = static_cast<int>(v); }},
    {"shutdown-at-script",
     [](double v, Faults& f) { f.klipper.shutdown_at_script = static_cast<int>(v); }},
    {"restart-at-script",
     [](double v, Faults& f) { f.klipper.restart_at_script = static_cast<int>(v); }},
    {"shutdown-at", [](double v, Faults& f) { f.klipper.shutdown_at_s = v; }},
    {"restart-at", [](double v, Faults& f) { f.klipper.restart_at_s = v; }},
    {"weak-nozzle",
     [](double v, Faults& f) {
       f.klipper.weak_heater = "extruder";
       f.klipper.weak_heater_c = v;
     }},
    {"weak-bed",
     [](double v, Faults& f) {
       f.klipper.weak_heater = "heater_bed";
       f.klipper.weak_heater_c = v;
     }},
    {"blind-to-heaters", [](double v, Faults& f) { f.klipper.verify_heaters = v == 0; }},
    {"printing", [](double v, Faults& f) { f.klipper.printing_at_start = v != 0; }},
    {"error", [](double v, Faults& f) { f.klipper.error_at_start = v != 0; }},
    {"startup", [](double v, Faults& f) { f.klipper.startup_s = v; }},
    {"close-at", [](double v, Faults& f) { f.server.close_at_s = v; }},
    {"close-at-laser-move",
     [](double v, Faults& f) { f.server.close_at_laser_move = static_cast<int>(v); }},
    {"refuse-for", [](double v, Faults& f) { f.server.refuse_for_s = v; }},
    {"silent-from", [](double v, Faults& f) { f.server.silent_from_s = v; }},
    {"answer-delay", [](double v, Faults& f) { f.server.answer_delay_s = v; }},
    {"camera-stall-at", AddCameraFault<sim::CameraFaultKind::kStall>},
    {"camera-close-at", AddCameraFault<sim::CameraFaultKind::kClose>},
    {"camera-half-at", AddCameraFault<sim::CameraFaultKind::kHalfJpeg>},
    {"camera-size-at", AddCameraFault<sim::CameraFaultKind::kSizeChange>},
    {"camera-black-at", AddCameraFault<sim::CameraFaultKind::kBlack>},
    {"camera-laserless-at", AddCameraFault<sim::CameraFaultKind::kLaserAbsent>},
    {"camera-drop",
     [](double v, Faults& f) {
       sim::CameraFault fault;
       fault.kind = sim::CameraFaultKind::kDropFrames;
       fault.fraction = std::min(1.0, v);
       f.camera.push_back(fault);
     }},
};

std::string FaultNames() {
  std::string names;
  for (const FaultSwitch& fault : kFaults) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", fault.name);
  }
  return names;
}

// NAME=NUMBER
Result<void> SetFault(const std::string& text, Faults& faults) {
  constexpr double kLargest = 1e6;
  const std::size_t equals = text.find('=');
  double value = 0;
  char rest = 0;
  const bool number = equals != std::string::npos &&
                      std::sscanf(text.c_str() + equals + 1, "%lf%c", &value, &rest) == 1 &&
                      value >= 0 && value <= kLargest;
  if (!number) {
    return Fail(fmt::format("--fault {}: must be NAME=NUMBER with a number within 0 ... {}",
                            text.substr(0, 60), kLargest));
  }
  for (const FaultSwitch& fault : kFaults) {
    if (text.compare(0, equals, fault.name) == 0) {
      fault.set(value, faults);
      return {};
    }
  }
  return Fail(
      fmt::format("--fault {}: no such fault; there are {}", text.substr(0, 60), FaultNames()));
}

// Waits for SIGINT or SIGTERM, or for a time to pass. The signals were blocked before any thread
// began, so that they arrive here.
void WaitForTheEnd(const sigset_t& signals, std::optional<double> for_s) {
  if (!for_s) {
    int which = 0;
    sigwait(&signals, &which);
    return;
  }
  timespec limit{};
  limit.tv_sec = static_cast<time_t>(*for_s);
  limit.tv_nsec = static_cast<long>((*for_s - static_cast<double>(limit.tv_sec)) * 1e9);
  sigtimedwait(&signals, nullptr, &limit);
}

void BlockSignals(sigset_t& signals) {
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

Result<std::unique_ptr<sim::CameraServer>> StartCamera(
    const PrinterArguments& arguments, const sim::Condition& condition, const Faults& faults,
    std::shared_ptr<const sim::MachineSource> machine) {
  sim::CameraServerOptions options;
  const auto size = ParseWholePair(arguments.camera_frame);
  if (!size) {
    return Fail(fmt::format("--camera-frame {}: must be WIDTHxHEIGHT, for example 640x360",
                            arguments.camera_frame.substr(0, 40)));
  }
  options.port = *arguments.camera_port;
  options.condition = condition;
  options.view.frame_width_px = size->first;
  options.view.frame_height_px = size->second;
  options.frames_per_s = arguments.camera_frames_per_s * arguments.speed;
  options.machine_time_scale = arguments.speed;
  options.faults = faults.camera;
  return sim::CameraServer::Start(options, std::move(machine),
                                  sim::LaserEyeOf(arguments.seed, condition));
}

Result<void> ServePrinter(const PrinterArguments& arguments) {
  Faults faults;
  for (const std::string& fault : arguments.faults) {
    if (const Result<void> set = SetFault(fault, faults); !set) return set;
  }
  const Result<sim::Condition> condition = sim::ParseCondition(arguments.condition);
  if (!condition) return Fail("--condition: " + condition.error().message);
  sigset_t signals;
  BlockSignals(signals);
  sim::MachineOptions machine_options;
  machine_options.klipper =
      sim::DefaultKlipperConfig(arguments.laser_limit_s, arguments.heater_limit_s);
  machine_options.faults = faults.klipper;
  machine_options.seed = arguments.seed;
  machine_options.pressure_advance_s = arguments.pressure_advance_s;
  machine_options.speed = arguments.speed;
  const auto machine = std::make_shared<sim::MachineHost>(machine_options, sim::MonotonicNow());
  if (!arguments.truth.empty()) {
    const Result<void> written =
        sim::WriteTruthFile(arguments.truth, {machine->true_pressure_advance_s()}, arguments.seed,
                            sim::ToString(*condition));
    if (!written) return written;
  }
  sim::ServerOptions server_options;
  server_options.port = static_cast<std::uint16_t>(arguments.port);
  server_options.unix_socket = arguments.unix_socket;
  server_options.hub.api_key = arguments.api_key;
  server_options.hub.seed = arguments.seed;
  server_options.hub.faults = faults.server;
  std::unique_ptr<sim::CameraServer> camera;
  if (arguments.camera_port) {
    auto started = StartCamera(arguments, *condition, faults, machine);
    if (!started) return tl::unexpected(started.error());
    camera = std::move(*started);
    const std::string address = fmt::format("http://127.0.0.1:{}", camera->port());
    server_options.hub.webcam_stream_url = address + "/?action=stream";
    server_options.hub.webcam_snapshot_url = address + "/?action=snapshot";
  }
  const auto server = sim::PrinterServer::Start(*machine, server_options);
  if (!server) return tl::unexpected(server.error());
  fmt::print("listening http://127.0.0.1:{}\n", (*server)->port());
  std::fflush(stdout);
  WaitForTheEnd(signals, arguments.for_s);
  return {};
}

}  // namespace

void AddSimPrinter(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<PrinterArguments>();
  CLI::App* printer = parent.add_subcommand(
      "printer", "be a printer: Moonraker in front of Klipper, on this machine only");
  printer->add_option("--port", arguments->port, "of 127.0.0.1; 0 takes a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  printer->add_option("--unix", arguments->unix_socket, "Unix socket to listen on as well");
  printer->add_option("--api-key", arguments->api_key, "clients have to bear it");
  printer->add_option("--seed", arguments->seed, "names the whole world")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  printer
      ->add_option("--pressure-advance", arguments->pressure_advance_s,
                   "the truth in s; without it, drawn from the seed")
      ->check(CLI::Range(0.0001, 10.0));
  printer
      ->add_option("--condition", arguments->condition,
                   "plate, filament and light, as for sim scan")
      ->capture_default_str();
  printer->add_option("--speed", arguments->speed, "how many times faster than life")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  printer
      ->add_option("--laser-limit", arguments->laser_limit_s,
                   "s after which the printer itself switches the laser off")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  printer
      ->add_option("--heater-limit", arguments->heater_limit_s,
                   "s after which it switches laser and heaters off, unless trammel says a word")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  printer
      ->add_option("--camera-port", arguments->camera_port,
                   "serve the camera on the head there; 0 takes a free one")
      ->check(CLI::Range(0, 65535));
  printer->add_option("--camera-frame", arguments->camera_frame, "size of its frames in px")
      ->capture_default_str();
  printer
      ->add_option("--camera-fps", arguments->camera_frames_per_s,
                   "frames per second of the machine's time")
      ->check(CLI::Range(1.0, 240.0))
      ->capture_default_str();
  printer->add_option("--fault", arguments->faults,
                      "NAME=NUMBER, may be given again; names: " + FaultNames());
  printer->add_option("--for", arguments->for_s, "s after which it ends by itself")
      ->check(CLI::Range(0.0, 1e6));
  printer->add_option("--truth", arguments->truth, "new file for what the printer really is");
  printer->callback([arguments, &exit_code] {
    const Result<void> done = ServePrinter(*arguments);
    exit_code = done ? kExitGood : Report(done.error());
  });
}

}  // namespace trammel::app
