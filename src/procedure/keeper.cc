#include "procedure/keeper.h"

#include <fmt/format.h>

#include <utility>

namespace trammel::procedure {
namespace {

constexpr const char* kStateName = "trammel";
// A script waits behind what is still queued: about 2 s of motion, or a slow sweep.
constexpr double kScript_s = 60;

}  // namespace

Result<Keeper> Keeper::Remember(const Session& session,
                                const pressure_advance::ScanSettings& settings) {
  auto state = session.printer.State(session.Within(10));
  if (!state) return tl::unexpected(state.error());
  const std::string save = fmt::format("SAVE_GCODE_STATE NAME={}", kStateName);
  if (auto saved = session.printer.Run(save, session.Within(kScript_s)); !saved) {
    return tl::unexpected(saved.error());
  }
  return Keeper(session, settings, std::move(*state));
}

Keeper::Keeper(const Session& session, const pressure_advance::ScanSettings& settings,
               machine::PrinterState before)
    : printer_(&session.printer),
      tell_(session.tell),
      laser_off_gcode_(settings.laser_off_gcode),
      lights_on_gcode_(settings.lights_on_gcode),
      before_(std::move(before)) {}

Keeper::Keeper(Keeper&& other) noexcept
    : printer_(std::exchange(other.printer_, nullptr)),
      tell_(std::move(other.tell_)),
      laser_off_gcode_(std::move(other.laser_off_gcode_)),
      lights_on_gcode_(std::move(other.lights_on_gcode_)),
      before_(std::move(other.before_)) {}

Keeper::~Keeper() {
  if (printer_ == nullptr) return;
  for (const std::string& failure : Restore()) {
    if (tell_) tell_({failure, {}});
  }
}

bool Keeper::SwitchLaserOff(std::vector<std::string>& failures) {
  const auto off = printer_->Run(laser_off_gcode_, {kScript_s});
  if (off) return true;
  const machine::PrinterReadiness readiness = printer_->LastState().readiness;
  if (readiness == machine::PrinterReadiness::kShutdown) {
    failures.push_back(
        fmt::format("the printer has shut down: its own shutdown values hold for "
                    "laser and heaters; it needs a FIRMWARE_RESTART ({})",
                    off.error().message));
    return false;
  }
  failures.push_back(
      fmt::format("the laser could not be switched off by {} and the printer was "
                  "stopped instead; it needs a FIRMWARE_RESTART: {}",
                  laser_off_gcode_, off.error().message));
  if (auto stopped = printer_->EmergencyStop({10}); !stopped) {
    failures.push_back(
        fmt::format("the printer could not be stopped either: switch the LASER and "
                    "the heaters off by hand: {}",
                    stopped.error().message));
  }
  return false;
}

std::vector<std::string> Keeper::Script(bool restarted) const {
  std::vector<std::string> lines;
  if (!lights_on_gcode_.empty()) lines.push_back(lights_on_gcode_);
  const machine::VelocityLimits& limits = before_.limits;
  if (limits.max_velocity_mm_s > 0) {
    lines.push_back(fmt::format("SET_VELOCITY_LIMIT VELOCITY={} ACCEL={} SQUARE_CORNER_VELOCITY={}",
                                limits.max_velocity_mm_s, limits.max_accel_mm_s2,
                                limits.square_corner_velocity_mm_s));
    if (limits.minimum_cruise_ratio) {
      lines.back() += fmt::format(" MINIMUM_CRUISE_RATIO={}", *limits.minimum_cruise_ratio);
    }
  }
  if (before_.pressure_advance_s) {
    lines.push_back(fmt::format("SET_PRESSURE_ADVANCE ADVANCE={}", *before_.pressure_advance_s));
    if (before_.smooth_time_s) {
      lines.back() += fmt::format(" SMOOTH_TIME={}", *before_.smooth_time_s);
    }
  }
  if (restarted) return lines;  // its heaters are off and its G-code state is gone: both are safe
  for (const auto& [name, heater] : before_.heaters) {
    const std::string heater_name = name.substr(name.rfind(' ') + 1);
    lines.push_back(
        fmt::format("SET_HEATER_TEMPERATURE HEATER={} TARGET={}", heater_name, heater.target_c));
  }
  lines.push_back(fmt::format("RESTORE_GCODE_STATE NAME={} MOVE=0", kStateName));
  return lines;
}

std::vector<std::string> Keeper::Restore() {
  std::vector<std::string> failures;
  if (printer_ == nullptr) return failures;
  const auto readiness = printer_->LastState().readiness;
  if (readiness == machine::PrinterReadiness::kDisconnected ||
      readiness == machine::PrinterReadiness::kStartup) {
    if (tell_) tell_({"waiting for the printer to come back, to leave it safe", kReturn_s});
    if (auto ready = printer_->WaitUntilReady({kReturn_s}); !ready) {
      failures.push_back(
          fmt::format("the printer did not come back within {} s: make sure that "
                      "laser and heaters are off: {}",
                      kReturn_s, ready.error().message));
    }
  }
  if (failures.empty() && SwitchLaserOff(failures)) {
    const auto now = printer_->State({10});
    const bool restarted = now && !before_.homed_axes.empty() && now->homed_axes.empty();
    for (const std::string& line : Script(restarted)) {
      if (auto done = printer_->Run(line, {kScript_s}); !done) {
        failures.push_back(fmt::format("{} failed: {}", line, done.error().message));
      }
    }
  }
  printer_ = nullptr;
  return failures;
}

}  // namespace trammel::procedure
