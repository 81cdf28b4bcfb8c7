#include "part_alignment/commands/align_start.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "app/provenance.h"
#include "app/secrets.h"
#include "base/check.h"
#include "base/json_text.h"
#include "part_alignment/correction/control_text.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::MachineBox;
using procedure::ParseBoxes;
using procedure::ParseNumbers;
using procedure::StartAnswers;
using procedure::StartQuestion;

constexpr double kRadPerMmPerM = 1e-3;
constexpr double kNearest_mm = 20;
constexpr double kFarthest_mm = 10'000;

Result<void> IsFile(const std::string& text) {
  std::error_code fault;
  if (fs::is_regular_file(text, fault)) return {};
  return Fail(text + " is no file");
}

Result<void> IsMachine(const std::string& text) {
  if (text == "none") return {};
  LinuxCncArguments arguments;
  arguments.address = text;
  TRY(ParseLinuxCnc(arguments));
  return {};
}

Result<void> IsSpindle(const std::string& text) {
  if (text == "c-axis" || text == "locked") return {};
  return Fail(text + ": say c-axis or locked");
}

Result<void> IsSource(const std::string& text) {
  TRY(CameraAddressOf("--source", text));
  return {};
}

Result<void> IsWorkOffset(const std::string& text) {
  TRY(part_alignment::ParseOffsetSlot(part_alignment::Control::kLinuxCnc, text));
  return {};
}

auto AreNumbers(std::size_t count) {
  return [count](const std::string& text) -> Result<void> {
    TRY(ParseNumbers(text, count));
    return {};
  };
}

Result<void> AreBoxes(const std::string& text) {
  TRY(ParseBoxes(text));
  return {};
}

Result<void> IsDistance(const std::string& text) {
  const auto number = TRY(ParseNumbers(text, 1));
  if (number.front() >= kNearest_mm && number.front() <= kFarthest_mm) return {};
  return Fail(fmt::format("{} mm is not within {} … {}", text, kNearest_mm, kFarthest_mm));
}

MachineBox BoxOf(const std::vector<double>& n, std::size_t from) {
  return {{n[from], n[from + 1], n[from + 2]}, {n[from + 3], n[from + 4], n[from + 5]}};
}

// What the controller tells.
std::string TravelText(const machine::LinuxCncFacts& facts) {
  const Eigen::Vector3d& low = facts.travel.low_mm;
  const Eigen::Vector3d& high = facts.travel.high_mm;
  return fmt::format("{},{},{},{},{},{}", low.x(), low.y(), low.z(), high.x(), high.y(), high.z());
}

std::string ObstacleOptions(const StartValues& values) {
  std::string options;
  for (const MachineBox& box : values.obstacles) {
    options += fmt::format(" --obstacle {},{},{},{},{},{}", box.low_mm.x(), box.low_mm.y(),
                           box.low_mm.z(), box.high_mm.x(), box.high_mm.y(), box.high_mm.z());
  }
  return options;
}

std::string MeasureCommand(const StartFiles& names, const StartValues& values) {
  std::string command =
      fmt::format("trammel align measure {} --source {} --out {}", ShellQuoted(names.views),
                  ShellQuoted(values.source), ShellQuoted(names.folder));
  if (!values.id_prefix.empty()) command += " --id-prefix " + ShellQuoted(values.id_prefix);
  if (values.bits != 14) command += fmt::format(" --bits {}", values.bits);
  if (values.machine == "none") return command;
  return command + fmt::format(" --machine {} --joints {} {} --safe-z {} --travel {}{}",
                               ShellQuoted(values.machine), values.joints,
                               values.c_holds_spindle ? "--c-axis" : "--spindle-locked",
                               values.safe_z_mm, values.answers.at("travel"),
                               ObstacleOptions(values));
}

}  // namespace

std::vector<StartQuestion> MachineQuestions() {
  return {{"machine", "the machine: session, the LinuxCNC that runs on this computer, or none",
           "session", IsMachine}};
}

std::vector<StartQuestion> JobQuestions(const std::optional<machine::LinuxCncFacts>& facts,
                                        const StartAnswers& answers) {
  const bool has_c = facts && facts->HasAxis('C');
  const std::string travel = facts ? TravelText(*facts) : "";
  const auto given = answers.find("travel");
  const auto numbers = ParseNumbers(given == answers.end() ? travel : given->second, 6);
  const std::string highest = numbers ? fmt::format("{}", numbers->back()) : "";
  return {
      {"camera", "the camera's file, as align calibrate or align camera left it", "", IsFile,
       "camera.json"},
      {"targets", "the file of the part's targets, as align fit or align survey left it", "",
       IsFile, "targets.json"},
      {"source", "where its pictures come from: a folder, /dev/videoN, aravis:ID, http://…", "",
       IsSource, "pictures"},
      {"spindle", "what holds the spindle: c-axis, or locked (by hand)",
       has_c ? "c-axis" : "locked", IsSpindle},
      {"travel", "the spindle's travel: the least X,Y,Z and the most X,Y,Z, mm", travel,
       AreNumbers(6), "0,0,-500,1000,600,0"},
      {"safe-z", "machine Z at which the spindle may cross everywhere, mm", highest, AreNumbers(1),
       "-5"},
      {"rough", "about where the part's origin is in the machine, X,Y,Z mm", "", AreNumbers(3),
       "400,250,-450"},
      {"rough-angles", "about how the part is turned, alpha,beta,gamma mm/m", "0,0,0",
       AreNumbers(3)},
      {"obstacle",
       "boxes about part and fixture that the camera has to keep clear of, least X,Y,Z and most "
       "X,Y,Z each, with blanks between them; or none",
       "", AreBoxes, "none"},
      {"distance", "from camera to target, mm; within what the camera was calibrated for", "300",
       IsDistance},
      {"work-offset", "the work offset that is to be set", "G54", IsWorkOffset}};
}

StartValues ValuesOf(const StartAnswers& answers,
                     const std::optional<machine::LinuxCncFacts>& facts, int joints) {
  const auto numbers = [&](const std::string& name, std::size_t count) {
    auto parsed = ParseNumbers(answers.at(name), count);
    TRAMMEL_CHECK(parsed.has_value(), "{} was not checked", name);
    return *parsed;
  };
  StartValues values;
  values.answers = answers;
  values.machine = answers.at("machine");
  values.camera = answers.at("camera");
  values.targets = answers.at("targets");
  values.source = answers.at("source");
  values.c_holds_spindle = answers.at("spindle") == "c-axis";
  values.joints = joints > 0 ? joints : facts ? facts->joints : values.c_holds_spindle ? 4 : 3;
  const auto rough = numbers("rough", 3);
  values.rough_mm = {rough[0], rough[1], rough[2]};
  const auto turn = numbers("rough-angles", 3);
  values.rough_rad = kRadPerMmPerM * Eigen::Vector3d(turn[0], turn[1], turn[2]);
  values.travel = BoxOf(numbers("travel", 6), 0);
  const auto boxes = ParseBoxes(answers.at("obstacle"));
  TRAMMEL_CHECK(boxes.has_value(), "obstacle was not checked");
  for (std::size_t i = 0; i < boxes->size(); i += 6) {
    values.obstacles.push_back(BoxOf(*boxes, i));
  }
  values.safe_z_mm = numbers("safe-z", 1)[0];
  values.distance_mm = numbers("distance", 1)[0];
  values.work_offset = answers.at("work-offset");
  return values;
}

StartFiles::StartFiles(const fs::path& in)
    : folder(in), settings(in / "setup.json"), views(in / "views.json") {}

std::string SettingsText(const StartFiles& names, const StartValues& values) {
  const auto from_folder = [&](const std::string& path) {
    std::error_code fault;
    const fs::path relative = fs::proximate(path, names.folder, fault);
    return fault || relative.empty() ? fs::absolute(path).string() : relative.string();
  };
  const nlohmann::ordered_json json = {{"format", 1},
                                       {"camera", from_folder(values.camera)},
                                       {"targets", from_folder(values.targets)},
                                       {"unknowns", {"pose", "clamp_angle"}},
                                       {"views", nlohmann::ordered_json::array()}};
  return JsonText(json);
}

std::string CommandsText(const StartFiles& names, const StartValues& values) {
  const std::string folder = ShellQuoted(names.folder);
  const std::string result = ShellQuoted(names.folder / "result.json");
  const std::string write = values.machine == "none" ? "session" : values.machine;
  const auto& answers = values.answers;
  std::string text =
      "# Clamp the camera at the angle at which it was calibrated, C at 0. Then:\n"
      "# 1. The views are planned; once more where part or fixture stand elsewhere.\n";
  text += fmt::format(
      "trammel align plan {} --rough {} --rough-angles {} --travel {}{} "
      "--distance {} --out {} --force\n",
      ShellQuoted(names.settings), answers.at("rough"), answers.at("rough-angles"),
      answers.at("travel"), ObstacleOptions(values), answers.at("distance"),
      ShellQuoted(names.views));
  text +=
      values.machine == "none"
          ? "# 2. Read the pictures, one of each view. With a machine it drives, too: --machine.\n"
          : "# 2. Drive through the views, take and read the pictures. THE MACHINE MOVES.\n";
  text += MeasureCommand(names, values) + "\n";
  text += "# 3. Solve once more, with a simulation beside it. Of several measurements name one.\n";
  text += fmt::format(
      "trammel align solve {}/part_alignment-*Z/observations.json --trials 10000 --result {} "
      "--report {}\n",
      folder, result, ShellQuoted(names.folder / "report"));
  text += "# 4. Look at the work offset, and at what it leaves over. Shims: --supports FILE.\n";
  text += fmt::format("trammel align correct {} --work-offset {}\n", result, values.work_offset);
  text += "# 5. Set it (G10 L2) and read it back.\n";
  text += fmt::format("trammel align correct {} --work-offset {} --write {} --joints {}\n", result,
                      values.work_offset, ShellQuoted(write), values.joints);
  return text;
}

}  // namespace trammel::app
