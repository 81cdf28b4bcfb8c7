#include "pressure_advance/commands/pattern_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "pressure_advance/pattern/pattern.h"

namespace trammel::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(PressureAdvances, ReadsListsStepsAndCounts) {
  EXPECT_THAT(*ParsePressureAdvances("0,0.01, 0.5"), ElementsAre(0, 0.01, 0.5));
  EXPECT_THAT(*ParsePressureAdvances("0.04"), ElementsAre(0.04));
  EXPECT_THAT(*ParsePressureAdvances("0:0.06:0.02"), ElementsAre(0, 0.02, 0.04, 0.06));
  EXPECT_THAT(*ParsePressureAdvances("0:0.06:4"), ElementsAre(0, 0.02, 0.04, 0.06));
  EXPECT_THAT(*ParsePressureAdvances("0:1:1"), ElementsAre(0, 1));
  EXPECT_EQ(ParsePressureAdvances("0:0.1:0.005")->size(), 21u);
  EXPECT_EQ(ParsePressureAdvances("0:0.06:10")->size(), 10u);
}

TEST(PressureAdvances, NamesWhatIsWrong) {
  struct Mistake {
    const char* text;
    const char* says;
  };
  for (const Mistake& mistake : {
           Mistake{"", "\"\" is not a number"},
           Mistake{"0,,1", "\"\" is not a number"},
           Mistake{"abc", "\"abc\" is not a number"},
           Mistake{"0x1", "\"0x1\" is not a number"},
           Mistake{"0,inf", "\"inf\" is not a number"},
           Mistake{"0:1", "START:END:STEP"},
           Mistake{"0:1:2:3", "START:END:STEP"},
           Mistake{"0.1:0:0.01", "the end 0 is not above the start 0.1"},
           Mistake{"0:0.1:-0.01", "must be above 0"},
           Mistake{"0:0.1:0", "must be above 0"},
           Mistake{"0:0.1:0.03", "neither divides the range 0.1 nor is a count"},
           Mistake{"0:0.1:2.5", "neither divides"},
           Mistake{"0:0.1:1e-9", "more than 1000"},
           Mistake{"0:0.1:1e300", "more than 1000"},
           Mistake{"-0.1,0.1", "-0.1 s is outside 0 ... 10 s"},
           Mistake{"0:20:5", "15 s is outside"},
       }) {
    const auto values = ParsePressureAdvances(mistake.text);
    ASSERT_FALSE(values) << mistake.text;
    EXPECT_THAT(values.error().message, HasSubstr(mistake.says)) << mistake.text;
  }
  EXPECT_FALSE(ParsePressureAdvances(std::string(100000, ',')));
}

TEST(Segments, NamesThePartAndTheBound) {
  struct Mistake {
    const char* text;
    const char* says;
  };
  for (const Mistake& mistake : {
           Mistake{"", "'' is not FRACTION:SPEED"},
           Mistake{"0.5:10,", "'' is not FRACTION:SPEED"},
           Mistake{"0.5", "'0.5' is not FRACTION:SPEED"},
           Mistake{"0.5:10:3,0.5:10", "'0.5:10:3' is not FRACTION:SPEED"},
           Mistake{"0.5:ten,0.5:10", "'0.5:ten'"},
           Mistake{"0.5:10mm,0.5:10", "'0.5:10mm'"},
           Mistake{"nan:10,0.5:10", "'nan:10'"},
           Mistake{"0.5:inf,0.5:10", "'0.5:inf'"},
           Mistake{"0:10,1:10", "'0:10'"},
           Mistake{"1:10", "a fraction between 0 and 1"},
           Mistake{"-0.5:10,0.5:10", "'-0.5:10'"},
           Mistake{"0.5:0.05,0.5:10", "a speed of 0.1 to 2000 mm/s"},
           Mistake{"0.5:2001,0.5:10", "'0.5:2001'"},
           Mistake{"0.5:10,0.49:10", "sum to 0.99; they must sum to 1"},
           Mistake{"0.5:10,0.5:10,0.5:10", "sum to 1.5"},
       }) {
    const auto segments = ParseSegments(mistake.text);
    ASSERT_FALSE(segments) << mistake.text;
    EXPECT_THAT(segments.error().message, HasSubstr("--segments")) << mistake.text;
    EXPECT_THAT(segments.error().message, HasSubstr(mistake.says)) << mistake.text;
  }
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "0.001:10,";
  EXPECT_FALSE(ParseSegments(many + "0.001:10"));
}

using pressure_advance::PatternConfig;
using pressure_advance::PatternPlan;
using ::testing::AllOf;

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

}  // namespace
}  // namespace trammel::app
