#include "sim/spindle/mill.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

namespace trammel::sim {
namespace {

constexpr const char* kLetters = "XYZC";

std::string Upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// The number behind a letter that begins a word of a block.
std::optional<double> Word(std::string_view block, char letter) {
  for (std::size_t at = 0; at + 1 < block.size(); ++at) {
    if (block[at] != letter || (at > 0 && block[at - 1] != ' ')) continue;
    double number = 0;
    const auto read = std::from_chars(block.data() + at + 1, block.data() + block.size(), number);
    if (read.ec == std::errc() && std::isfinite(number)) return number;
  }
  return std::nullopt;
}

bool Has(std::string_view block, std::string_view word) {
  return block.find(word) != std::string_view::npos;
}

}  // namespace

VirtualMill::VirtualMill(const MillOptions& options) : options_(options) {
  std::copy(options.start_mm.begin(), options.start_mm.end(), from_.begin());
  to_ = from_;
  answers_ = {
      {"ESTOP", "OFF"},
      {"MACHINE", "ON"},
      {"MODE", "MANUAL"},
      {"SPINDLE 0", options.faults.spindle_turns ? "0 FORWARD" : "0 OFF"},
      {"USER_LINEAR_UNITS", "MM"},
      {"JOINT_HOMED", options.faults.not_homed ? "NO NO NO NO NO NO" : "YES YES YES YES NO NO"}};
}

double VirtualMill::Progress(double now_s) const {
  if (!(duration_s_ > 0)) return 1;
  return std::clamp((std::min(now_s, estop_s_) - begin_s_) / duration_s_, 0.0, 1.0);
}

std::array<double, 4> VirtualMill::Now(double now_s) const {
  const double progress = Progress(now_s);
  std::array<double, 4> at{};
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = from_[i] + progress * (to_[i] - from_[i]);
  return at;
}

MillPlace VirtualMill::At(double now_s) const {
  const std::lock_guard lock(mutex_);
  const auto at = Now(now_s);
  const bool moving = Progress(now_s) < 1 && now_s < estop_s_;
  return {{at[0], at[1], at[2]}, at[3], moving, approach_, turn_};
}

bool VirtualMill::serves() const {
  const std::lock_guard lock(mutex_);
  return serves_;
}

void VirtualMill::Stop(double now_s) {
  from_ = to_ = Now(now_s);
  duration_s_ = 0;
}

std::string VirtualMill::Answer(const std::string& line, double now_s) {
  const std::lock_guard lock(mutex_);
  if (now_s >= estop_s_) {
    Stop(now_s);
    answers_["ESTOP"] = "ON";
    answers_["MACHINE"] = "OFF";
  }
  if (line.starts_with("hello ")) return "HELLO ACK EMCNETSVR 1.1\r\n";
  if (line == "set echo off") return "set echo off\r\n";
  if (line.starts_with("set ")) return Set(line.substr(4), now_s);
  if (line.starts_with("get ")) return Get(Upper(line.substr(4)), now_s);
  return {};
}

std::string VirtualMill::Get(const std::string& name, double now_s) {
  const std::string word = name.substr(0, name.find(' '));
  std::string value;
  if (name == "ERROR") {
    value = std::exchange(error_, "OK");
  } else if (name == "OPERATOR_DISPLAY") {
    value = std::exchange(display_, "OK");
  } else if (name == "PROGRAM_STATUS") {
    value = Progress(now_s) < 1 && now_s < estop_s_ ? "RUNNING" : "IDLE";
  } else if (name == "ABS_ACT_POS") {
    const auto at = Now(now_s);
    value = fmt::format("{:f} {:f} {:f} 0.000000 0.000000 {:f}", at[0], at[1], at[2], at[3]);
  } else if (const auto known = answers_.find(name); known != answers_.end()) {
    value = known->second;
  } else {
    return "GET " + word + " NAK\r\n";
  }
  return word + " " + value + "\r\n";
}

std::string VirtualMill::Set(const std::string& what, double now_s) {
  const std::string name = Upper(what.substr(0, what.find(' ')));
  if (name == "MODE") answers_["MODE"] = Upper(what.substr(std::min<std::size_t>(5, what.size())));
  if (name == "ABORT") Stop(now_s);
  if (name == "MDI") {
    if (answers_["MODE"] != "MDI") {
      error_ = "Must be in MDI mode to issue MDI command";
    } else if (answers_["MACHINE"] != "ON") {
      error_ = "Can't do that (EMC_TASK_PLAN_EXECUTE) when machine is off";
    } else {
      Mdi(what.substr(std::min<std::size_t>(4, what.size())), now_s);
    }
  }
  return "SET " + name + " ACK\n\r";
}

// Values of the INI file in a message; other parameters are not kept.
std::string VirtualMill::Shown(const std::string& text) const {
  std::string shown;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t end = text.compare(i, 7, "#<_ini[") == 0 ? text.find('>', i) : text.npos;
    if (end == text.npos) {
      shown += text[i];
      continue;
    }
    const std::string name = text.substr(i + 7, end - i - 7);
    std::string value = "######";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string section = fmt::format("AXIS_{}]", kLetters[axis]);
      if (name == section + "MIN_LIMIT") value = fmt::format("{:f}", options_.travel_low_mm[axis]);
      if (name == section + "MAX_LIMIT") value = fmt::format("{:f}", options_.travel_high_mm[axis]);
    }
    shown += value;
    i = end;
  }
  return shown;
}

void VirtualMill::Mdi(const std::string& block, double now_s) {
  constexpr std::string_view kMessage = "(debug,";
  if (block.starts_with(kMessage)) {
    display_ = Shown(block.substr(kMessage.size(), block.size() - kMessage.size() - 1));
  } else if (Has(block, "G53 G1 ")) {
    Move(block, now_s);
  }
}

void VirtualMill::Move(const std::string& block, double now_s) {
  ++moves_;
  const MillFaults& faults = options_.faults;
  if (moves_ == faults.refused_at_move) {
    error_ = "Linear move on line 0 would exceed joint 0's positive limit";
    return;
  }
  const std::array<double, 4> from = Now(now_s);
  std::array<double, 4> to = from;
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = Word(block, kLetters[i]).value_or(to[i]);
  for (std::size_t i = 0; i < 3; ++i) {
    if (to[i] >= options_.travel_low_mm[i] && to[i] <= options_.travel_high_mm[i]) continue;
    error_ = fmt::format("Linear move on line 0 would exceed {}'s {} limit", kLetters[i],
                         to[i] < options_.travel_low_mm[i] ? "negative" : "positive");
    return;
  }
  constexpr double kMostTurned_deg = 36'000;
  if (std::abs(to[3]) > kMostTurned_deg) {
    error_ = "Linear move on line 0 would exceed C's positive limit";
    return;
  }
  const double way_mm = std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  const double turn_deg = std::abs(to[3] - from[3]);
  // Without X, Y and Z the speed is in degrees/min.
  const double way = way_mm > 0 ? way_mm : turn_deg;
  const double feed = Word(block, 'F').value_or(1) / 60 * options_.hurry;
  from_ = from;
  to_ = to;
  begin_s_ = now_s;
  duration_s_ = feed > 0 ? way / feed : 0;
  approach_ += way_mm > 0 ? 1 : 0;
  turn_ += turn_deg > 0 ? 1 : 0;
  if (moves_ == faults.estop_at_move) estop_s_ = now_s + duration_s_ / 2;
  if (faults.silent_at_move > 0 && moves_ >= faults.silent_at_move) serves_ = false;
}

}  // namespace trammel::sim
