#include "sim/klipper/machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace trammel::sim {
namespace {

constexpr std::size_t kMaxScripts = 10'000;
const char* const kRestartHint =
    "Once the underlying issue is corrected, use the\n\"FIRMWARE_RESTART\" command to reset the "
    "firmware, reload the\nconfig, and restart the host software.\nPrinter is shutdown\n";
const char* const kStartupMessage =
    "Printer is not ready\nThe klippy host software is attempting to connect.  Please\nretry in a "
    "few moments.\n";

}  // namespace

std::vector<std::string> SplitLines(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t end = std::min(text.size(), text.find('\n', from));
    lines.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return lines;
}

const char* const kConfigError =
    "Option 'pin' in section 'output_pin LASER' must be specified\n\nOnce the underlying issue is "
    "corrected, use the \"RESTART\"\ncommand to reload the config and restart the host "
    "software.\nPrinter is halted\n";

const char* ToString(KlippyState state) {
  switch (state) {
    case KlippyState::kDisconnected:
      return "disconnected";
    case KlippyState::kStartup:
      return "startup";
    case KlippyState::kReady:
      return "ready";
    case KlippyState::kShutdown:
      return "shutdown";
    case KlippyState::kError:
      return "error";
  }
  return "error";
}

VirtualKlipper::VirtualKlipper(KlipperConfig config, KlipperFaults faults)
    : config_(std::move(config)), faults_(std::move(faults)) {
  motion_.set_on_planned([this](const PlannedMove& planned) {
    ExecutedMove executed{planned.timed};
    executed.timed.start_s += epoch_s_;
    history_.moves.push_back(executed);
  });
  nozzle.config = config_.nozzle;
  bed.config = config_.bed;
  std::set<std::string> extruders;
  for (int i = 1; i < config_.extruders; ++i) extruders.insert(fmt::format("extruder{}", i));
  for (const ToolConfig& tool : config_.tools) {
    if (tool.number != 0) extruders.insert(tool.extruder());
  }
  for (const std::string& extruder : extruders) {
    Heater& heater = more_nozzles.emplace_back();
    heater.config = config_.nozzle;
    heater.config.name = extruder;
  }
  for (Heater* heater : Heaters()) {
    heater->temperature_c = config_.room_c;
    if (heater->config.name == faults_.weak_heater) heater->highest_reach_c = faults_.weak_heater_c;
  }
  Reset();
  physical_offset_mm = config_.physical_start_mm;
  if (faults_.error_at_start) {
    SetState(KlippyState::kError, kConfigError);
  } else if (faults_.startup_s > 0) {
    SetState(KlippyState::kStartup, kStartupMessage);
    ready_at_s_ = faults_.startup_s;
  } else {
    SetState(KlippyState::kReady, "Printer is ready");
  }
  if (faults_.printing_at_start) {
    print.filename = "someone_elses_vase.gcode";
    // Half an hour of slow circles; the head remains where it was homed.
    print.lines = {"G28", "G1 Z10 F600"};
    for (int i = 0; i < 300; ++i) {
      print.lines.insert(print.lines.end(), {"G1 X200 Y50 F3000", "G1 X50 Y200 F3000"});
    }
    print.loaded = print.running = true;
    print.state = "printing";
  }
}

void VirtualKlipper::Reset() {
  scripts_.clear();
  timed_.clear();
  remote_methods_.clear();
  saved.clear();
  delayed_at_s.clear();
  gcode = {};
  commanded_mm = {};
  homed = {};
  print = {};
  save_config_pending = false;
  pending_items.clear();
  tools.clear();
  active_tool = -1;
  active_extruder = "extruder";
  for (const ToolConfig& tool : config_.tools) tools[tool.number].offset_mm = tool.offset_mm;
  idle_state = "Idle";
  epoch_s_ = now_s_;
  last_active_s_ = now_s_;
  motion_.Reset({});
  if (config_.load_cell) cell_ = std::make_unique<CellProbe>(*config_.load_cell);
  last_probe_z_mm = 0;
  kept.clear();
  kept_settings.reset();
  stopped_at_s_.reset();
  settings = {config_.max_velocity_mm_s, config_.max_accel_mm_s2,
              config_.square_corner_velocity_mm_s, config_.minimum_cruise_ratio};
  motors.clear();
  for (const Heater* heater : Heaters()) {
    const std::string& name = heater->config.name;
    if (heater == &bed) continue;
    SetMotor(name, {config_.pressure_advance_s, config_.smooth_time_s, ""});
  }
  for (const ExtruderStepperConfig& stepper : config_.extruder_steppers) {
    SetMotor("extruder_stepper " + stepper.name,
             {stepper.pressure_advance_s, stepper.smooth_time_s, stepper.extruder});
  }
  Record("max_velocity", settings.max_velocity_mm_s);
  Record("max_accel", settings.max_accel_mm_s2);
  Record("square_corner_velocity", settings.square_corner_velocity_mm_s);
  Record("minimum_cruise_ratio", settings.minimum_cruise_ratio);
  for (Heater* heater : Heaters()) {
    heater->powered = true;
    SetHeaterTarget(*heater, 0);
  }
  for (const PinConfig& pin : config_.pins) SetPin(pin.name, pin.value);
}

void VirtualKlipper::SetState(KlippyState state, const std::string& message) {
  state_ = state;
  state_message_ = message;
  state_since_s_ = now_s_;
  history_.states.push_back({now_s_, ToString(state), message});
}

void VirtualKlipper::Record(const std::string& name, double value) {
  history_.changes.push_back({now_s_, name, value});
}

void VirtualKlipper::SetPin(const std::string& name, double value) {
  pins[name] = value;
  Record("output_pin " + name, value);
}

void VirtualKlipper::SetHeaterTarget(Heater& heater, double target_c) {
  heater.target_c = target_c;
  heater.watch_until_s = 0;
  Record("target " + heater.config.name, target_c);
}

std::vector<Heater*> VirtualKlipper::Heaters() {
  std::vector<Heater*> heaters = {&nozzle, &bed};
  for (Heater& heater : more_nozzles) heaters.push_back(&heater);
  return heaters;
}

const Heater& VirtualKlipper::ActiveNozzle() const {
  for (const Heater& heater : more_nozzles) {
    if (heater.config.name == active_extruder) return heater;
  }
  return nozzle;
}

// Changes of the first extruder's motor are recorded without a suffix.
void VirtualKlipper::SetMotor(const std::string& section, const ExtruderMotor& motor) {
  motors[section] = motor;
  const std::string whose = section == "extruder" ? "" : " " + section;
  Record("pressure_advance" + whose, motor.pressure_advance_s);
  Record("smooth_time" + whose, motor.smooth_time_s);
}

void VirtualKlipper::MindSettings(SettingsRule rule) {
  if (rule == SettingsRule::kKeep) {
    kept_settings = {settings, motors};
    kept_in_print = print.state == "printing";
  }
  if (rule != SettingsRule::kBringBack || !kept_settings) return;
  settings.max_accel_mm_s2 = kept_settings->first.max_accel_mm_s2;
  settings.minimum_cruise_ratio = kept_settings->first.minimum_cruise_ratio;
  Record("max_accel", settings.max_accel_mm_s2);
  Record("minimum_cruise_ratio", settings.minimum_cruise_ratio);
  for (const auto& [section, motor] : kept_settings->second) SetMotor(section, motor);
  kept_settings.reset();
}

Heater* VirtualKlipper::FindHeater(const std::string& name) {
  for (Heater* heater : Heaters()) {
    if (heater->config.name == name) return heater;
  }
  return nullptr;
}

HeadState VirtualKlipper::TrueHead(double time_s) const {
  if (stopped_at_s_ && time_s >= *stopped_at_s_) return stopped_head_;
  HeadState head = motion_.At(PrintTimeAt(time_s));
  head.position.x_mm += physical_offset_mm[0];
  head.position.y_mm += physical_offset_mm[1];
  head.position.z_mm += physical_offset_mm[2];
  return head;
}

void VirtualKlipper::Respond(std::string text) {
  events_.push_back({KlipperEvent::Kind::kResponse, std::move(text), 0, {}, {}});
}

void VirtualKlipper::Inform(const std::string& text) {
  std::string marked;
  for (const std::string& line : SplitLines(text)) {
    marked += (marked.empty() ? "// " : "\n// ") + line;
  }
  Respond(marked);
}

std::vector<KlipperEvent> VirtualKlipper::TakeEvents() { return std::exchange(events_, {}); }

void VirtualKlipper::CallRemote(KlipperEvent event) {
  if (remote_methods_.count(event.text) > 0) events_.push_back(std::move(event));
}

std::uint64_t VirtualKlipper::RunScript(const std::string& script) {
  const std::uint64_t id = next_script_++;
  if (scripts_.size() >= kMaxScripts) {
    events_.push_back({KlipperEvent::Kind::kScriptDone, {}, id, "too many scripts wait", {}});
    return id;
  }
  scripts_.push_back({id, false, {{SplitLines(script), 0}}, {}});
  if (idle_state != "Printing") active_since_s = now_s_;
  idle_state = "Printing";
  last_active_s_ = now_s_;
  StepScripts();
  return id;
}

void VirtualKlipper::RunInternal(const std::vector<std::string>& lines) {
  scripts_.push_back({0, false, {{lines, 0}}, {}});
}

void VirtualKlipper::EmergencyStop() { Shutdown("Shutdown due to webhooks request"); }

void VirtualKlipper::StopHead() {
  if (stopped_at_s_) return;
  stopped_head_ = TrueHead(now_s_);
  stopped_head_.speed_mm_s = stopped_head_.filament_speed_mm_s = 0;
  stopped_at_s_ = now_s_;
  // Moves that had not begun are removed; the current move ends where the head stopped.
  auto& moves = history_.moves;
  while (!moves.empty() && moves.back().timed.start_s >= now_s_) moves.pop_back();
  if (!moves.empty() && moves.back().timed.end_s() > now_s_) {
    TimedMove& cut = moves.back().timed;
    const double share = StateAt(cut, now_s_).distance_mm / cut.length_mm;
    cut.move.to = {std::lerp(cut.move.from.x_mm, cut.move.to.x_mm, share),
                   std::lerp(cut.move.from.y_mm, cut.move.to.y_mm, share),
                   std::lerp(cut.move.from.z_mm, cut.move.to.z_mm, share)};
    cut.move.e_mm *= share;
    cut.length_mm *= share;
    const double moved_s = now_s_ - cut.start_s;
    cut.accelerate_s = std::min(cut.accelerate_s, moved_s);
    cut.cruise_s = std::min(cut.cruise_s, moved_s - cut.accelerate_s);
    cut.decelerate_s = moved_s - cut.accelerate_s - cut.cruise_s;
    if (!HasMotion(cut.move)) moves.pop_back();
  }
}

void VirtualKlipper::Shutdown(const std::string& reason) {
  if (state_ != KlippyState::kReady) return;
  StopHead();
  timed_.clear();
  delayed_at_s.clear();
  print.running = false;
  // Klipper pauses the file between two of its commands, until the restart.
  if (print.state == "printing") print.state = "paused";
  for (const PinConfig& pin : config_.pins) SetPin(pin.name, pin.shutdown_value);
  for (Heater* heater : Heaters()) {
    heater->powered = false;
    Record("power " + heater->config.name, 0);
  }
  SetState(KlippyState::kShutdown, reason + "\n" + kRestartHint);
  Inform("Klipper state: Shutdown");
}

void VirtualKlipper::Restart() {
  constexpr double kCloseS = 0.03;
  if (state_ != KlippyState::kDisconnected) restart_at_s_ = now_s_ + kCloseS;
}

void VirtualKlipper::At(double print_time_s, std::function<void()> function) {
  if (print_time_s <= print_now_s()) {
    function();
  } else {
    timed_.emplace(print_time_s, std::move(function));
  }
}

}  // namespace trammel::sim
