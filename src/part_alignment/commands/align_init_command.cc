// trammel align init: makes the files that plan and measure read, and lists the next commands.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/provenance.h"
#include "app/secrets.h"
#include "app/slow_work.h"
#include "app/terminal_operator.h"
#include "base/check.h"
#include "base/json_text.h"
#include "files/new_file.h"
#include "part_alignment/camera/calibration_record.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/commands/machine_options.h"
#include "part_alignment/correction/control_text.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/procedure/start_dialogue.h"
#include "part_alignment/views/machine_box.h"
#include "part_alignment/views/view_plan.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::MachineBox;
using procedure::ParseBoxes;
using procedure::ParseNumbers;
using procedure::StartAnswers;
using procedure::StartContradiction;
using procedure::StartQuestion;

struct StartValues {
  bool c_holds_spindle = false;
  int joints = 3;
  Eigen::Vector3d rough_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d rough_rad = Eigen::Vector3d::Zero();
  part_alignment::MachineBox travel;
  std::vector<part_alignment::MachineBox> obstacles;
  double safe_z_mm = 0;
  double distance_mm = 0;
  int bits = 14;
  std::string id_prefix;            ///< prefix of target ids
  procedure::StartAnswers answers;  ///< as given, for the commands
};

struct StartFiles {
  explicit StartFiles(const std::filesystem::path& in);

  std::filesystem::path folder;
  std::filesystem::path settings;  ///< observations without views, which align plan reads
  std::filesystem::path views;     ///< the same with views, for align measure
};

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

// Formats the travel that the controller reports.
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
                  ShellQuoted(values.answers.at("source")), ShellQuoted(names.folder));
  if (!values.id_prefix.empty()) command += " --id-prefix " + ShellQuoted(values.id_prefix);
  if (values.bits != 14) command += fmt::format(" --bits {}", values.bits);
  if (values.answers.at("machine") == "none") return command;
  return command + fmt::format(" --machine {} --joints {} {} --safe-z {} --travel {}{}",
                               ShellQuoted(values.answers.at("machine")), values.joints,
                               values.c_holds_spindle ? "--c-axis" : "--spindle-locked",
                               values.safe_z_mm, values.answers.at("travel"),
                               ObstacleOptions(values));
}

/// Returns the questions before the machine is queried.
std::vector<StartQuestion> MachineQuestions() {
  return {{"machine", "the machine: session, the LinuxCNC that runs on this computer, or none",
           "session", IsMachine}};
}

/// Returns the questions after it; values from the controller are their defaults.
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

/// REQUIRES answers to all questions.
StartValues ValuesOf(const StartAnswers& answers,
                     const std::optional<machine::LinuxCncFacts>& facts, int joints) {
  const auto numbers = [&](const std::string& name, std::size_t count) {
    auto parsed = ParseNumbers(answers.at(name), count);
    TRAMMEL_CHECK(parsed.has_value(), "{} was not checked", name);
    return *parsed;
  };
  StartValues values;
  values.answers = answers;
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
  return values;
}

StartFiles::StartFiles(const fs::path& in)
    : folder(in), settings(in / "setup.json"), views(in / "views.json") {}

/// Returns observations without views (docs/reference/formats.md), with the paths of camera and
/// targets relative to the folder.
std::string SettingsText(const StartFiles& names, const StartValues& values) {
  const auto from_folder = [&](const std::string& path) {
    std::error_code fault;
    const fs::path relative = fs::proximate(path, names.folder, fault);
    return fault || relative.empty() ? fs::absolute(path).string() : relative.string();
  };
  const nlohmann::ordered_json json = {{"format", 1},
                                       {"camera", from_folder(values.answers.at("camera"))},
                                       {"targets", from_folder(values.answers.at("targets"))},
                                       {"unknowns", {"pose", "clamp_angle"}},
                                       {"views", nlohmann::ordered_json::array()}};
  return JsonText(json);
}

/// Returns the five commands from the clamped camera to the work offset, each with a remark.
std::string CommandsText(const StartFiles& names, const StartValues& values) {
  const std::string folder = ShellQuoted(names.folder);
  const std::string result = ShellQuoted(names.folder / "result.json");
  const std::string write =
      values.answers.at("machine") == "none" ? "session" : values.answers.at("machine");
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
      values.answers.at("machine") == "none"
          ? "# 2. Read the pictures, one of each view. With a machine it drives, too: --machine.\n"
          : "# 2. Drive through the views, take and read the pictures. THE MACHINE MOVES.\n";
  text += MeasureCommand(names, values) + "\n";
  text += "# 3. Solve once more, with a simulation beside it. Of several measurements name one.\n";
  text += fmt::format(
      "trammel align solve {}/part_alignment-*Z/observations.json --trials 10000 --result {} "
      "--report {}\n",
      folder, result, ShellQuoted(names.folder / "report"));
  text += "# 4. Look at the work offset, and at what it leaves over. Shims: --supports FILE.\n";
  text += fmt::format("trammel align correct {} --work-offset {}\n", result,
                      values.answers.at("work-offset"));
  text += "# 5. Set it (G10 L2) and read it back.\n";
  text += fmt::format("trammel align correct {} --work-offset {} --write {} --joints {}\n", result,
                      values.answers.at("work-offset"), ShellQuoted(write), values.joints);
  return text;
}

constexpr const char* kNoMachine = "none";

struct InitArguments {
  std::string folder = "alignment";
  StartAnswers answers;  ///< from options, where given
  int bits = 14;
  int joints = 0;  ///< 0: as many as the controller has; where it does not tell, 3, 4 with C
};

void PrintText(const std::string& text) {
  fmt::print(stderr, "{}", text);
  std::fflush(stderr);
}

Result<std::optional<machine::LinuxCncFacts>> LookAtMachine(const std::string& address, int joints,
                                                            const std::stop_token& stop) {
  if (address == kNoMachine) return std::optional<machine::LinuxCncFacts>();
  LinuxCncArguments arguments;
  arguments.address = address;
  if (joints > 0) arguments.options.joints = joints;
  const auto options = TRY(ParseLinuxCnc(arguments));
  auto linuxcnc = TRY(machine::LinuxCnc::Connect(options, stop));
  auto facts = TRY(linuxcnc->Facts(stop));
  PrintText(fmt::format("LinuxCNC: {}\n", procedure::FactsText(facts)));
  return std::optional(std::move(facts));
}

/// Prints the contradictions. @returns true if one forbids to continue.
bool PrintContradictions(const std::vector<StartContradiction>& found) {
  bool forbids = false;
  for (const StartContradiction& contradiction : found) {
    PrintText(fmt::format("{}: {}: {}\n",
                          contradiction.forbids ? "contradiction" : "before measuring",
                          contradiction.what, contradiction.remedy));
    forbids = forbids || contradiction.forbids;
  }
  return forbids;
}

part_alignment::ViewPlanOptions PlanOptions(const StartValues& values,
                                            const part_alignment::Unknowns& unknowns) {
  part_alignment::ViewPlanOptions options;
  options.unknowns = unknowns;
  options.travel = values.travel;
  options.obstacles = values.obstacles;
  options.working_distance_mm = values.distance_mm;
  return options;
}

/// Settings, stored under a temporary name until all is well.
struct Begun {
  files::NewFile settings;
  files::AlignmentInput input;
};

Result<Begun> BeginSettings(const StartFiles& names, const StartValues& values) {
  auto settings = TRY(files::NewFile::Create(names.settings, files::IfThere::kRefuse));
  TRY(settings.Write(SettingsText(names, values)));
  auto input = TRY(files::ReadAlignmentFile(settings.temporary_path(), 0));
  if (input.measurement.targets.empty()) {
    return Fail(values.answers.at("targets") + ": no targets");
  }
  return Begun{std::move(settings), std::move(input)};
}

Result<std::string> ViewsText(const StartValues& values, files::AlignmentInput input) {
  const geometry::Pose rough{values.rough_mm, values.rough_rad};
  const SlowWork work("planning the views");
  const auto plan =
      TRY(part_alignment::PlanViews(input.measurement.camera, input.measurement.targets, rough,
                                    PlanOptions(values, input.unknowns)));
  if (plan.verdict != Verdict::kGood) {
    return Fail(fmt::format("no views were found that locate the part: {}; move the part, or "
                            "change --rough, --travel, --obstacle or --distance",
                            plan.reason),
                ErrorKind::kMeasurement);
  }
  for (const part_alignment::PlannedView& view : plan.views) {
    input.measurement.views.push_back({view.spindle_mm, view.spindle_rotation, {}});
  }
  PrintText(
      fmt::format("{} views of {} targets\n", plan.views.size(), input.measurement.targets.size()));
  return files::AlignmentFileText(input);
}

Result<void> MakeFolder(const fs::path& folder) {
  std::error_code fault;
  fs::create_directories(folder, fault);
  if (!fault) return {};
  return Fail(fmt::format("{}: {}; choose another folder", folder.string(), fault.message()));
}

// Checks the outputs before the first question.
Result<void> CheckFree(const StartFiles& names) {
  for (const fs::path& path : {names.settings, names.views}) {
    TRY(files::CheckTarget(path, files::IfThere::kRefuse, "choose another folder"));
  }
  return {};
}

// Reports checks that do not need the machine.
bool ReportInputFiles(const files::AlignmentInput& input, const procedure::TargetIds& ids) {
  if (input.calibration) {
    if (const auto notice = part_alignment::NoticeOfAge(input.calibration->date, Today())) {
      PrintText(*notice + "\n");
    }
  } else {
    PrintText(
        "the camera's file has no calibration record: its uncertainty counts with its usual "
        "size\n");
  }
  return PrintContradictions(ids.contradictions);
}

Result<int> RunInit(InitArguments arguments) {
  const Interrupt interrupt;
  const std::stop_token stop = interrupt.token();
  const StartFiles names(arguments.folder);
  TRY(CheckFree(names));
  TerminalOperator terminal(stop, {});
  procedure::Operator* person = terminal.present() ? &terminal : nullptr;
  StartAnswers& answers = arguments.answers;
  TRY(procedure::AnswerQuestions(MachineQuestions(), person, PrintText, answers));
  const auto facts = TRY(LookAtMachine(answers["machine"], arguments.joints, stop));
  TRY(procedure::AnswerQuestions(JobQuestions(facts, answers), person, PrintText, answers));
  StartValues values = ValuesOf(answers, facts, arguments.joints);
  values.bits = arguments.bits;
  const procedure::StartRequest request{values.c_holds_spindle, values.travel, values.safe_z_mm};
  bool forbidden = PrintContradictions(procedure::CheckRequest(request));
  if (facts) forbidden = PrintContradictions(procedure::CheckMachine(*facts, request)) || forbidden;
  TRY(MakeFolder(arguments.folder));
  auto begun = TRY(BeginSettings(names, values));
  const auto book = TRY(part_alignment::MakeCodeBook(values.bits));
  const auto ids = procedure::CheckIds(begun.input.measurement.targets, book);
  values.id_prefix = ids.prefix;
  forbidden = ReportInputFiles(begun.input, ids) || forbidden;
  if (forbidden) {
    return Fail(
        "nothing is written while the answers contradict the "
        "machine or the targets; mend it and run it again",
        ErrorKind::kSafety);
  }
  const auto views = TRY(ViewsText(values, begun.input));
  TRY(begun.settings.Commit());
  TRY(files::WriteWholeFile(names.views, views, files::IfThere::kRefuse));
  fmt::print("{}", CommandsText(names, values));
  return kExitGood;
}

}  // namespace

void AddAlignInitCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "init", "asks what a first measurement needs, looks at the machine, and writes its files");
  const auto arguments = std::make_shared<InitArguments>();
  command
      ->add_option("folder", arguments->folder,
                   "where setup.json and views.json are written; files that are there stay")
      ->capture_default_str();
  std::vector<procedure::StartQuestion> questions = MachineQuestions();
  for (procedure::StartQuestion& question : JobQuestions(std::nullopt, {})) {
    questions.push_back(std::move(question));
  }
  for (const procedure::StartQuestion& question : questions) {
    CLI::Option* option =
        command
            ->add_option_function<std::vector<std::string>>(
                "--" + question.name,
                [arguments, name = question.name](const std::vector<std::string>& given) {
                  arguments->answers[name] = fmt::format("{}", fmt::join(given, " "));
                },
                question.text)
            ->expected(1)
            ->group("Answers");
    if (question.name == "obstacle") option->take_all();  // several boxes
  }
  command->add_option("--bits", arguments->bits, "of the targets' rings")
      ->check(CLI::IsMember(std::vector<int>{12, 14, 20}))
      ->capture_default_str();
  command
      ->add_option("--joints", arguments->joints,
                   "joints that must be homed, where the controller does not tell how many it has")
      ->check(CLI::Range(1, 16));
  OnRun(*command, exit_code, [arguments] { return RunInit(*arguments); });
}

}  // namespace trammel::app
