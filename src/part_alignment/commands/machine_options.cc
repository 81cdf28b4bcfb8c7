#include "part_alignment/commands/machine_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <sstream>
#include <string_view>

#include "app/option_values.h"
#include "base/check.h"

namespace trammel::app {
namespace {

using part_alignment::MachineBox;

constexpr std::size_t kNumbers = 6;

}  // namespace

void AddNumber(CLI::App& command, const std::string& option, double& value, const std::string& help,
               double least, double most, const std::string& group) {
  command.add_option(option, value, help)
      ->check(NumberIn(least, most))
      ->capture_default_str()
      ->group(group);
}

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
  // Prepares before waiting for a camera, to report at once what forbids a motion.
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

void AddMachineBoxes(CLI::App& command, MachineBoxArguments& arguments, const std::string& group) {
  command
      .add_option("--travel", arguments.travel,
                  "of the spindle: the least X,Y,Z and the most X,Y,Z")
      ->expected(static_cast<int>(kNumbers))
      ->delimiter(',')
      ->group(group);
  command
      .add_option("--obstacle", arguments.obstacles,
                  "least X,Y,Z and most X,Y,Z of part or fixture; may be repeated")
      ->delimiter(',')
      ->group(group);
  AddNumber(command, "--camera-radius", arguments.camera_radius_mm,
            "of what hangs in the spindle, mm", 0.0, 1e4, group);
  AddNumber(command, "--camera-below", arguments.camera_below_mm,
            "from the spindle's reference point to the camera's lower end, mm; 0: 30 mm "
            "beyond the camera's origin by its file",
            0.0, 1e4, group);
}

MachineBox BoxOf(const std::vector<double>& n, std::size_t from) {
  return {{n[from], n[from + 1], n[from + 2]}, {n[from + 3], n[from + 4], n[from + 5]}};
}

Result<std::vector<MachineBox>> ObstaclesOf(const MachineBoxArguments& arguments) {
  const std::vector<double>& n = arguments.obstacles;
  if (n.size() % kNumbers != 0) {
    return Fail("--obstacle takes six numbers: the least X, Y, Z and the most X, Y, Z");
  }
  std::vector<MachineBox> boxes;
  for (std::size_t i = 0; i < n.size(); i += kNumbers) boxes.push_back(BoxOf(n, i));
  return boxes;
}

MachineBox TravelOf(const MachineBoxArguments& arguments) {
  TRAMMEL_CHECK(arguments.travel.size() == kNumbers, "{} numbers", arguments.travel.size());
  return BoxOf(arguments.travel, 0);
}

}  // namespace trammel::app
