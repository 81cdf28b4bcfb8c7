#include "machine_shop.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "sim/camera/scan_recorder.h"
#include "sim/print/printer.h"
#include "support/sanitized.h"

namespace trammel::test {
namespace {

constexpr auto kLook = std::chrono::milliseconds(4);
constexpr double kScanSpeed_mm_s = 800.0 / 60;  // twice the paper's, at twice its frame rate

// Short: five lines round the truth, no frame, no slow moves.
const std::map<std::string, std::string> kQuickConfig = {
    {"printer", "travel_speed = 300\nz_speed = 50\npark_lift = 2\n"},
    {"filament", "nozzle_temperature = 190\nidle_nozzle_temperature = 170\nbed_temperature = 40\n"},
    {"pressure_advance_pattern",
     "preset = \"paper\"\npressure_advances = [0.012, 0.022, 0.031, 0.039, 0.05]\nframe_loops = 0\n"
     "segments = [{fraction = 0.25, speed = 10}, {fraction = 0.5, speed = 150}, "
     "{fraction = 0.25, speed = 10}]\n"},
    {"camera", "fps = 60\n"},
    {"scan",
     "lights_off_gcode = \"LIGHTS_OFF\"\nlights_on_gcode = \"LIGHTS_ON\"\nsettle = 0.4\n"
     "heat_time_limit = 10\n"}};

// Camera's view: the bed as it was before a print until that is done. Rendering it anew every two
// seconds would take processor time from the processes under test.
class RestingBed final : public sim::MachineSource {
 public:
  explicit RestingBed(std::shared_ptr<sim::MachineHost> machine) : machine_(std::move(machine)) {}
  [[nodiscard]] sim::MachineView At(double monotonic_s) const override {
    return machine_->At(monotonic_s);
  }
  [[nodiscard]] std::shared_ptr<const sim::Bed> bed(double monotonic_s) const override {
    bool printing = false;
    machine_->With([&](sim::VirtualKlipper& klipper) {
      printing = klipper.print.running || klipper.TrueHead(klipper.now_s()).filament_speed_mm_s > 0;
    });
    const std::lock_guard lock(mutex_);
    if (!printing || !bed_) bed_ = machine_->bed(monotonic_s);
    return bed_;
  }

 private:
  std::shared_ptr<sim::MachineHost> machine_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const sim::Bed> bed_;
};

template <class T>
T ValueOr(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

}  // namespace

sim::KlipperConfig QuickKlipper(double laser_limit_s) {
  sim::KlipperConfig config = sim::DefaultKlipperConfig(laser_limit_s);
  config.homing_speed_mm_s = {400, 400, 80};
  config.physical_start_mm = {20, 20, 2};
  config.max_z_velocity_mm_s = 80;
  config.max_z_accel_mm_s2 = 2000;
  config.nozzle.rate_c_s = 200;
  config.nozzle.settle_s = 0.1;
  config.nozzle.cool_s = 1.5;
  config.nozzle.gain_window_s = 1;
  config.bed.rate_c_s = 50;
  config.bed.settle_s = 0.1;
  config.bed.cool_s = 1.5;
  config.bed.gain_window_s = 1;
  config.restart_s = 0.7;
  return config;
}

sim::CameraServerOptions QuickCamera() {
  sim::CameraServerOptions options;
  options.frames_per_s = 60;
  options.view.frame_width_px = 160;
  options.view.frame_height_px = 120;
  options.latency_jitter_s = 0.02;
  return options;
}

ShopOptions WithoutCamera() {
  ShopOptions options;
  options.with_camera = false;
  return options;
}

int TimesRead(const sim::VirtualKlipper& klipper, const std::string& text) {
  const auto& lines = klipper.history().lines;
  return static_cast<int>(std::ranges::count_if(
      lines, [&](const sim::ReadLine& line) { return line.text.find(text) != std::string::npos; }));
}

std::vector<std::string> NotAsItWas(const PrinterLook& before, const PrinterLook& after) {
  std::vector<std::string> faults;
  if (after.laser) faults.push_back("the laser is on");
  if (after.lights != before.lights) {
    faults.push_back(fmt::format("the lights are {}", after.lights ? "on" : "off"));
  }
  if (after.state == "shutdown") {
    if (after.powered) faults.push_back("shut down, but the heaters have power");
    return faults;  // file paused until the restart; nothing of it is executed
  }
  if (after.printing && !before.printing) faults.push_back("a print is still under way");
  if (after.state != "ready" && after.state != before.state)
    faults.push_back("the printer is in " + after.state);
  const bool restarted = after.restarts > before.restarts;
  const auto compare = [&](const std::string& name, double was, double is) {
    if (std::abs(was - is) > 1e-6 * std::max(1.0, std::abs(was))) {
      faults.push_back(fmt::format("{} is {} and was {}", name, is, was));
    }
  };
  for (const auto& [name, value] : before.settings) compare(name, value, after.settings.at(name));
  compare("nozzle target", restarted ? 0 : before.nozzle_target_c, after.nozzle_target_c);
  compare("bed target", restarted ? 0 : before.bed_target_c, after.bed_target_c);
  if (restarted) return faults;
  for (const auto& [name, value] : before.gcode) compare(name, value, after.gcode.at(name));
  return faults;
}

MachineShop::MachineShop(ShopOptions options) : options_(std::move(options)) {
  sim::MachineOptions machine;
  machine.hurry = options_.hurry;
  machine.klipper = options_.klipper;
  machine.faults = options_.faults;
  machine.seed = options_.seed;
  machine.pressure_advance_s = options_.pressure_advance_s;
  machine_ = std::make_shared<sim::MachineHost>(machine, sim::MonotonicNow());
  sim::ServerOptions server;
  server.hub.api_key = options_.api_key;
  server.hub.seed = options_.seed;
  server.hub.faults = options_.server;
  server.hub.spoolman = options_.spoolman;
  if (options_.with_camera) {
    camera_ = ValueOr(
        sim::CameraServer::Start(options_.camera, std::make_shared<RestingBed>(machine_),
                                 sim::LaserRandom(options_.seed, options_.camera.condition)));
    server.hub.camera_port = [port = camera_->port()] { return port; };
  }
  server_ = ValueOr(sim::PrinterServer::Start(*machine_, server));
  auto config = kQuickConfig;
  config["scan"] += fmt::format("speed = {}\n", kScanSpeed_mm_s);
  for (const auto& [section, lines] : options_.config) config[section] += lines;
  std::string text;
  for (const auto& [section, lines] : config) text += fmt::format("[{}]\n{}", section, lines);
  WriteWhole(folder() / "trammel.toml", text);
}

MachineShop::~MachineShop() = default;

std::string MachineShop::address() const { return fmt::format("127.0.0.1:{}", server_->port()); }

double MachineShop::MachineTime() const { return machine_->MachineTime(sim::MonotonicNow()); }

void MachineShop::With(const std::function<void(sim::VirtualKlipper&)>& function) const {
  machine_->With(function);
}

void MachineShop::Script(const std::string& gcode) const {
  With([&](sim::VirtualKlipper& klipper) { klipper.RunScript(gcode); });
  for (bool busy = true; busy; std::this_thread::sleep_for(kLook)) {
    With([&](sim::VirtualKlipper& klipper) { busy = klipper.busy(); });
  }
}

void MachineShop::Confirm() const {
  const std::string key = " TOKEN=";
  std::string token;
  With([&](sim::VirtualKlipper& klipper) {
    for (const sim::ReadLine& line : klipper.history().lines) {
      const std::size_t at = line.text.find(key);
      if (!line.text.starts_with("TRAMMEL_ASK ") || at == std::string::npos) continue;
      const std::size_t begin = at + key.size();
      token = line.text.substr(begin, line.text.find(' ', begin) - begin);
    }
  });
  Script("_TRAMMEL_START TOKEN=" + token);
}

PrinterLook MachineShop::Look() const {
  PrinterLook look;
  With([&](sim::VirtualKlipper& klipper) {
    look.state = ToString(klipper.state());
    look.laser = klipper.pins.at("LASER") > 0;
    look.lights = klipper.pins.at("LIGHTS") > 0;
    look.nozzle_target_c = klipper.nozzle.target_c;
    look.bed_target_c = klipper.bed.target_c;
    look.powered = klipper.nozzle.powered || klipper.bed.powered;
    look.printing = klipper.print.state == "printing" || klipper.print.state == "paused";
    look.print_file = klipper.print.filename;
    for (const sim::StateEntry& entry : klipper.history().states) {
      look.restarts += entry.state == "disconnected";
    }
    const sim::MotionSettings& motion = klipper.settings;
    look.settings = {{"pressure advance", klipper.motors.at("extruder").pressure_advance_s},
                     {"smooth time", klipper.motors.at("extruder").smooth_time_s},
                     {"velocity", motion.max_velocity_mm_s},
                     {"acceleration", motion.max_accel_mm_s2},
                     {"corner velocity", motion.square_corner_velocity_mm_s},
                     {"cruise ratio", motion.minimum_cruise_ratio}};
    const sim::GcodeState& gcode = klipper.gcode;
    look.gcode = {
        {"absolute coordinates", gcode.absolute}, {"absolute extrusion", gcode.absolute_extrude},
        {"speed factor", gcode.speed_factor},     {"extrude factor", gcode.extrude_factor},
        {"offset x", gcode.homing_mm[0]},         {"offset y", gcode.homing_mm[1]},
        {"offset z", gcode.homing_mm[2]}};
  });
  return look;
}

std::unique_ptr<TrammelProcess> MachineShop::Calibrate(std::vector<std::string> more,
                                                       const ProcessLimits& limits) const {
  std::vector<std::string> words = {"pa", "calibrate", "--printer", address(), "--out", "rec"};
  words.insert(words.end(), more.begin(), more.end());
  return std::make_unique<TrammelProcess>(words, folder(), limits);
}

ProcessEnd MachineShop::Run(const std::vector<std::string>& arguments) const {
  return TrammelProcess(arguments, folder()).Wait();
}

void MachineShop::WaitUntil(const std::function<bool(sim::VirtualKlipper&)>& so,
                            const std::string& what, TrammelProcess& process) const {
  const double until_s = sim::MonotonicNow() + kSanitizerSlowdown * kEnough_s;
  for (bool done = false; !done; std::this_thread::sleep_for(kLook)) {
    const bool running = process.Running();
    With([&](sim::VirtualKlipper& klipper) { done = so(klipper); });
    if (done) return;
    if (!running || sim::MonotonicNow() > until_s) {
      throw std::runtime_error(fmt::format("{} before {}:\n{}",
                                           running ? "time was over" : "trammel ended", what,
                                           process.StandardErrorSoFar()));
    }
  }
}

void MachineShop::WaitUntilSaid(const std::string& words, TrammelProcess& process) const {
  WaitUntil(
      [&](sim::VirtualKlipper&) {
        return process.StandardErrorSoFar().find(words) != std::string::npos;
      },
      "it said: " + words, process);
}

std::unique_ptr<TrammelProcess> MachineShop::Serve() const {
  auto service = std::make_unique<TrammelProcess>(
      std::vector<std::string>{"serve", "--printer", address()}, folder());
  WaitUntilSaid("serving", *service);
  return service;
}

void MachineShop::WaitUntilPrinting(TrammelProcess& process) const {
  WaitUntil(
      [](sim::VirtualKlipper& klipper) {
        std::size_t beads = 0;
        for (const sim::ExecutedMove& move : klipper.history().moves) {
          beads += move.timed.deposits() && move.timed.end_s() < klipper.now_s();
        }
        return klipper.print.running && beads >= 4;
      },
      "the second line was being printed", process);
}

void MachineShop::WaitUntilSweeping(int sweep, TrammelProcess& process) const {
  WaitUntil(
      [sweep](sim::VirtualKlipper& klipper) {
        const double speed_mm_s = klipper.TrueHead(klipper.now_s()).speed_mm_s;
        return klipper.pins.at("LASER") > 0 && std::abs(speed_mm_s - kScanSpeed_mm_s) < 0.1 &&
               klipper.laser_moves >= 2 * sweep - 1;
      },
      fmt::format("sweep {} was under way", sweep), process);
}

std::vector<std::string> MachineShop::Faulty(const PrinterLook& before, double patience_s) const {
  const double until_s = sim::MonotonicNow() + kSanitizerSlowdown * patience_s;
  for (;; std::this_thread::sleep_for(kLook)) {
    auto faults = NotAsItWas(before, Look());
    if (faults.empty() || sim::MonotonicNow() > until_s) return faults;
  }
}

}  // namespace trammel::test
