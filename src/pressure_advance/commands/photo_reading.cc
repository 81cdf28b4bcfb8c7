#include "pressure_advance/commands/photo_reading.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/commands/photo_analysis.h"
#include "pressure_advance/commands/photo_batch.h"
#include "pressure_advance/files/slicer_gcode.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::app {
namespace {

using pressure_advance::PhotoSide;

// Patterns of other programs, as OrcaSlicer, Ellis and Marlin print them.
struct KnownPattern {
  const char* name;
  PatternForm form;
};

constexpr std::array<KnownPattern, 5> kPatterns{{
    {"trammel", PatternForm::kLines},
    {"orca-line", PatternForm::kLines},
    {"marlin-lines", PatternForm::kLines},
    {"orca-pattern", PatternForm::kCorners},
    {"ellis", PatternForm::kCorners},
}};

// Lines of other programs, where nothing says their speeds.
const std::vector<pressure_advance::Segment> kSlicerSegments = {{0.25, 20}, {0.5, 100}, {0.25, 20}};

std::string PatternNames() {
  std::string names;
  for (const KnownPattern& pattern : kPatterns) {
    names += (names.empty() ? "" : ", ") + std::string(pattern.name);
  }
  return names;
}

Result<std::optional<PatternForm>> FormOf(const std::string& name) {
  if (name.empty()) return std::optional<PatternForm>();
  for (const KnownPattern& pattern : kPatterns) {
    if (name == pattern.name) return std::optional(pattern.form);
  }
  return Fail(fmt::format("--pattern {}: must be one of {}", name, PatternNames()));
}

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

// Returns values and motion from one of the options, else from the plan found; nothing if the photo
// itself has to name the values.
Result<std::optional<FoundPlan>> LinesOf(const std::string& path, const PhotoReading& reading,
                                         const files::SlicerPrint* print) {
  if (!reading.plan.empty()) return FoundPlan{TRY(ReadPhotoPlan(reading.plan)), ""};
  if (print != nullptr) {
    return FoundPlan{PhotoPlanOf(print->patterns.front(), print->printed_by), ""};
  }
  const auto form = TRY(FormOf(reading.pattern));
  if (reading.pa.empty()) {
    if (!form || reading.pattern == kPatterns.front().name) return FindPlanOf(path);
    return std::optional<FoundPlan>();
  }
  FoundPlan found;
  found.plan.form = form;
  found.plan.printed_by = std::nullopt;
  found.plan.corner_mark = reading.photo;
  found.plan.pressure_advance_s = TRY(ParsePressureAdvances(reading.pa));
  if (!reading.segments.empty()) {
    found.plan.segments = TRY(ParseSegments(reading.segments));
    found.plan.form = PatternForm::kLines;
  } else if (form && reading.pattern != "trammel") {
    found.plan.segments = kSlicerSegments;
    found.plan.framed = false;
  } else {
    found.notice = "no --segments were given: 0.1:10,0.6:100,0.3:10 was taken";
  }
  return found;
}

// Sets the sides that are given.
Result<void> TakeSides(const PhotoReading& reading, PhotoPlan& plan) {
  plan.from = plan.start = std::nullopt;
  if (!reading.from.empty()) plan.from = TRY(ParseSide("--from", reading.from));
  if (!reading.start.empty()) plan.start = TRY(ParseSide("--start", reading.start));
  return {};
}

// Checks a plan of the options, or one found, and adds the sides.
Result<FoundPlan> Checked(FoundPlan found, const PhotoReading& reading) {
  PhotoPlan& plan = found.plan;
  TRY(TakeSides(reading, plan));
  const std::string source = !reading.plan.empty()    ? reading.plan
                             : !reading.gcode.empty() ? reading.gcode
                             : reading.pa.empty()     ? std::string("the plan")
                                                      : std::string();
  TRY(CheckDuplicates(source.empty() ? "--pa" : source, plan.pressure_advance_s));
  if (plan.form == PatternForm::kCorners) return found;
  pressure_advance::LineMotion motion;
  motion.segments = plan.segments;
  const auto windows =
      pressure_advance::PlanTransitions(motion, pressure_advance::PositionUnit::kLineLength, 0);
  if (!windows) {
    return Fail(
        fmt::format("{}: {}", source.empty() ? "--segments" : source, windows.error().message));
  }
  return found;
}

// Measures a photo that names its values itself.
Result<AnalysisRun> ReadNumbered(OpenPhoto& photo, const PhotoReading& reading) {
  PhotoPlan plan;
  plan.form = TRY(FormOf(reading.pattern));
  plan.segments = kSlicerSegments;
  TRY(TakeSides(reading, plan));
  return AnalysePhoto(photo, plan);
}

}  // namespace

void AddPhotoReadingOptions(CLI::App& command, PhotoReading& reading) {
  CLI::Option* plan = command.add_option(
      "--plan", reading.plan,
      "photo: the *.plan.json that pa pattern wrote; says the lines' PA and segments. Without it, "
      "--gcode and --pa, the one beside the photo, else that of the last pa print --photo, else "
      "the "
      "numbers printed beside another tool's pattern");
  CLI::Option* gcode =
      command
          .add_option("--gcode", reading.gcode,
                      "photo: the G-code that printed the pattern, of a slicer or a generator")
          ->excludes(plan);
  command
      .add_option("--plate", reading.plate,
                  "photo: with --gcode, which plate of a .gcode.3mf is in it: 2 or plate_2")
      ->needs(gcode);
  command
      .add_option("--pattern", reading.pattern,
                  "photo: whose pattern it is: " + PatternNames() +
                      "; without --pa, its printed numbers are read")
      ->excludes(plan)
      ->excludes(gcode);
  CLI::Option* pa =
      command
          .add_option("--pa", reading.pa, "photo: PA of the lines in s, START:END:STEP or a,b,c")
          ->excludes(plan)
          ->excludes(gcode);
  command
      .add_flag("--photo", reading.photo,
                "photo: with --pa, of a pattern that was printed with --photo: its filled corner "
                "shows which way it lies")
      ->excludes(plan)
      ->excludes(gcode);
  command.add_option("--from", reading.from,
                     "photo: side at which the first line lies; found where the slow ends differ");
  command.add_option("--start", reading.start,
                     "photo: side at which the lines were begun; found where the slow ends differ");
  command
      .add_option("--segments", reading.segments,
                  "photo: FRACTION:SPEED,... (with --pa; default 0.1:10,0.6:100,0.3:10)")
      ->excludes(plan)
      ->excludes(gcode)
      ->needs(pa);
}

std::string FirstGiven(const PhotoReading& reading) {
  for (const auto& [option, value] :
       {std::pair{"--pa", &reading.pa}, std::pair{"--segments", &reading.segments},
        std::pair{"--plan", &reading.plan}, std::pair{"--gcode", &reading.gcode},
        std::pair{"--plate", &reading.plate}, std::pair{"--pattern", &reading.pattern},
        std::pair{"--from", &reading.from}, std::pair{"--start", &reading.start}}) {
    if (!value->empty()) return option;
  }
  return reading.photo ? "--photo" : "";
}

std::string FirstOutput(const ReportFiles& files) {
  for (const auto& [option, value] :
       {std::pair{"--report", &files.report}, std::pair{"--figures", &files.figures},
        std::pair{"--result", &files.result}}) {
    if (!value->empty()) return option;
  }
  return "";
}

Result<AnalysisRun> ReadPhoto(const std::string& path, const PhotoReading& reading,
                              const files::SlicerPrint* print) {
  auto named = TRY(LinesOf(path, reading, print));
  std::optional<FoundPlan> found;
  if (named) found = TRY(Checked(std::move(*named), reading));
  OpenPhoto photo = TRY(ReadPhotoForSearch(path));
  if (!found) return ReadNumbered(photo, reading);
  AnalysisRun run = AnalysePhoto(photo, found->plan);
  const bool refused = run.analysis.pressure_advance.verdict() == Verdict::kRefused;
  const bool named_by_hand = !FirstGiven(reading).empty();
  if (refused && !named_by_hand) {
    // The photo may be of another tool's pattern than the print that is noted.
    Result<AnalysisRun> other = ReadNumbered(photo, reading);
    if (other && other->analysis.pressure_advance.verdict() != Verdict::kRefused) return other;
  }
  if (!run.analysis.corners && !found->notice.empty()) {
    run.analysis.notices.push_back(found->notice);
  }
  return run;
}

}  // namespace trammel::app
