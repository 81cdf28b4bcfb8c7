#include "pressure_advance/commands/photo_batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "app/commands.h"
#include "app/slow_work.h"
#include "base/json_text.h"
#include "document/interval_text.h"
#include "machine/camera/phone_picture.h"
#include "pressure_advance/commands/conditions_run.h"
#include "pressure_advance/files/orca_profile.h"
#include "pressure_advance/photo/plate_patterns.h"
#include "pressure_advance/report/analysis_json.h"

namespace trammel::app {
namespace {

using files::SlicerPattern;
using pressure_advance::ChevronView;

// Answer of one pattern.
struct Row {
  const SlicerPattern* pattern = nullptr;
  AnalysisRun run;
};

Result<std::vector<Row>> MeasureAll(const std::vector<std::string>& photos,
                                    const files::SlicerPrint& print) {
  const std::vector<SlicerPattern>& patterns = print.patterns;
  std::vector<Row> rows;
  if (photos.size() == 1) {
    const Frame whole = TRY(machine::ReadPhotoFile(photos.front()));
    constexpr int kSmallest_px = 64, kLongest_px = 16000;  // Rectify's limit is 16384
    constexpr double kLargest_px = 1e8;
    if (std::min(whole.width, whole.height) < kSmallest_px) {
      return Fail(
          fmt::format("{}: the photo has {} x {} px", photos.front(), whole.width, whole.height),
          ErrorKind::kMeasurement);
    }
    double scale = 1;
    const Frame picture = vision::ShrinkToFit(whole.view(), kLongest_px, kLargest_px, scale);
    std::vector<pressure_advance::PlatePattern> places;
    for (const SlicerPattern& p : patterns) {
      places.push_back({static_cast<int>(p.pressure_advance_s.size()), p.spacing_mm, p.x_mm, p.y_mm,
                        p.heading_rad});
    }
    const auto plate = pressure_advance::FindPlatePatterns(picture.view(), places);
    if (!plate.problem.empty()) return Fail(plate.problem, ErrorKind::kMeasurement);
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      ChevronView view;
      view.problem = "this pattern is not seen; a photo of it alone may show more";
      if (plate.found[i]) view = pressure_advance::ViewChevrons(picture.view(), *plate.found[i]);
      rows.push_back({&patterns[i], AnalyseCorners(picture, photos.front(), view,
                                                   PhotoPlanOf(patterns[i], print.printed_by))});
      if (rows.back().run.mirrored) {
        return Fail(
            fmt::format("{}: the picture is mirrored, as its numbers show, so that the patterns "
                        "would be taken for each other: mirror it back, or photograph them again",
                        photos.front()),
            ErrorKind::kMeasurement);
      }
    }
    return rows;
  }
  for (std::size_t i = 0; i < photos.size(); ++i) {
    rows.push_back(
        {&patterns[i], TRY(AnalysePhoto(photos[i], PhotoPlanOf(patterns[i], print.printed_by)))});
  }
  return rows;
}

std::vector<Row> RefuseAll(const files::SlicerPrint& print, const std::string& reason) {
  std::vector<Row> rows;
  for (const SlicerPattern& pattern : print.patterns) {
    rows.push_back({&pattern, RefusedRun(reason)});
  }
  return rows;
}

std::optional<pressure_advance::FlowPoint> PointOf(const Row& row) {
  const Measured& answer = row.run.analysis.pressure_advance;
  if (!answer.good() || !row.pattern->acceleration_mm_s2) return std::nullopt;
  pressure_advance::FlowPoint point;
  point.flow_mm3_s = row.pattern->flow_mm3_s;
  point.acceleration_mm_s2 = *row.pattern->acceleration_mm_s2;
  point.layer_height_mm = row.pattern->layer_height_mm;
  point.pressure_advance_s = answer.quantity();
  return point;
}

nlohmann::ordered_json JsonOf(const std::vector<Row>& rows,
                              const std::optional<pressure_advance::FlowTable>& table) {
  constexpr int kFormat = 1;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Row& row : rows) {
    auto object = report::JsonOf(row.run.analysis, std::nullopt);
    object["speed_mm_s"] = row.pattern->speed_mm_s;
    object["flow_mm3_s"] = row.pattern->flow_mm3_s;
    object["acceleration_mm_s2"] = nullptr;
    if (row.pattern->acceleration_mm_s2) {
      object["acceleration_mm_s2"] = *row.pattern->acceleration_mm_s2;
    }
    list.push_back(std::move(object));
  }
  return {{"format", kFormat},
          {"patterns", std::move(list)},
          {"table", table ? TableJson(*table) : nlohmann::ordered_json(nullptr)}};
}

void Print(const Row& row) {
  const SlicerPattern& pattern = *row.pattern;
  const Measured& answer = row.run.analysis.pressure_advance;
  fmt::print("{:.1f} mm3/s, {:.0f} mm/s2  {}\n", pattern.flow_mm3_s,
             pattern.acceleration_mm_s2.value_or(0),
             answer.good() ? report::WithInterval(answer.quantity(), report::kSeconds)
                           : fmt::format("{}: {}", VerdictText(answer.verdict()), answer.reason()));
}

// Names the first patterns by plate, kind, number and range.
std::string ListOf(const std::vector<SlicerPattern>& patterns) {
  constexpr std::size_t kMostNamed = 8;
  std::string list;
  for (std::size_t i = 0; i < std::min(patterns.size(), kMostNamed); ++i) {
    const SlicerPattern& pattern = patterns[i];
    const std::string place = pattern.plate.empty()
                                  ? fmt::format("x {:.0f}, y {:.0f} mm", pattern.x_mm, pattern.y_mm)
                                  : pattern.plate;
    list += fmt::format("{}{}: {} {} from {:g} to {:g} s", list.empty() ? "" : "; ", place,
                        pattern.pressure_advance_s.size(),
                        pattern.form == PatternForm::kLines ? "lines" : "corners",
                        pattern.pressure_advance_s.front(), pattern.pressure_advance_s.back());
  }
  return patterns.size() > kMostNamed ? list + "; …" : list;
}

// Returns how to name one of several patterns: by its plate, else by its values.
std::string HowToChoose(const std::vector<SlicerPattern>& patterns) {
  const SlicerPattern& first = patterns.front();
  if (!first.plate.empty() && patterns.back().plate != first.plate) {
    return fmt::format("name the plate that the photo shows, such as --plate {}", first.plate);
  }
  return "photograph one alone, and give its values in place of the file: --pattern orca-line --pa "
         "START:END:STEP";
}

}  // namespace

PhotoPlan PhotoPlanOf(const SlicerPattern& pattern,
                      const std::optional<gcode::PrintedBy>& printed_by) {
  PhotoPlan plan;
  plan.pressure_advance_s = pattern.pressure_advance_s;
  plan.printed_by = printed_by;
  plan.form = pattern.form;
  if (pattern.form == PatternForm::kLines) {
    plan.segments = pattern.segments;
    plan.framed = false;
    plan.length_pitches = pattern.length_mm / pattern.spacing_mm;
    plan.length_mm = pattern.length_mm;
    plan.to_and_fro = pattern.to_and_fro;
    plan.acceleration_mm_s2 = pattern.acceleration_mm_s2;
  } else {
    plan.motion = {pattern.speed_mm_s, pattern.acceleration_mm_s2, pattern.smooth_time_s};
    plan.spacing_mm = pattern.spacing_mm;
  }
  return plan;
}

Result<int> RunPhotoBatch(const std::vector<std::string>& photos, const std::string& file,
                          const files::SlicerPrint& print, bool json) {
  const auto lines = std::ranges::find(print.patterns, PatternForm::kLines, &SlicerPattern::form);
  if (lines != print.patterns.end()) {
    return Fail(fmt::format(
        "{} holds {} patterns ({}), and lines are read one pattern at a time: "
        "{}",
        file, print.patterns.size(), ListOf(print.patterns), HowToChoose(print.patterns)));
  }
  constexpr std::size_t kMaxPatterns = 50;  // each is searched for seconds; a plate holds about 20
  if (print.patterns.size() > kMaxPatterns) {
    return Fail(fmt::format("the file holds {} patterns, more than {}", print.patterns.size(),
                            kMaxPatterns));
  }
  if (photos.size() != 1 && photos.size() != print.patterns.size()) {
    return Fail(
        fmt::format("the file holds {0} patterns, and {1} photos are named: give one photo "
                    "of all, or {0} photos, front to back and left to right",
                    print.patterns.size(), photos.size()));
  }
  const SlowWork work("analysing " + photos.front());
  Result<std::vector<Row>> measured = MeasureAll(photos, print);
  if (!measured && json && measured.error().kind == ErrorKind::kMeasurement) {
    measured = RefuseAll(print, measured.error().message);
  }
  const std::vector<Row> rows = TRY(std::move(measured));
  std::vector<pressure_advance::FlowPoint> points;
  for (const Row& row : rows) {
    if (const auto point = PointOf(row)) points.push_back(*point);
  }
  std::optional<pressure_advance::FlowTable> table;
  if (!points.empty()) table = TRY(pressure_advance::MakeFlowTable(points));
  const bool whole = points.size() == rows.size();
  if (json) {
    fmt::print("{}", JsonText(JsonOf(rows, table)));
  } else {
    for (const Row& row : rows) Print(row);
    if (table) {
      PrintTable(*table, print.filament_mm);
      const auto adaptive = pressure_advance::AdaptiveRows(*table);
      if (!adaptive.empty()) {
        fmt::print("OrcaSlicer, adaptive pressure advance (PA, flow, acceleration):\n{}\n",
                   files::AdaptiveModel(adaptive));
      }
    }
  }
  return whole ? kExitGood : kExitNotTrusted;
}

}  // namespace trammel::app
