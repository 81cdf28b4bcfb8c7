#include "machine/linuxcnc/linuxcnc_shell_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "machine/linuxcnc/linuxcnc_limits.h"
#include "machine/net/host_clock.h"
#include "machine/net/wait_fd.h"

namespace trammel::machine {
namespace {

constexpr double kPoll_s = 0.02;
constexpr const char* kSpindleOff = "0 OFF";
constexpr const char* kIdle = "IDLE";

tl::unexpected<Error> Broken(std::string what) {
  return Fail(std::move(what), ErrorKind::kMachine);
}

// False once stopped.
bool Pause(const std::stop_token& stop) {
  return WaitForFd(-1, 0, HostNow() + kPoll_s, stop) != Waited::kStopped;
}

Result<std::vector<double>> Numbers(const std::string& what, const std::string& answer,
                                    std::size_t least) {
  std::istringstream stream(answer);
  std::vector<double> numbers;
  for (double number = 0; stream >> number;) numbers.push_back(number);
  if (numbers.size() < least ||
      !std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); })) {
    return Broken(fmt::format("LinuxCNC answers \"{}\" to \"get {}\"; {} numbers were expected",
                              Clipped(answer), what, least));
  }
  return numbers;
}

// Asks one thing after the other and keeps the first error.
class Asked {
 public:
  Asked(LinuxCncShell& shell, const std::stop_token& stop) : shell_(shell), stop_(stop) {}
  std::string operator()(const std::string& what) {
    if (error) return {};
    auto answer = shell_.Get(what, stop_);
    if (!answer) error = answer.error();
    return answer.value_or("");
  }
  std::optional<Error> error;

 private:
  LinuxCncShell& shell_;
  const std::stop_token& stop_;
};

}  // namespace

LinuxCncShellLink::LinuxCncShellLink(LinuxCncShell shell, LinuxCncAddress address)
    : shell_(std::move(shell)), address_(std::move(address)) {}

Result<std::unique_ptr<LinuxCncShellLink>> LinuxCncShellLink::Connect(
    const LinuxCncAddress& address, const std::stop_token& stop) {
  auto shell = LinuxCncShell::Connect(address, stop);
  if (!shell) return tl::unexpected(shell.error());
  // Else positions come in the unit of the program that ran last.
  if (auto set = shell->Set("linear_unit_conversion mm", stop); !set) {
    return tl::unexpected(set.error());
  }
  return std::unique_ptr<LinuxCncShellLink>(new LinuxCncShellLink(std::move(*shell), address));
}

Result<Eigen::Vector4d> LinuxCncShellLink::Position(const std::stop_token& stop) {
  constexpr std::size_t kC = 5;
  const auto answer = shell_.Get("abs_act_pos", stop);
  if (!answer) return tl::unexpected(answer.error());
  const auto numbers = Numbers("abs_act_pos", *answer, kC + 1);
  if (!numbers) return tl::unexpected(numbers.error());
  return Eigen::Vector4d((*numbers)[0], (*numbers)[1], (*numbers)[2], (*numbers)[kC]);
}

Result<LinuxCncState> LinuxCncShellLink::State(int joints, const std::stop_token& stop) {
  LinuxCncState state;
  Asked get(shell_, stop);
  state.estop = get("estop") != "OFF";
  state.on = get("machine") == "ON";
  state.mode = get("mode");
  state.spindle_stopped = get("spindle 0") == kSpindleOff;
  state.idle = get("program_status") == kIdle;
  state.metric = get("user_linear_units") == "MM";
  std::istringstream homed(get("joint_homed"));
  if (get.error) return tl::unexpected(*get.error);
  state.homed = true;
  for (int joint = 0; joint < joints; ++joint) {
    std::string word;
    homed >> word;
    state.homed = state.homed && word == "YES";
  }
  const auto position = Position(stop);
  if (!position) return tl::unexpected(position.error());
  state.position_mm = position->head<3>();
  state.c_deg = (*position)[3];
  return state;
}

Result<LinuxCncMotion> LinuxCncShellLink::Motion(const std::stop_token& stop) {
  LinuxCncMotion motion;
  const auto position = Position(stop);
  if (!position) return tl::unexpected(position.error());
  motion.position = *position;
  auto complaint = Complaint(stop);
  if (!complaint) return tl::unexpected(complaint.error());
  motion.complaint = std::move(*complaint);
  Asked get(shell_, stop);
  motion.mode = get("mode");
  motion.on = get("machine") == "ON";
  motion.spindle_stopped = get("spindle 0") == kSpindleOff;
  motion.idle = get("program_status") == kIdle;
  if (get.error) return tl::unexpected(*get.error);
  return motion;
}

Result<void> LinuxCncShellLink::TakeMdi(const std::stop_token& stop) {
  const double deadline_s = HostNow() + address_.time_limit_s;
  bool asked = false;
  while (HostNow() < deadline_s) {
    const auto mode = shell_.Get("mode", stop);
    if (!mode) return tl::unexpected(mode.error());
    if (*mode == "MDI") return {};
    if (!std::exchange(asked, true)) {
      if (auto set = shell_.Set("mode mdi", stop); !set) return set;
    } else if (!Pause(stop)) {
      return Fail("stopped", ErrorKind::kInterrupted);
    }
  }
  return Broken("LinuxCNC does not go into MDI mode; does another panel hold it?");
}

Result<void> LinuxCncShellLink::Mdi(const std::string& block, const std::stop_token& stop) {
  return shell_.Set("mdi " + block, stop);
}
Result<void> LinuxCncShellLink::Move(const std::string& block, const std::stop_token& stop) {
  return Mdi(block, stop);
}

Result<std::string> LinuxCncShellLink::Interpreted(const std::string& text,
                                                   const std::stop_token& stop) {
  const std::string mark = fmt::format("trammel {} ", ++messages_);
  // Only MDI shows parameters, and only in messages to the operator.
  if (auto set = Mdi(fmt::format("(debug,{}{})", mark, text), stop); !set) {
    return tl::unexpected(set.error());
  }
  const double deadline_s = HostNow() + address_.time_limit_s;
  while (HostNow() < deadline_s) {
    const auto shown = shell_.Get("operator_display", stop);
    if (!shown) return tl::unexpected(shown.error());
    if (shown->starts_with(mark)) return shown->substr(mark.size());
    if (*shown == "OK" && !Pause(stop)) return Fail("stopped", ErrorKind::kInterrupted);
  }
  return Broken(
      "LinuxCNC does not show its parameters; does another panel take its messages? Beside a "
      "screen (AXIS, QtDragon) name \"session\" instead of linuxcncrsh's address");
}

Result<std::optional<std::string>> LinuxCncShellLink::Complaint(const std::stop_token& stop) {
  const auto error = shell_.Get("error", stop);
  if (!error) return tl::unexpected(error.error());
  return *error == "OK" ? std::optional<std::string>() : std::optional(*error);
}

Result<void> LinuxCncShellLink::ForgetComplaints(const std::stop_token& stop) {
  constexpr int kMost = 100;
  for (int i = 0; i < kMost; ++i) {
    const auto old = Complaint(stop);
    if (!old) return tl::unexpected(old.error());
    if (!*old) return {};
  }
  return Broken("LinuxCNC does not stop reporting errors; look at its own screen");
}

Result<void> LinuxCncShellLink::Abort() {
  const std::stop_token never;
  auto aborted = shell_.Set("abort", never);
  if (aborted) return aborted;
  // The line may be gone and the controller not.
  auto again = LinuxCncShell::Connect(address_, never);
  if (!again) return aborted;
  shell_ = std::move(*again);
  return shell_.Set("abort", never);
}

}  // namespace trammel::machine
