#include "pressure_advance/commands/photo_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "files/whole_file.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/pattern/pattern_presets.h"

namespace trammel::app {
namespace {

using pressure_advance::PatternPlan;
using pressure_advance::PlanLine;

/// Sine of the largest angle at which two lines still count as parallel: positions are written to
/// 1 um, which turns a line of 1 mm by 0.002.
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

/// Why the lines cannot be read from a photo; empty where they can.
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

/// Values in the order in which the lines lie on the bed.
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
  constexpr int kLines = 21;
  ApplyPreset(pressure_advance::PatternPreset::kPaper, pattern);
  pattern.pressure_advances_s.clear();
  for (int line = 0; line < kLines; ++line) pattern.pressure_advances_s.push_back(0.005 * line);
  pattern.segments = PhotoPlan().segments;
  pattern.line_spacing_mm = 1.5;
  pattern.frame_margin_mm.reset();  // what the mark needs
  pattern.frame_loops = std::max(pattern.frame_loops, 1);
  pattern.corner_mark = true;
  pattern.alternate_directions = false;
}

Result<PhotoPlan> ParsePhotoPlan(const std::string& text, const std::string& file) {
  const PatternPlan plan = TRY(files::ParsePlan(text, file));
  return PhotoPlanOf(plan, file);
}

Result<PatternPlan> ReadPatternPlan(const std::filesystem::path& file) {
  const std::string text = TRY(files::ReadWholeFile(file, kMostPlanFileBytes));
  return files::ParsePlan(text, file.string());
}

Result<PhotoPlan> ReadPhotoPlan(const std::filesystem::path& file) {
  const PatternPlan plan = TRY(ReadPatternPlan(file));
  return PhotoPlanOf(plan, file.string());
}

bool IsPlanName(const std::string& name) { return name.ends_with(".plan.json"); }

}  // namespace trammel::app
