#include "sim/print/plan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace trammel::sim {
namespace {

using nlohmann::json;

json GoodPlan() {
  return json::parse(R"({"format": 1, "kind": "pressure_advance_plan", "gcode": "pattern.gcode",
    "bed_mm": [250, 250], "layer_height_mm": 0.25, "line_width_mm": 0.495, "line_length_mm": 30.0,
    "acceleration_mm_s2": 3000,
    "segments": [{"fraction": 0.25, "speed_mm_s": 5}, {"fraction": 0.75, "speed_mm_s": 150}],
    "lines": [{"pattern": 0, "pressure_advance_s": 0.02, "start_mm": [100, 100],
               "end_mm": [130, 100]}]})");
}

TEST(PlanFile, ReadsThePlanOfTheFormatDocumentAndNamesAFault) {
  const Result<Plan> plan = ParsePlan(GoodPlan().dump());
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(plan->line_length_mm, 30);
  EXPECT_EQ(plan->segments.at(1).speed_mm_s, 150);
  EXPECT_EQ(plan->lines.at(0).end_x_mm, 130);
  json wrong = GoodPlan();
  wrong["lines"][0]["end_mm"] = {130};
  EXPECT_THAT(ParsePlan(wrong.dump()).error().message, ::testing::HasSubstr("lines[0].end_mm"));
}

}  // namespace
}  // namespace trammel::sim
