#include "pressure_advance/commands/photo_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "pressure_advance/pattern/pattern.h"

namespace trammel::app {
namespace {

using pressure_advance::PatternConfig;
using pressure_advance::PatternPlan;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

PatternPlan PlanOf(PatternConfig config) {
  config.pressure_advances_s = {0.01, 0.02, 0.04};
  return MakePlan(LayOut(config), config, "pattern.gcode");
}

std::string FaultOf(const PatternPlan& plan) {
  const auto photo = PhotoPlanOf(plan, "a.plan.json");
  return photo ? "" : photo.error().message;
}

/// Exchanges x and y: the same pattern with its lines along y.
PatternPlan Turned(PatternPlan plan) {
  for (auto& line : plan.lines) {
    std::swap(line.start_x_mm, line.start_y_mm);
    std::swap(line.end_x_mm, line.end_y_mm);
  }
  return plan;
}

TEST(PhotoPlan, TakesValuesAndSegmentsOfThePattern) {
  PatternConfig config;
  config.segments = {{0.2, 10}, {0.5, 90}, {0.3, 10}};
  const auto photo = PhotoPlanOf(PlanOf(config), "a.plan.json");
  ASSERT_TRUE(photo) << photo.error().message;
  EXPECT_THAT(photo->pressure_advance_s, ElementsAre(0.01, 0.02, 0.04));
  ASSERT_EQ(photo->segments.size(), 3u);
  EXPECT_EQ(photo->segments[1].speed_mm_s, 90);
  EXPECT_FALSE(photo->start);
}

TEST(PhotoPlan, OrdersLinesByTheirPlacesFromTheOnePrintedFirst) {
  PatternPlan plan = PlanOf({});
  std::reverse(plan.lines.begin(), plan.lines.end());  // printed from the back to the front
  EXPECT_THAT(PhotoPlanOf(plan, "")->pressure_advance_s, ElementsAre(0.04, 0.02, 0.01));
  std::swap(plan.lines[1], plan.lines[2]);  // the outer two first, the middle one last
  EXPECT_THAT(PhotoPlanOf(plan, "")->pressure_advance_s, ElementsAre(0.04, 0.02, 0.01));
  EXPECT_THAT(PhotoPlanOf(Turned(plan), "")->pressure_advance_s, ElementsAre(0.04, 0.02, 0.01));
}

TEST(PhotoPlan, TakesAnyOfSeveralPatternsThatAreAlike) {
  PatternConfig config;
  config.columns = 2;
  PatternPlan plan = PlanOf(config);
  EXPECT_THAT(PhotoPlanOf(plan, "")->pressure_advance_s, ElementsAre(0.01, 0.02, 0.04));
  plan.lines.back().pressure_advance_s = 0.05;
  EXPECT_THAT(FaultOf(plan), AllOf(HasSubstr("a.plan.json"), HasSubstr("patterns 0 and 1")));
}

TEST(PhotoPlan, RefusesLinesThatAPhotoCannotBeReadFor) {
  PatternConfig config;
  config.alternate_directions = true;
  EXPECT_THAT(FaultOf(PlanOf(config)),
              AllOf(HasSubstr("0.01 s and 0.02 s"), HasSubstr("alternate_directions = false")));
  PatternPlan crossed = PlanOf({});
  crossed.lines[1] = Turned(crossed).lines[1];
  EXPECT_THAT(FaultOf(crossed), HasSubstr("0.02 s is not parallel"));
}

TEST(PhotoPlan, NamesAFileThatIsNotThere) {
  const auto photo = ReadPhotoPlan("nowhere.plan.json");
  ASSERT_FALSE(photo);
  EXPECT_THAT(photo.error().message, HasSubstr("nowhere.plan.json"));
}

}  // namespace
}  // namespace trammel::app
