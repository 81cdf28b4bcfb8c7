// trammel align init: from nothing to the files that plan and measure read, and the commands that
// follow.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/provenance.h"
#include "app/slow_work.h"
#include "app/terminal_person.h"
#include "files/new_file.h"
#include "part_alignment/camera/calibration_age.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_start.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/procedure/start_checks.h"
#include "part_alignment/views/view_plan.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using procedure::StartAnswers;
using procedure::StartContradiction;

constexpr const char* kNoMachine = "none";

struct InitArguments {
  std::string folder = "alignment";
  StartAnswers answers;  ///< as far as options gave them
  int bits = 14;
  int joints = 0;  ///< 0: as many as the controller has; where it does not tell, 3, 4 with C
};

void Say(const std::string& text) {
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
  Say(fmt::format("LinuxCNC: {}\n", procedure::FactsText(facts)));
  return std::optional(std::move(facts));
}

/// Tells them. @returns whether one forbids to go on.
bool Tell(const std::vector<StartContradiction>& found) {
  bool forbids = false;
  for (const StartContradiction& contradiction : found) {
    Say(fmt::format("{}: {}: {}\n", contradiction.forbids ? "contradiction" : "before measuring",
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

/// The settings, which stand under a name of their own until all is well.
struct Begun {
  files::NewFile settings;
  files::AlignmentInput input;
};

Result<Begun> BeginSettings(const StartFiles& names, const StartValues& values) {
  auto settings = TRY(files::NewFile::Create(names.settings, files::IfThere::kRefuse));
  TRY(settings.Write(SettingsText(names, values)));
  auto input = TRY(files::ReadAlignmentFile(settings.temporary_path(), 0));
  if (input.measurement.targets.empty()) {
    return Fail(values.targets + ": no targets");
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
  Say(fmt::format("{} views of {} targets\n", plan.views.size(), input.measurement.targets.size()));
  return files::AlignmentFileText(input);
}

Result<void> MakeFolder(const fs::path& folder) {
  std::error_code fault;
  fs::create_directories(folder, fault);
  if (!fault) return {};
  return Fail(fmt::format("{}: {}; choose another folder", folder.string(), fault.message()));
}

// Before anything is asked.
Result<void> CheckFree(const StartFiles& names) {
  for (const fs::path& path : {names.settings, names.views}) {
    TRY(files::CheckTarget(path, files::IfThere::kRefuse, "choose another folder"));
  }
  return {};
}

// What does not need the machine.
bool TellOfFiles(const files::AlignmentInput& input, const procedure::TargetIds& ids) {
  if (input.calibration) {
    if (const auto notice = part_alignment::NoticeOfAge(input.calibration->date, Today())) {
      Say(*notice + "\n");
    }
  } else {
    Say("the camera's file has no calibration record: its uncertainty counts with its usual "
        "size\n");
  }
  return Tell(ids.contradictions);
}

int RunInit(InitArguments arguments) {
  const Interrupt interrupt;
  const std::stop_token stop = interrupt.token();
  const StartFiles names(arguments.folder);
  if (auto free = CheckFree(names); !free) return PrintError(free.error());
  TerminalPerson terminal(stop, {});
  procedure::Person* person = terminal.present() ? &terminal : nullptr;
  StartAnswers& answers = arguments.answers;
  if (auto asked = procedure::AnswerQuestions(MachineQuestions(), person, Say, answers); !asked) {
    return PrintError(asked.error());
  }
  const auto facts = LookAtMachine(answers["machine"], arguments.joints, stop);
  if (!facts) return PrintError(facts.error());
  if (auto asked = procedure::AnswerQuestions(JobQuestions(*facts, answers), person, Say, answers);
      !asked) {
    return PrintError(asked.error());
  }
  StartValues values = ValuesOf(answers, *facts, arguments.joints);
  values.bits = arguments.bits;
  const procedure::StartRequest request{values.c_holds_spindle, values.travel, values.safe_z_mm};
  bool forbidden = Tell(procedure::CheckRequest(request));
  if (*facts) forbidden = Tell(procedure::CheckMachine(**facts, request)) || forbidden;
  if (auto made = MakeFolder(arguments.folder); !made) return PrintError(made.error());
  auto begun = BeginSettings(names, values);
  if (!begun) return PrintError(begun.error());
  const auto book = part_alignment::MakeCodeBook(values.bits);
  if (!book) return PrintError(book.error());
  const auto ids = procedure::CheckIds(begun->input.measurement.targets, *book);
  values.id_prefix = ids.prefix;
  forbidden = TellOfFiles(begun->input, ids) || forbidden;
  if (forbidden) {
    return PrintError({ErrorKind::kSafety,
                       "nothing is written while the answers contradict the "
                       "machine or the targets; mend it and run it again"});
  }
  const auto views = ViewsText(values, begun->input);
  if (!views) return PrintError(views.error());
  if (auto kept = begun->settings.Commit(); !kept) return PrintError(kept.error());
  if (auto kept = files::WriteWholeFile(names.views, *views, files::IfThere::kRefuse); !kept) {
    return PrintError(kept.error());
  }
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
  command->callback([arguments, &exit_code] { exit_code = RunInit(*arguments); });
}

}  // namespace trammel::app
