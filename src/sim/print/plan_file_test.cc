#include "sim/print/plan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace trammel::sim {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

json GoodPlan() {
  return json::parse(R"({"format": 1, "kind": "pressure_advance_plan", "gcode": "pattern.gcode",
    "bed_mm": [250, 250], "layer_height_mm": 0.25, "line_width_mm": 0.495, "line_length_mm": 30.0,
    "acceleration_mm_s2": 3000,
    "segments": [{"fraction": 0.25, "speed_mm_s": 5}, {"fraction": 0.75, "speed_mm_s": 150}],
    "lines": [{"pattern": 0, "pressure_advance_s": 0.02, "start_mm": [100, 100],
               "end_mm": [130, 100]}]})");
}

TEST(PlanFile, ReadsThePlanOfTheFormatDocument) {
  const Result<Plan> plan = ParsePlan(GoodPlan().dump());
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(plan->line_length_mm, 30);
  ASSERT_EQ(plan->segments.size(), 2);
  EXPECT_EQ(plan->segments[1].speed_mm_s, 150);
  ASSERT_EQ(plan->lines.size(), 1);
  EXPECT_EQ(plan->lines[0].end_x_mm, 130);
}

TEST(PlanFile, IgnoresKeysThatBeginWithX) {
  json plan = GoodPlan();
  plan["x_note"] = {1, 2};
  plan["lines"][0]["x_note"] = "a";
  EXPECT_TRUE(ParsePlan(plan.dump()));
}

TEST(PlanFile, RefusesEachFaultByName) {
  struct Fault {
    const char* pointer;
    json value;
    const char* message;
  };
  const Fault faults[] = {
      {"/format", 2, "\"format\" = 2"},
      {"/kind", "tap", "\"kind\" = \"tap\""},
      {"/line_length_mm", "long", "\"line_length_mm\" = \"long\""},
      {"/line_length_mm", 1e300, "\"line_length_mm\" = 1e+300"},
      {"/line_length_mm", -1, "must be within"},
      {"/acceleration_mm_s2", nullptr, "\"acceleration_mm_s2\" = null"},
      {"/segments", json::array(), "\"segments\" = []"},
      {"/segments/0", 3, "\"segments\"[0] = 3"},
      {"/segments/0/fraction", 0.5, "sum to 1.25"},
      {"/segments/0/speed", 5, "unknown key \"segments\"[0].\"speed\""},
      {"/segments/1/speed_mm_s", 0, "\"segments\"[1].\"speed_mm_s\" = 0"},
      {"/lines", 7, "\"lines\" = 7"},
      {"/lines/0/pattern", 0.5, "must be whole"},
      {"/lines/0/pressure_advance_s", -0.1, "\"lines\"[0].\"pressure_advance_s\" = -0.1"},
      {"/lines/0/end_mm", json::array({1}), "must be [x, y]"},
      {"/lines/0/end_mm", json::array({130, 101}), "must lie along x or y"},
      {"/lines/0/end_mm", json::array({120, 100}), "is 20 mm long"},
      {"/lines/0/end_mm", json::array({"a", 100}), "\"end_mm\"[0] = \"a\""},
      {"/surprise", 1, "unknown key \"surprise\""},
  };
  for (const Fault& fault : faults) {
    json plan = GoodPlan();
    plan[json::json_pointer(fault.pointer)] = fault.value;
    const Result<Plan> read = ParsePlan(plan.dump());
    ASSERT_FALSE(read) << fault.pointer;
    EXPECT_THAT(read.error().message, HasSubstr(fault.message)) << fault.pointer;
  }
}

TEST(PlanFile, RefusesMissingKeysAndWhatIsNotAPlan) {
  for (const char* key : {"format", "kind", "line_length_mm", "segments", "lines"}) {
    json plan = GoodPlan();
    plan.erase(key);
    const Result<Plan> read = ParsePlan(plan.dump());
    ASSERT_FALSE(read) << key;
    EXPECT_THAT(read.error().message, HasSubstr(std::string("\"") + key + "\" is missing"));
  }
  for (const char* text : {"", "{", "[]", "null", "\"plan\"", "{\"format\": 1e999}", "\xff\xfe"}) {
    EXPECT_FALSE(ParsePlan(text)) << text;
  }
}

TEST(PlanFile, NamesTheFileThatIsNotThere) {
  const Result<Plan> read = ReadPlanFile("/nowhere/p.plan.json");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("/nowhere/p.plan.json"));
  EXPECT_FALSE(ReadPlanFile("/tmp"));
}

}  // namespace
}  // namespace trammel::sim
