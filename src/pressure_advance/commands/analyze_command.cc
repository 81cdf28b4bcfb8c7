// trammel pa analyze: a recorded laser scan or a photo in, pressure advance with its uncertainty
// out.
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
#include "app/slow_work.h"
#include "pressure_advance/commands/analysis_output.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/commands/photo_plan.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::Method;
using pressure_advance::PhotoSide;

constexpr const char* kDefaultPhotoPa = "0:0.1:0.005";

struct AnalyzeArguments {
  std::string path;
  AnalysisOutput output;
  std::string method = "response";
  std::string plan;
  std::string pa;
  std::string from;
  std::string start;
  std::string segments;
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

// Values and segments from --plan, or from --pa and --segments.
Result<PhotoPlan> LinesOf(const AnalyzeArguments& arguments) {
  if (!arguments.plan.empty()) return ReadPhotoPlan(arguments.plan);
  PhotoPlan plan;
  plan.corner_mark = arguments.photo;
  auto values = ParsePressureAdvances(arguments.pa.empty() ? kDefaultPhotoPa : arguments.pa);
  if (!values) return tl::unexpected(values.error());
  plan.pressure_advance_s = std::move(*values);
  if (!arguments.segments.empty()) {
    auto segments = ParseSegments(arguments.segments);
    if (!segments) return tl::unexpected(segments.error());
    plan.segments = std::move(*segments);
  }
  return plan;
}

Result<PhotoPlan> PlanOf(const AnalyzeArguments& arguments) {
  Result<PhotoPlan> plan = LinesOf(arguments);
  if (!plan) return plan;
  const bool from_file = !arguments.plan.empty();
  if (auto distinct =
          CheckDuplicates(from_file ? arguments.plan : "--pa", plan->pressure_advance_s);
      !distinct) {
    return tl::unexpected(distinct.error());
  }
  if (!arguments.from.empty()) {
    const auto from = ParseSide("--from", arguments.from);
    if (!from) return tl::unexpected(from.error());
    plan->from = *from;
  }
  if (!arguments.start.empty()) {
    const auto start = ParseSide("--start", arguments.start);
    if (!start) return tl::unexpected(start.error());
    plan->start = *start;
  }
  pressure_advance::LineMotion motion;
  motion.segments = plan->segments;
  const auto windows =
      pressure_advance::PlanTransitions(motion, pressure_advance::PositionUnit::kLineLength, 0);
  if (!windows) {
    return Fail(
        fmt::format("{}: {}", from_file ? arguments.plan : "--segments", windows.error().message));
  }
  return plan;
}

Result<AnalysisRun> RunEye(const AnalyzeArguments& arguments) {
  Method method = Method::kResponse;
  if (arguments.method == "deviation") {
    method = Method::kDeviation;
  } else if (arguments.method != "response") {
    return Fail(fmt::format("--method {}: must be response or deviation", arguments.method));
  }
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
    return AnalyseRecording(path, method);
  }
  const Result<PhotoPlan> plan = PlanOf(arguments);
  if (!plan) return tl::unexpected(plan.error());
  Result<AnalysisRun> run = AnalysePhoto(path, *plan, method);
  if (!run || !arguments.plan.empty() || arguments.photo) return run;
  if (arguments.segments.empty()) {
    run->analysis.notices.push_back("no --segments were given: 0.1:10,0.6:100,0.3:10 was taken");
  }
  if (arguments.pa.empty()) {
    run->analysis.notices.push_back(
        fmt::format("no --pa was given: {} was taken", kDefaultPhotoPa));
  }
  return run;
}

int RunAnalyze(const AnalyzeArguments& arguments) {
  if (auto possible = CheckOutputs(arguments.output.files); !possible)
    return PrintError(possible.error());
  const SlowWork work("analysing " + arguments.path);
  const Result<AnalysisRun> run = RunEye(arguments);
  if (!run) return PrintError(run.error());
  ResultFile result = ResultOf(run->analysis, arguments.path);
  result.outcome.subject = SubjectIn(arguments.path);
  return PrintAnalysis(*run, result, arguments.output);
}

}  // namespace

void AddAnalyzeCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "analyze", "pressure advance from a recorded laser scan or a photo of the pattern");
  const auto arguments = std::make_shared<AnalyzeArguments>();
  command->add_option("path", arguments->path, "folder with scan.json, or a photo")->required();
  command->add_flag("--json", arguments->output.json, "print everything as one JSON object");
  command->add_option("--method", arguments->method, "response or deviation (the paper's)")
      ->capture_default_str();
  command->add_option("--report", arguments->output.files.report, "write a one-page report (HTML)");
  command->add_option("--figures", arguments->output.files.figures,
                      "write each figure as PNG and SVG here");
  command->add_option("--result", arguments->output.files.result,
                      "keep the answer as JSON here, for pa apply");
  command->add_flag("--force", arguments->output.files.force, "overwrite files");
  CLI::Option* plan = command->add_option(
      "--plan", arguments->plan,
      "photo: the *.plan.json that pa pattern wrote; says the lines' PA and segments");
  command
      ->add_option("--pa", arguments->pa,
                   fmt::format("photo: PA of the lines in s, START:END:STEP or a,b,c (default {})",
                               kDefaultPhotoPa))
      ->excludes(plan);
  command
      ->add_flag(
          "--photo", arguments->photo,
          "photo: of the pattern that pa pattern --photo wrote; its values, segments and mark")
      ->excludes(plan);
  command->add_option("--from", arguments->from,
                      "photo: side at which the first line lies; found where the slow ends differ");
  command->add_option(
      "--start", arguments->start,
      "photo: side at which the lines were begun; found where the slow ends differ");
  command
      ->add_option("--segments", arguments->segments,
                   "photo: FRACTION:SPEED,... (default 0.1:10,0.6:100,0.3:10)")
      ->excludes(plan);
  command->callback([arguments, &exit_code] { exit_code = RunAnalyze(*arguments); });
}

}  // namespace trammel::app
