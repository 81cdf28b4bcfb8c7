#include "pressure_advance/commands/pattern_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "app/option_values.h"
#include "files/whole_file.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/plate_layout.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "session/checks.h"

namespace trammel::app {

using pressure_advance::Segment;

namespace {

constexpr double kMaxAdvance_s = 10;
constexpr std::size_t kMaxValues = 1000;   // limit of lines in scan.json
constexpr std::size_t kMaxSegments = 100;  // limit in scan.json

Result<std::vector<double>> ParseNumbers(std::string_view text, char separator) {
  std::vector<double> numbers;
  for (const std::string_view part : Split(text, separator, kMaxValues)) {
    const auto number = ParseNumber<double>(WithoutSpaces(part));
    if (!number) return Fail(fmt::format("--pa {}: \"{}\" is not a number", text, part));
    numbers.push_back(*number);
  }
  if (numbers.size() > kMaxValues)
    return Fail(fmt::format("--pa: more than {} values", kMaxValues));
  return numbers;
}

Result<std::vector<double>> Expand(std::string_view text, double start, double end, double third) {
  if (end <= start) {
    return Fail(fmt::format("--pa {}: the end {} is not above the start {}", text, end, start));
  }
  if (!(third > 0)) {
    return Fail(fmt::format("--pa {}: the third part {} must be above 0", text, third));
  }
  const bool is_step = third <= end - start;
  const double intervals = is_step ? (end - start) / third : third - 1;
  constexpr double kWhole = 1e-6;  // decimal steps are not exact in binary
  if (std::abs(intervals - std::round(intervals)) > kWhole || std::round(intervals) < 1) {
    return Fail(fmt::format("--pa {}: {} neither divides the range {} nor is a count of at least 2",
                            text, third, end - start));
  }
  if (intervals + 1 > static_cast<double>(kMaxValues)) {
    return Fail(
        fmt::format("--pa {}: {:.0f} values are more than {}", text, intervals + 1, kMaxValues));
  }
  std::vector<double> values;
  const auto last = static_cast<int>(std::lround(intervals));
  for (int i = 0; i <= last; ++i) {
    values.push_back(std::round(std::lerp(start, end, double(i) / last) * 1e9) / 1e9);
  }
  return values;
}

}  // namespace

Result<std::vector<double>> ParsePressureAdvances(std::string_view text) {
  const bool range = text.find(':') != std::string_view::npos;
  Result<std::vector<double>> parts = ParseNumbers(text, range ? ':' : ',');
  if (!parts) return parts;
  if (range) {
    if (parts->size() != 3) {
      return Fail(fmt::format("--pa {}: a range is START:END:STEP or START:END:COUNT", text));
    }
    parts = Expand(text, (*parts)[0], (*parts)[1], (*parts)[2]);
    if (!parts) return parts;
  }
  for (double value : *parts) {
    if (value < 0 || value > kMaxAdvance_s) {
      return Fail(fmt::format("--pa {}: {} s is outside 0 ... {} s{}", text, value, kMaxAdvance_s,
                              value < 0 ? ""
                                        : "; a K of some 30 to 130 is of Marlin's LIN_ADVANCE "
                                          "1.0, and no time"));
    }
  }
  return parts;
}

Result<std::vector<Segment>> ParseSegments(std::string_view text) {
  std::vector<Segment> segments;
  double sum = 0;
  for (const std::string_view part : Split(text, ',', kMaxSegments)) {
    const auto sides = Split(part, ':', 2);
    const auto fraction = ParseNumber<double>(sides.front());
    const auto speed = sides.size() == 2 ? ParseNumber<double>(sides.back()) : std::nullopt;
    if (!fraction || !speed || !(*fraction > 0 && *fraction < 1) ||
        !(*speed >= 0.1 && *speed <= 2000)) {
      return Fail(fmt::format(
          "--segments: '{}' is not FRACTION:SPEED with a fraction between 0 and 1 and a speed of "
          "0.1 to 2000 mm/s, as in 0.1:10,0.6:100,0.3:10",
          part));
    }
    segments.push_back({*fraction, *speed});
    sum += *fraction;
  }
  if (segments.size() > kMaxSegments) {
    return Fail(fmt::format("--segments: more than {} segments", kMaxSegments));
  }
  if (std::abs(sum - 1) > 1e-3) {
    return Fail(fmt::format("--segments: the fractions of {} sum to {:.4g}; they must sum to 1",
                            text, sum));
  }
  return segments;
}

void AddPlateOptions(CLI::App& command, AskedPlate& asked,
                     const std::vector<CLI::Option*>& of_one_answer) {
  CLI::Option* repeat = command.add_option(
      "--repeat", asked.repeat,
      "print so many patterns beside one another in one go, and say what they differ by; left out: "
      "one");
  repeat->check(CLI::Range(procedure::kFewestPatterns, procedure::kMaxPatterns));
  CLI::Option* speeds = command.add_option(
      "--speeds", asked.conditions.speeds_mm_s,
      "fast speeds in mm/s, with commas: a pattern for each, beside one another, and pa table of "
      "them");
  CLI::Option* accelerations =
      command.add_option("--accelerations", asked.conditions.accelerations_mm_s2,
                         "accelerations in mm/s^2 likewise, each with each of the speeds");
  for (CLI::Option* option : {speeds, accelerations}) {
    option->delimiter(',')->excludes(repeat);
    for (CLI::Option* other : of_one_answer) option->excludes(other);
  }
  command
      .add_option("--max-flow", asked.conditions.max_flow_mm3_s,
                  "mm^3/s that the hot end melts: speeds that ask for more are refused")
      ->needs(speeds);
}

Result<void> LayOnPlate(const AskedPlate& asked, const procedure::Reach& reach,
                        files::Config& config) {
  Result<pressure_advance::PatternConfig> laid = config.pattern;
  if (asked.repeat) {
    laid = procedure::PatternsBeside(config.pattern, *asked.repeat, config.scan, reach);
  } else if (asked.conditions.any()) {
    const auto conditions = TRY(CombineConditions(asked.conditions, config.pattern));
    laid = LayConditions(conditions, config, reach);
  }
  if (!laid) return tl::unexpected(laid.error());
  config.pattern = std::move(*laid);
  return {};
}

Result<void> LayOnPlateOf(const AskedPlate& asked, const procedure::Session& session,
                          files::Config& config) {
  if (!asked.repeat && !asked.conditions.any()) return {};
  TRY(procedure::FirstFailure(CheckReady(session), ErrorKind::kMachine));
  const auto reach = TRY(procedure::ReachOf(session));
  return LayOnPlate(asked, reach, config);
}

namespace {

using pressure_advance::PatternPlan;
using pressure_advance::PlanLine;

/// Sine of the maximum angle between parallel lines: positions are written to 1 um, which rotates a
/// line of 1 mm by 0.002.
constexpr double kParallel = 0.005;

/// Unit vector of print direction.
struct Direction {
  double x = 0;
  double y = 0;
};

Direction DirectionOf(const PlanLine& line) {
  const double x_mm = line.end_x_mm - line.start_x_mm;
  const double y_mm = line.end_y_mm - line.start_y_mm;
  const double length_mm = std::hypot(x_mm, y_mm);
  return {x_mm / length_mm, y_mm / length_mm};
}

/// Returns why the lines cannot be read from a photo; empty if they can.
std::string FaultOf(const std::vector<PlanLine>& lines) {
  const Direction first = DirectionOf(lines.front());
  for (const PlanLine& line : lines) {
    const Direction along = DirectionOf(line);
    if (std::abs(first.x * along.y - first.y * along.x) > kParallel) {
      return fmt::format("the line of {} s is not parallel to that of {} s",
                         line.pressure_advance_s, lines.front().pressure_advance_s);
    }
    if (first.x * along.x + first.y * along.y < 0) {
      return fmt::format(
          "the lines of {} s and {} s were printed in opposite directions; a photo is read only "
          "where all run the same way: print the pattern of --photo, or with preset = \"paper\" "
          "and alternate_directions = false",
          lines.front().pressure_advance_s, line.pressure_advance_s);
    }
  }
  return {};
}

/// Returns the values in the order of the lines on the bed.
std::vector<double> ValuesAcross(const std::vector<PlanLine>& lines) {
  const Direction along = DirectionOf(lines.front());
  const auto across_mm = [&](const PlanLine& line) {
    return along.x * line.start_y_mm - along.y * line.start_x_mm;
  };
  std::vector<std::pair<double, double>> places;  // distance from the first printed, value
  for (const PlanLine& line : lines) {
    places.emplace_back(across_mm(line) - across_mm(lines.front()), line.pressure_advance_s);
  }
  std::sort(places.begin(), places.end());
  if (-places.front().first > places.back().first) std::reverse(places.begin(), places.end());
  std::vector<double> values;
  for (const auto& place : places) values.push_back(place.second);
  return values;
}

}  // namespace

Result<PhotoPlan> PhotoPlanOf(const PatternPlan& plan, const std::string& file) {
  std::map<int, std::vector<PlanLine>> patterns;
  for (const PlanLine& line : plan.lines) patterns[line.pattern].push_back(line);
  PhotoPlan result;
  result.form = PatternForm::kLines;
  result.segments = plan.segments;
  result.corner_mark = plan.corner_mark;
  result.printed_by = plan.printed_by;
  for (const auto& [pattern, lines] : patterns) {
    if (const std::string fault = FaultOf(lines); !fault.empty()) {
      return Fail(fmt::format("{}: pattern {}: {}", file, pattern, fault));
    }
    std::vector<double> values = ValuesAcross(lines);
    if (!result.pressure_advance_s.empty() && values != result.pressure_advance_s) {
      return Fail(fmt::format(
          "{}: patterns {} and {} hold different values, and a photo shows one of them; give its "
          "values with --pa and --segments instead",
          file, patterns.begin()->first, pattern));
    }
    result.pressure_advance_s = std::move(values);
  }
  return result;
}

void SetForPhoto(pressure_advance::PatternConfig& pattern) {
  using pressure_advance::PatternPreset;
  pressure_advance::PatternConfig photo;
  ApplyPreset(PatternPreset::kPhoto, photo);
  ApplyPreset(PatternPreset::kPhoto, pattern);
  // Requirements of a photo override the laser's settings.
  pattern.pressure_advances_s = photo.pressure_advances_s;
  pattern.segments = photo.segments;
  pattern.line_spacing_mm = std::max(photo.line_spacing_mm, 2 * pattern.line_width_mm);
  pattern.frame_margin_mm = photo.frame_margin_mm;
  pattern.frame_loops = std::max(pattern.frame_loops, photo.frame_loops);
  pattern.corner_mark = photo.corner_mark;
  pattern.alternate_directions = photo.alternate_directions;
}

Result<PhotoPlan> ParsePhotoPlan(const std::string& text, const std::string& file) {
  const PatternPlan plan = TRY(files::ParsePlan(text, file));
  return PhotoPlanOf(plan, file);
}

Result<PatternPlan> ReadPatternPlan(const std::filesystem::path& file) {
  const std::string text = TRY(files::ReadWholeFile(file, kMaxPlanFileBytes));
  return files::ParsePlan(text, file.string());
}

Result<PhotoPlan> ReadPhotoPlan(const std::filesystem::path& file) {
  const PatternPlan plan = TRY(ReadPatternPlan(file));
  return PhotoPlanOf(plan, file.string());
}

bool IsPlanName(const std::string& name) { return name.ends_with(".plan.json"); }

}  // namespace trammel::app
