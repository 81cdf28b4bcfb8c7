// Time steps of the virtual Klipper.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sim/gcode/command.h"
#include "sim/klipper/commands.h"
#include "sim/klipper/machine.h"

namespace trammel::sim {
namespace {

constexpr double kTickS = 0.002;
constexpr int kLinesPerTick = 2000;
constexpr std::size_t kMaxFrames = 12;
constexpr double kHeaterStepS = 0.05;
constexpr double kUnblockS = 1;  // time until a script is unblocked after a shutdown

}  // namespace

void VirtualKlipper::Advance(double now_s) {
  clock_s_ = std::max(clock_s_, now_s);
  while (static_cast<double>(tick_ + 1) * kTickS <= now_s) {
    now_s_ = static_cast<double>(++tick_) * kTickS;
    Step();
  }
}

void VirtualKlipper::Step() {
  StepFaults();
  StepTimers();
  if (state_ == KlippyState::kDisconnected || state_ == KlippyState::kStartup) {
    StepHeaters();
    return;
  }
  // After a shutdown no queued action happens: no move, and no laser that switches on.
  if (state_ == KlippyState::kReady) motion_.Service(print_now_s());
  StepCell();
  while (state_ == KlippyState::kReady && !timed_.empty() &&
         timed_.begin()->first <= print_now_s()) {
    auto function = std::move(timed_.begin()->second);
    timed_.erase(timed_.begin());
    function();
  }
  StepFile();
  StepScripts();
  StepHeaters();
  StepIdle();
}

void VirtualKlipper::StepFaults() {
  if (faults_.shutdown_at_s && now_s_ >= *faults_.shutdown_at_s) {
    faults_.shutdown_at_s.reset();
    Shutdown("MCU 'mcu' shutdown: Timer too close");
  }
  if (faults_.restart_at_s && now_s_ >= *faults_.restart_at_s) {
    faults_.restart_at_s.reset();
    Restart();
  }
}

void VirtualKlipper::StepRestart() {
  if (restart_at_s_ && now_s_ >= *restart_at_s_) {
    restart_at_s_.reset();
    StopHead();
    const HeadState head = TrueHead(now_s_);
    Inform("Klipper state: Disconnect");
    events_.push_back({KlipperEvent::Kind::kDisconnected, {}, 0, {}, {}});
    Reset();
    physical_offset_mm = {head.position.x_mm, head.position.y_mm, head.position.z_mm};
    SetState(KlippyState::kDisconnected, "Klippy Host not connected");
    ready_at_s_ = now_s_ + config_.restart_s;
  }
  if (ready_at_s_ && now_s_ >= *ready_at_s_) {
    ready_at_s_.reset();
    if (faults_.error_at_start) {
      SetState(KlippyState::kError, kConfigError);
    } else {
      SetState(KlippyState::kReady, "Printer is ready");
      events_.push_back({KlipperEvent::Kind::kReady, {}, 0, {}, {}});
    }
  }
}

void VirtualKlipper::StepTimers() {
  StepRestart();
  if (state_ != KlippyState::kReady) return;
  if (kept_settings && kept_in_print && print.state != "printing" && print.state != "paused") {
    MindSettings(SettingsRule::kBringBack);
  }
  std::vector<std::string> due;
  for (const auto& [name, time_s] : delayed_at_s) {
    if (now_s_ >= time_s) due.push_back(name);
  }
  for (const std::string& name : due) {
    delayed_at_s.erase(name);
    RunInternal(config_.delayed_gcode.at(name));
  }
}

void VirtualKlipper::StepHeaters() {
  if (tick_ % static_cast<std::int64_t>(kHeaterStepS / kTickS) != 0) return;
  for (Heater* heater : Heaters()) {
    HeatFor(*heater, kHeaterStepS, config_.room_c);
    if (state_ == KlippyState::kReady && !HeatsAsExpected(*heater, now_s_) &&
        faults_.verify_heaters) {
      Shutdown(
          fmt::format("Heater {} not heating at expected rate\nSee the 'verify_heater' section in "
                      "docs/Config_Reference.md\nfor the parameters that control this check.",
                      heater->config.name));
    }
  }
}

void VirtualKlipper::StepCell() {
  if (!cell_) return;
  cell_->Advance(print_now_s(), [this](double print_time_s) -> NozzleState {
    const HeadState head = TrueHead(print_time_s + epoch_s_);
    const Position& at = head.position;
    return {at.z_mm, head.speed_mm_s, cell_->SurfaceZ(at.x_mm, at.y_mm)};
  });
  if (history_.taps.empty() || history_.taps.back().truth) return;
  // The nozzle is lifted by the commands after the probing.
  ProbedTap& tap = history_.taps.back();
  tap.truth = cell_->EndedPress(tap.moves.empty() ? 0 : tap.moves.front().start_time_s);
}

void VirtualKlipper::StepIdle() {
  if (state_ != KlippyState::kReady) return;
  constexpr double kSettleS = 0.5;
  if (!scripts_.empty() || print.running || motion_.waiting() ||
      motion_.print_time_s() > print_now_s()) {
    if (idle_state != "Printing") active_since_s = now_s_;
    idle_state = "Printing";
    last_active_s_ = now_s_;
  } else if (idle_state == "Printing" && now_s_ - last_active_s_ > kSettleS) {
    idle_state = "Ready";
  } else if (idle_state == "Ready" && now_s_ - last_active_s_ > config_.idle_timeout_s) {
    RunInternal(config_.idle_gcode);
    StepScripts();
    idle_state = "Idle";
  }
}

void VirtualKlipper::StepFile() {
  if (state_ != KlippyState::kReady || !print.running || !scripts_.empty()) return;
  if (print.next >= print.lines.size()) {
    if (motion_.waiting()) motion_.Flush(print_now_s());
    print.running = print.loaded = false;
    print.read_bytes = print.size_bytes;
    print.state = "complete";
    print.ended_s = now_s_;
    Respond("Done printing file");
    return;
  }
  // Runs many lines at a time, each as its own script, while no other client uses the printer.
  for (int lines = 0; lines < kLinesPerTick && print.running && print.next < print.lines.size();
       ++lines) {
    const std::string& text = print.lines[print.next++];
    print.read_bytes = std::min(print.size_bytes, print.read_bytes + text.size() + 1);
    scripts_.push_back({0, true, {{{text}, 0}}, {}});
    while (!scripts_.empty()) {
      if (!StepScript()) return;
    }
  }
}

void VirtualKlipper::StepScripts() {
  for (int lines = 0; lines < kLinesPerTick && !scripts_.empty(); ++lines) {
    if (!StepScript()) return;
  }
}

bool VirtualKlipper::StepScript() {
  Script& script = scripts_.front();
  if (script.wait) {
    const Result<bool> done = script.wait(*this);
    if (!done) {
      FinishScript(done.error().message);
      return true;
    }
    const bool released = state_ == KlippyState::kShutdown && now_s_ - state_since_s_ >= kUnblockS;
    if (!*done && !released) return false;
    script.wait = nullptr;
  }
  while (!script.frames.empty() && script.frames.back().next >= script.frames.back().lines.size()) {
    script.frames.pop_back();
  }
  if (script.frames.empty()) {
    FinishScript(std::nullopt);
    return true;
  }
  Frame& frame = script.frames.back();
  const std::string text = frame.lines[frame.next++];
  if (const Result<void> run = RunLine(text); !run) FinishScript(run.error().message);
  return true;
}

Result<void> VirtualKlipper::RunLine(const std::string& text) {
  const Command line = ParseCommand(text, 0, Letters::kRuns);
  if (line.name.empty()) return {};
  history_.lines.push_back({now_s_, line.text});
  Outcome outcome = TRY(RunCommand(*this, line));
  Script& script = scripts_.front();
  script.wait = std::move(outcome.wait);
  if (!outcome.lines.empty()) {
    if (script.frames.size() >= kMaxFrames) {
      return Fail(fmt::format("Macro {} called recursively", line.name));
    }
    script.frames.push_back({std::move(outcome.lines), 0});
  }
  return {};
}

void VirtualKlipper::FinishScript(const std::optional<std::string>& error) {
  const Script script = std::move(scripts_.front());
  scripts_.pop_front();
  if (error) {
    std::string told = *error;
    while (!told.empty() && told.back() == '\n') told.pop_back();
    if (told.find('\n') != std::string::npos) Inform(told);
    Respond("!! " + told.substr(0, told.find('\n')));
    for (std::size_t axis = 0; axis < 4; ++axis) gcode.last_mm[axis] = commanded_mm[axis];
    if (script.from_file) {
      print.running = false;
      print.state = "error";
      print.message = *error;
      print.ended_s = now_s_;
      RunInternal({"TURN_OFF_HEATERS"});
    }
  }
  if (script.id != 0) {
    events_.push_back({KlipperEvent::Kind::kScriptDone, {}, script.id, error, {}});
  }
}

}  // namespace trammel::sim
