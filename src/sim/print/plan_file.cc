#include "sim/print/plan_file.h"

#include <fmt/format.h>

#include <string>

#include "files/json_object.h"

namespace trammel::sim {
namespace {

constexpr files::NumberRange kPlace_mm{-10000, 10000};

Result<PlannedLine> ReadLine(files::JsonObject object) {
  PlannedLine line;
  line.pattern = object.Integer("pattern", {0, 100000});
  line.pressure_advance_s = object.Number("pressure_advance_s", {0, 10});
  const std::vector<double> start = object.Numbers("start_mm", 2, 2, kPlace_mm);
  const std::vector<double> end = object.Numbers("end_mm", 2, 2, kPlace_mm);
  TRY(object.Faults());
  line.start_x_mm = start[0];
  line.start_y_mm = start[1];
  line.end_x_mm = end[0];
  line.end_y_mm = end[1];
  return line;
}

}  // namespace

Result<Plan> ParsePlan(std::string_view text, const std::string& file) {
  const nlohmann::json json = TRY(files::ParseJson(text, file));
  files::JsonObject root(json, file);
  (void)root.Integer("format", {1, 1});
  (void)root.Choice("kind", {"pressure_advance_plan"});
  Plan plan;
  plan.line_length_mm = root.Number("line_length_mm", {1e-3, 2000});
  plan.acceleration_mm_s2 = root.Number("acceleration_mm_s2", {1e-3, 1e6});
  plan.layer_height_mm = root.Number("layer_height_mm", {1e-3, 10});
  plan.line_width_mm = root.Number("line_width_mm", {plan.layer_height_mm, 100});
  for (const nlohmann::json& entry : root.List("segments", 1, 100)) {
    files::JsonObject object = root.Inner(entry, fmt::format("segments[{}]", plan.segments.size()));
    const double fraction = object.Number("fraction", {1e-6, 1});
    plan.segments.push_back({fraction, object.Number("speed_mm_s", {1e-3, 10000})});
    TRY(object.Faults());
  }
  for (const nlohmann::json& entry : root.List("lines", 1, 100'000)) {
    plan.lines.push_back(
        TRY(ReadLine(root.Inner(entry, fmt::format("lines[{}]", plan.lines.size())))));
  }
  TRY(root.Faults());
  return plan;
}

}  // namespace trammel::sim
