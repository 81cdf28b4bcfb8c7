// trammel pa analyze: computes pressure advance with its uncertainty from a recorded laser scan or
// a photo.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/provenance.h"
#include "app/slow_work.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::PhotoSide;

struct AnalyzeArguments {
  std::string path;
  AnalysisOutput output;
  std::string plan;
  std::string pa;
  std::string from;
  std::string start;
  std::string segments;
  std::string flow_reference;
  double reference_flow_ratio = 1;
  bool photo = false;
};

Result<PhotoSide> ParseSide(const std::string& option, const std::string& text) {
  for (const PhotoSide side :
       {PhotoSide::kBottom, PhotoSide::kTop, PhotoSide::kLeft, PhotoSide::kRight}) {
    if (text == ToString(side)) return side;
  }
  return Fail(fmt::format("{} {}: must be bottom, top, left or right", option, text));
}

Result<void> CheckDuplicates(const std::string& source, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto twice = std::adjacent_find(values.begin(), values.end());
  if (twice == values.end()) return {};
  return Fail(fmt::format("{}: {} s is there twice; every line must have a value of its own",
                          source, *twice));
}

// Sides of the photo at the first line, and at the lines' starts.
struct Sides {
  std::optional<PhotoSide> from;
  std::optional<PhotoSide> start;
};

Result<Sides> SidesOf(const AnalyzeArguments& arguments) {
  Sides sides;
  if (!arguments.from.empty()) {
    sides.from = TRY(ParseSide("--from", arguments.from));
  }
  if (!arguments.start.empty()) {
    sides.start = TRY(ParseSide("--start", arguments.start));
  }
  return sides;
}

// Returns values and segments from --plan, or from --pa and --segments, else from the plan found.
Result<FoundPlan> LinesOf(const AnalyzeArguments& arguments) {
  if (arguments.plan.empty() && arguments.pa.empty()) return FindPlanOf(arguments.path);
  if (!arguments.plan.empty()) {
    auto plan = TRY(ReadPhotoPlan(arguments.plan));
    return FoundPlan{std::move(plan), ""};
  }
  FoundPlan found;
  found.plan.corner_mark = arguments.photo;
  found.plan.pressure_advance_s = TRY(ParsePressureAdvances(arguments.pa));
  if (arguments.segments.empty()) {
    found.notice = "no --segments were given: 0.1:10,0.6:100,0.3:10 was taken";
    return found;
  }
  found.plan.segments = TRY(ParseSegments(arguments.segments));
  return found;
}

Result<FoundPlan> PlanOf(const AnalyzeArguments& arguments) {
  const auto sides = TRY(SidesOf(arguments));
  Result<FoundPlan> found = LinesOf(arguments);
  if (!found) return found;
  PhotoPlan* const plan = &found->plan;
  plan->from = sides.from;
  plan->start = sides.start;
  const std::string source = !arguments.plan.empty() ? arguments.plan
                             : arguments.pa.empty()  ? std::string("the plan")
                                                     : std::string();
  TRY(CheckDuplicates(source.empty() ? "--pa" : source, plan->pressure_advance_s));
  pressure_advance::LineMotion motion;
  motion.segments = plan->segments;
  const auto windows =
      pressure_advance::PlanTransitions(motion, pressure_advance::PositionUnit::kLineLength, 0);
  if (!windows) {
    return Fail(
        fmt::format("{}: {}", source.empty() ? "--segments" : source, windows.error().message));
  }
  return found;
}

Result<AnalysisRun> RunReader(const AnalyzeArguments& arguments) {
  const fs::path path = arguments.path;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    return Fail(
        fmt::format("{}: there is no such file or folder; give a recording's folder or a "
                    "photo",
                    path.string()));
  }
  if (fs::is_directory(path, ignored)) {
    for (const auto& [option, value] :
         {std::pair{"--pa", &arguments.pa}, std::pair{"--segments", &arguments.segments},
          std::pair{"--plan", &arguments.plan}, std::pair{"--from", &arguments.from},
          std::pair{"--start", &arguments.start}}) {
      if (!value->empty()) {
        return Fail(fmt::format("{} is for photos; {} is a recording, whose scan.json says it",
                                option, path.string()));
      }
    }
    if (arguments.photo) return Fail(fmt::format("--photo: {} is a recording", path.string()));
    std::optional<FlowReference> reference;
    if (!arguments.flow_reference.empty()) {
      reference = FlowReference{arguments.flow_reference, arguments.reference_flow_ratio};
    }
    return AnalyseRecording(path, reference);
  }
  if (!arguments.flow_reference.empty()) {
    return Fail(
        fmt::format("--flow-reference: {} is a photo, which shows no flow ratio: its beads' "
                    "height is not seen",
                    path.string()));
  }
  const FoundPlan found = TRY(PlanOf(arguments));
  Result<AnalysisRun> run = AnalysePhoto(path, found.plan);
  if (run && !found.notice.empty()) run->analysis.notices.push_back(found.notice);
  return run;
}

bool IsOfKlipper(const pressure_advance::Analysis& analysis) {
  return analysis.printed_by && analysis.printed_by->dialect == gcode::Dialect::kKlipper;
}

// Returns pa apply's argument: a file with the answer, or the value.
std::string ToApply(const AnalyzeArguments& arguments, double value_s) {
  std::error_code ignored;
  if (!arguments.output.files.result.empty()) return ShellQuoted(arguments.output.files.result);
  return fs::is_directory(arguments.path, ignored) ? ShellQuoted(arguments.path)
                                                   : fmt::format("{:.4f}", value_s);
}

Result<int> RunAnalyze(const AnalyzeArguments& arguments) {
  TRY(CheckOutputs(arguments.output.files));
  const SlowWork work("analysing " + arguments.path);
  const auto run = TRY(RunReader(arguments));
  ResultFile result = ResultOf(run.analysis, arguments.path);
  result.outcome.subject = SubjectIn(arguments.path);
  const int code = PrintAnalysis(run, result, arguments.output);
  const Measured& measured = run.analysis.pressure_advance;
  if (!arguments.output.json && measured.good() && IsOfKlipper(run.analysis)) {
    PrintWrapped("nothing applied",
                 "trammel pa apply " + ToApply(arguments, measured.quantity().value));
  }
  return code;
}

}  // namespace

void AddAnalyzeCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "analyze", "pressure advance from a recorded laser scan or a photo of the pattern");
  const auto arguments = std::make_shared<AnalyzeArguments>();
  command->add_option("path", arguments->path, "folder with scan.json, or a photo")->required();
  command->add_flag("--json", arguments->output.json, "print everything as one JSON object");
  command->add_option("--report", arguments->output.files.report, "write a one-page report (HTML)");
  command->add_option("--figures", arguments->output.files.figures,
                      "write each figure as PNG and SVG here");
  command->add_option("--result", arguments->output.files.result,
                      "keep the answer as JSON here, for pa apply");
  command->add_flag("--force", arguments->output.files.force, "overwrite files");
  CLI::Option* plan = command->add_option(
      "--plan", arguments->plan,
      "photo: the *.plan.json that pa pattern wrote; says the lines' PA and segments. Without it "
      "and --pa, the one beside the photo, else that of the last pa print --photo");
  CLI::Option* pa = command
                        ->add_option("--pa", arguments->pa,
                                     "photo: PA of the lines in s, START:END:STEP or a,b,c")
                        ->excludes(plan);
  command
      ->add_flag("--photo", arguments->photo,
                 "photo: with --pa, of a pattern that was printed with --photo: its filled corner "
                 "shows which way it lies")
      ->excludes(plan);
  command->add_option("--from", arguments->from,
                      "photo: side at which the first line lies; found where the slow ends differ");
  command->add_option(
      "--start", arguments->start,
      "photo: side at which the lines were begun; found where the slow ends differ");
  command
      ->add_option("--segments", arguments->segments,
                   "photo: FRACTION:SPEED,... (with --pa; default 0.1:10,0.6:100,0.3:10)")
      ->excludes(plan)
      ->needs(pa);
  CLI::Option* reference = command->add_option(
      "--flow-reference", arguments->flow_reference,
      "recording: that of a print whose flow ratio is known, on this plate with this filament's "
      "colour and this camera; makes the flow ratio sharper, and possible on any plate");
  command
      ->add_option("--reference-flow-ratio", arguments->reference_flow_ratio,
                   "the ratio that is right for the reference's filament")
      ->check(CLI::Range(0.2, 5.0))
      ->capture_default_str()
      ->needs(reference);
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunAnalyze(*arguments)); });
}

}  // namespace trammel::app
