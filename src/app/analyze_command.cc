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

#include "app/analysis_run.h"
#include "app/commands.h"
#include "app/option_values.h"
#include "app/photo_plan.h"
#include "pressure_advance/transitions.h"
#include "report/analysis_json.h"
#include "report/pressure_advance_report.h"
#include "store/whole_file.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::Analysis;
using pressure_advance::Method;
using pressure_advance::PhotoSide;

constexpr const char* kDefaultPhotoPa = "0:0.1:0.005";
constexpr const char* kDefaultFrom = "bottom";

struct AnalyzeArguments {
  std::string path;
  bool json = false;
  std::string method = "response";
  std::string report;
  std::string figures;
  std::string plan;
  std::string pa;
  std::string from;
  std::string start;
  std::string segments;
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
  const auto from = ParseSide("--from", arguments.from.empty() ? kDefaultFrom : arguments.from);
  if (!from) return tl::unexpected(from.error());
  plan->from = *from;
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

// Before the analysis rather than behind it: minutes of work need not go without their report.
Result<void> CheckOutputs(const AnalyzeArguments& arguments) {
  std::error_code ignored;
  const fs::path report = arguments.report;
  const fs::path folder = report.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored)) {
    return Fail(fmt::format("--report {}: there is no folder {}; make it first", report.string(),
                            folder.string()));
  }
  if (!report.empty() && fs::is_directory(report, ignored)) {
    return Fail(fmt::format("--report {}: is a folder; name a file", report.string()));
  }
  // The folder of the figures is made with all above it; none of them may be something else.
  for (fs::path part = arguments.figures; !part.empty(); part = part.parent_path()) {
    if (fs::is_directory(part, ignored)) break;
    if (fs::exists(part, ignored)) {
      return Fail(fmt::format("--figures {}: {} is a file, not a folder; choose another name",
                              arguments.figures, part.string()));
    }
  }
  return {};
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
    return AnalyseRecording(path, method);
  }
  const Result<PhotoPlan> plan = PlanOf(arguments);
  if (!plan) return tl::unexpected(plan.error());
  Result<AnalysisRun> run = AnalysePhoto(path, *plan, method);
  if (!run || !arguments.plan.empty()) return run;
  if (arguments.segments.empty()) {
    run->analysis.notices.push_back("no --segments were given: 0.1:10,0.6:100,0.3:10 was taken");
  }
  if (arguments.pa.empty()) {
    run->analysis.notices.push_back(fmt::format("no --pa was given: {} from the {} was taken",
                                                kDefaultPhotoPa, ToString(plan->from)));
  }
  return run;
}

Result<void> WriteReport(const AnalyzeArguments& arguments, const report::ReportInput& input,
                         const std::vector<report::Figure>& figures) {
  if (arguments.report.empty()) return {};
  report::ReportOptions options;
  options.source = arguments.path;
  return store::WriteWholeFile(arguments.report,
                               report::PressureAdvanceReport(input, figures, options));
}

Result<void> WriteFigures(const std::string& figures_folder,
                          const std::vector<report::Figure>& figures) {
  if (figures_folder.empty()) return {};
  const fs::path folder = figures_folder;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return Fail(
        fmt::format("--figures {}: cannot make the folder: {}", folder.string(), error.message()));
  }
  for (const report::Figure& figure : figures) {
    for (const auto& [ending, bytes] :
         {std::pair{".png", figure.canvas.ToPng()}, std::pair{".svg", figure.canvas.ToSvg()}}) {
      if (auto done = store::WriteWholeFile(folder / (figure.name + ending), bytes); !done) {
        return done;
      }
    }
  }
  return {};
}

/// What became of the files beside the answer.
struct Written {
  std::string report;           ///< its path; empty where there is none
  std::optional<Error> failed;  ///< the first file that could not be written
};

Written WriteFiles(const AnalyzeArguments& arguments, const AnalysisRun& run) {
  Written written;
  if (arguments.report.empty() && arguments.figures.empty()) return written;
  const report::ReportInput input = run.report_input();
  const std::vector<report::Figure> figures = report::PressureAdvanceFigures(input);
  if (auto done = WriteReport(arguments, input, figures); done) {
    written.report = arguments.report;
  } else {
    written.failed = done.error();
  }
  auto done = WriteFigures(arguments.figures, figures);
  if (!done && !written.failed) written.failed = done.error();
  return written;
}

std::string Words(const Measured& measured) {
  if (!measured.good()) return std::string(ToString(measured.verdict()));
  const Quantity& q = measured.quantity();
  return fmt::format("{} +- {:.4f} s", report::SecondsText(q.value, q.standard_uncertainty),
                     q.standard_uncertainty);
}

void PrintText(const Analysis& analysis, const std::string& report_path) {
  const Measured& answer = analysis.pressure_advance;
  if (answer.good()) {
    const Quantity& q = answer.quantity();
    fmt::print("pressure advance  {}   (95 %: {:.4f} to {:.4f})\n", Words(answer), q.interval95.lo,
               q.interval95.hi);
    fmt::print("  acceleration    {}\n  deceleration    {}\n",
               Words(analysis.response.acceleration.pressure_advance),
               Words(analysis.response.deceleration.pressure_advance));
    if (analysis.deviation.best_s) {
      fmt::print("  deviation       best line {:.4f} s", *analysis.deviation.best_s);
      if (analysis.deviation.cubic_minimum_s) {
        fmt::print(", cubic minimum {:.4f} s", *analysis.deviation.cubic_minimum_s);
      }
      if (analysis.deviation.r_squared) {
        fmt::print(", R^2 {:.2f}", *analysis.deviation.r_squared);
      }
      fmt::print("\n");
    }
  }
  int used = 0;
  for (const auto& line : analysis.lines) used += line.used;
  fmt::print("lines             {} of {} used\n", used, analysis.lines.size());
  for (const auto& line : analysis.lines) {
    if (!line.used) fmt::print("  at {:.4f} s: {}\n", line.pressure_advance_s, line.reason);
  }
  for (const std::string& notice : analysis.notices) fmt::print("notice            {}\n", notice);
  fmt::print("verdict           {}\n", ToString(answer.verdict()));
  if (!answer.good()) fmt::print("because           {}\n", answer.reason());
  if (answer.good()) {
    const Quantity& q = answer.quantity();
    fmt::print("to use it         SET_PRESSURE_ADVANCE ADVANCE={}\n",
               report::SecondsText(q.value, q.standard_uncertainty));
  }
  if (!report_path.empty()) fmt::print("report            {}\n", report_path);
}

int RunAnalyze(const AnalyzeArguments& arguments) {
  if (auto possible = CheckOutputs(arguments); !possible) return Report(possible.error());
  const Result<AnalysisRun> run = RunEye(arguments);
  if (!run) return Report(run.error());
  // The answer is printed whatever became of the files: it must not get lost for a full disk.
  const Written written = WriteFiles(arguments, *run);
  if (arguments.json) {
    std::optional<std::string> report_path;
    if (!written.report.empty()) report_path = written.report;
    std::fputs(report::ToJson(run->analysis, report_path).c_str(), stdout);
  } else {
    PrintText(run->analysis, written.report);
  }
  if (written.failed) return Report(*written.failed);
  return run->analysis.pressure_advance.good() ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddAnalyzeCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "analyze", "pressure advance from a recorded laser scan or a photo of the pattern");
  const auto arguments = std::make_shared<AnalyzeArguments>();
  command->add_option("path", arguments->path, "folder with scan.json, or a photo")->required();
  command->add_flag("--json", arguments->json, "print everything as one JSON object");
  command->add_option("--method", arguments->method, "response or deviation (the paper's)")
      ->capture_default_str();
  command->add_option("--report", arguments->report, "write a one-page report (HTML)");
  command->add_option("--figures", arguments->figures, "write each figure as PNG and SVG here");
  CLI::Option* plan = command->add_option(
      "--plan", arguments->plan,
      "photo: the *.plan.json that pa pattern wrote; says the lines' PA and segments");
  command
      ->add_option("--pa", arguments->pa,
                   fmt::format("photo: PA of the lines in s, START:END:STEP or a,b,c (default {})",
                               kDefaultPhotoPa))
      ->excludes(plan);
  command->add_option(
      "--from", arguments->from,
      fmt::format("photo: side at which the first line lies (default {})", kDefaultFrom));
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
