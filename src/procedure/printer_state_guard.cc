#include "procedure/keeper.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

namespace trammel::procedure {
namespace {

constexpr const char* kStateName = "trammel";
// A script waits behind what is still queued: about 2 s of motion, or a slow sweep.
constexpr double kScript_s = 60;
constexpr double kAsk_s = 10;

using Clock = std::chrono::steady_clock;

// Whether the printer is somewhere from where it may come back by itself.
bool IsAway(machine::PrinterReadiness readiness) {
  return readiness == machine::PrinterReadiness::kDisconnected ||
         readiness == machine::PrinterReadiness::kStartup;
}

// Asked anew: what the printer last told by itself may be older than what just failed.
machine::PrinterReadiness ReadinessNow(machine::Printer& printer) {
  const auto state = printer.State({kAsk_s});
  return state ? state->readiness : machine::PrinterReadiness::kDisconnected;
}

}  // namespace

Result<Keeper> Keeper::Remember(const Session& session,
                                const pressure_advance::ScanSettings& settings) {
  auto state = session.printer.State(session.Within(kAsk_s));
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
      has_limit_(session.has_limit),
      before_(std::move(before)) {}

Keeper::Keeper(Keeper&& other) noexcept
    : printer_(std::exchange(other.printer_, nullptr)),
      tell_(std::move(other.tell_)),
      laser_off_gcode_(std::move(other.laser_off_gcode_)),
      lights_on_gcode_(std::move(other.lights_on_gcode_)),
      has_limit_(other.has_limit_),
      before_(std::move(other.before_)) {}

Keeper::~Keeper() {
  if (printer_ == nullptr) return;
  for (const std::string& failure : Restore()) {
    if (tell_) tell_({failure, {}});
  }
}

std::vector<std::string> Keeper::LaserStaysOn(const std::string& why) {
  const machine::PrinterReadiness readiness = ReadinessNow(*printer_);
  if (IsAway(readiness)) return {why};
  if (readiness != machine::PrinterReadiness::kReady) {
    return {
        fmt::format("the printer has shut down: its own shutdown values hold for laser and "
                    "heaters; it needs a FIRMWARE_RESTART ({})",
                    why)};
  }
  std::vector<std::string> failures = {
      fmt::format("the laser could not be switched off by {} and the printer was stopped instead; "
                  "it needs a FIRMWARE_RESTART: {}",
                  laser_off_gcode_, why)};
  if (auto stopped = printer_->EmergencyStop({kAsk_s}); !stopped) {
    failures.push_back(
        fmt::format("the printer could not be stopped either: switch the LASER and the heaters off "
                    "by hand: {}",
                    stopped.error().message));
  }
  return failures;
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
  if (has_limit_) lines.emplace_back(kRelease);
  return lines;
}

std::vector<std::string> Keeper::BringBack() {
  if (auto off = printer_->Run(laser_off_gcode_, {kScript_s}); !off) {
    return LaserStaysOn(off.error().message);
  }
  const auto now = printer_->State({kAsk_s});
  const bool restarted = now && !before_.homed_axes.empty() && now->homed_axes.empty();
  std::vector<std::string> failures;
  if (now && (now->print_state == "printing" || now->print_state == "paused")) {
    if (tell_) tell_({"cancelling the print", kScript_s});
    if (auto cancelled = printer_->CancelPrint({kScript_s}); !cancelled) {
      failures.push_back("the print could not be cancelled: " + cancelled.error().message);
    }
  }
  for (const std::string& line : Script(restarted)) {
    if (auto done = printer_->Run(line, {kScript_s}); !done) {
      failures.push_back(fmt::format("{} failed: {}", line, done.error().message));
    }
  }
  return failures;
}

std::vector<std::string> Keeper::Restore() {
  if (printer_ == nullptr) return {};
  const auto until = Clock::now() + std::chrono::duration<double>(kReturn_s);
  std::vector<std::string> failures;
  for (bool away = IsAway(printer_->LastState().readiness);;) {
    const double left_s = std::chrono::duration<double>(until - Clock::now()).count();
    if (away) {
      if (tell_) tell_({"waiting for the printer to come back, to leave it safe", left_s});
      if (auto ready = printer_->WaitUntilReady({left_s}); !ready) {
        failures = {
            fmt::format("the printer did not come back within {} s: make sure that laser "
                        "and heaters are off: {}",
                        kReturn_s, ready.error().message)};
        break;
      }
    }
    failures = BringBack();
    if (failures.empty() || Clock::now() >= until) break;
    away = IsAway(ReadinessNow(*printer_));
    if (!away) break;
  }
  printer_ = nullptr;
  return failures;
}

}  // namespace trammel::procedure
