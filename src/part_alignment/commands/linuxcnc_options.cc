#include "part_alignment/commands/linuxcnc_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <sstream>
#include <string_view>

namespace trammel::app {

void AddLinuxCncOptions(CLI::App& command, const std::string& option, const std::string& help,
                        LinuxCncArguments& arguments) {
  constexpr const char* kGroup = "LinuxCNC";
  machine::LinuxCncOptions& options = arguments.options;
  command.add_option(option, arguments.address, help)->group(kGroup);
  command.add_option("--joints", options.joints, "joints that must be homed, from 0")
      ->check(CLI::Range(1, 16))
      ->capture_default_str()
      ->group(kGroup);
  command.add_flag("--c-axis", options.c_holds_spindle, "C is the spindle's axis and holds it")
      ->group(kGroup);
  command
      .add_flag("--spindle-locked", options.spindle_locked_by_hand,
                "you have stopped, oriented and locked the spindle")
      ->group(kGroup);
}

Result<machine::LinuxCncOptions> ParseLinuxCnc(const LinuxCncArguments& arguments) {
  constexpr std::string_view kSession = "session";
  machine::LinuxCncOptions options = arguments.options;
  std::string_view text = arguments.address;
  if (text == kSession) return options;
  const bool helper = text.starts_with(kSession) && text.substr(kSession.size()).starts_with(':');
  std::istringstream words(helper ? std::string(text.substr(kSession.size() + 1)) : std::string());
  for (std::string word; words >> word;) options.session.helper.push_back(word);
  if (!options.session.helper.empty()) return options;
  return Fail(
      fmt::format("{}: LinuxCNC is \"session\", the one that runs on this computer, or "
                  "session:PROGRAM of a helper that speaks for another",
                  text));
}

Result<std::unique_ptr<machine::LinuxCnc>> ConnectLinuxCnc(const LinuxCncArguments& arguments,
                                                           const std::stop_token& stop) {
  const auto address = TRY(ParseLinuxCnc(arguments));
  auto linuxcnc = machine::LinuxCnc::Connect(address, stop);
  if (!linuxcnc) return linuxcnc;
  // Before a camera is waited for: what forbids a motion is said at once.
  TRY((*linuxcnc)->Prepare(true, stop));
  return linuxcnc;
}

Result<Eigen::Vector3d> StandsAt(machine::LinuxCnc& linuxcnc, std::optional<double> c_deg,
                                 const std::stop_token& stop) {
  const auto state = TRY(linuxcnc.State(stop));
  if (!state.spindle_stopped) {
    return Fail("the spindle turns; stop it: a camera is to sit in it", ErrorKind::kSafety);
  }
  constexpr double kOriented_deg = 0.01;
  if (c_deg && std::abs(state.c_deg - *c_deg) > kOriented_deg) {
    return Fail(fmt::format("the spindle's axis C stands at {:.4f} degrees, and the plan has it at "
                            "{:g}: turn it there",
                            state.c_deg, *c_deg),
                ErrorKind::kSafety);
  }
  return state.position_mm;
}

}  // namespace trammel::app
