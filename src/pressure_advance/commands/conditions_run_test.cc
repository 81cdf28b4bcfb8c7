#include "pressure_advance/commands/conditions_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/pattern/pattern_presets.h"

namespace trammel::app {
namespace {

using pressure_advance::PatternConditions;
using pressure_advance::PatternConfig;
using ::testing::HasSubstr;

constexpr procedure::Reach kReach{{0, 0, 0}, {250, 250, 250}};

files::Config Settings() {
  files::Config config;
  config.pattern.material = "pla";
  ApplyPreset(pressure_advance::kDefaultPreset, config.pattern, config.scan);
  return config;
}

std::string Refusal(const AskedConditions& asked) {
  const auto conditions = CombineConditions(asked, Settings().pattern);
  return conditions ? "" : conditions.error().message;
}

TEST(Conditions, AreEachSpeedWithEachAcceleration) {
  const auto conditions = CombineConditions({{60, 100, 150}, {1500, 3000}, {}}, Settings().pattern);
  ASSERT_TRUE(conditions.has_value()) << conditions.error().message;
  ASSERT_EQ(conditions->size(), 6U);
  EXPECT_EQ((*conditions)[1].fast_speed_mm_s, 100);
  EXPECT_EQ((*conditions)[1].acceleration_mm_s2, 1500);
  EXPECT_EQ((*conditions)[5].fast_speed_mm_s, 150);
  EXPECT_EQ((*conditions)[5].acceleration_mm_s2, 3000);
}

TEST(Conditions, TakeWhatIsNotNamedFromTheSettings) {
  const auto speeds = CombineConditions({{60, 100}, {}, {}}, Settings().pattern);
  ASSERT_TRUE(speeds.has_value());
  EXPECT_EQ((*speeds)[0].acceleration_mm_s2, 3000);
  const auto accelerations = CombineConditions({{}, {2000, 3000}, {}}, Settings().pattern);
  ASSERT_TRUE(accelerations.has_value());
  EXPECT_EQ((*accelerations)[1].fast_speed_mm_s, 150);
}

TEST(Conditions, ThatAreNoneAreRefusedByName) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Refusal({{60}, {}, {}}), HasSubstr("1 combination(s)"));
  EXPECT_THAT(Refusal({{60, 80, 100, 120}, {1000, 2000, 3000}, {}}), HasSubstr("12 combin"));
  EXPECT_THAT(Refusal({{60, 60}, {}, {}}), HasSubstr("twice"));
  EXPECT_THAT(Refusal({{60, kNaN}, {}, {}}), HasSubstr("--speeds nan"));
  EXPECT_THAT(Refusal({{60, 100}, {-1}, {}}), HasSubstr("--accelerations -1"));
  EXPECT_THAT(Refusal({{60, 0}, {}, {}}), HasSubstr("--speeds 0"));
  EXPECT_THAT(Refusal({{5, 100}, {}, {}}), HasSubstr("10 mm/s"));
  EXPECT_THAT(Refusal({{60, 150}, {}, 12}), HasSubstr("--max-flow"));
  EXPECT_THAT(Refusal({{60, 150}, {}, kNaN}), HasSubstr("--max-flow nan"));
  EXPECT_EQ(Refusal({{60, 100}, {}, 12}), "");
}

TEST(Conditions, ArePrintedAndScannedAsTheirPlansSay) {
  const files::Config config = Settings();
  const auto conditions = CombineConditions({{60, 150}, {3000, 5000}, {}}, config.pattern);
  ASSERT_TRUE(conditions.has_value());
  const auto laid = LayConditions(*conditions, config, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  const auto layout = LayOut(*laid);
  for (const pressure_advance::Move& move : layout.moves) {
    if (move.kind != pressure_advance::MoveKind::kLine || move.segment != 1) continue;
    EXPECT_EQ(move.speed_mm_s,
              (*conditions)[static_cast<std::size_t>(move.pattern)].fast_speed_mm_s);
  }
  const auto plan = PlanOfPattern(layout, *laid, 2, "pattern.gcode");
  EXPECT_EQ(plan.acceleration_mm_s2, 5000);
  EXPECT_EQ(plan.segments[1].speed_mm_s, 60);
  EXPECT_EQ(plan.segments[0].speed_mm_s, 10);
  ASSERT_EQ(plan.lines.size(), 10U);
  for (const auto& line : plan.lines) EXPECT_EQ(line.pattern, 0);
  const std::string gcode = WriteGcode(layout, *laid);
  EXPECT_THAT(gcode, HasSubstr("needs a printer that is allowed 150 mm/s and 5000 mm/s^2"));
  const std::size_t third = gcode.find("; frame of pattern 2");
  EXPECT_THAT(gcode.substr(third, 80), HasSubstr("ACCEL=5000"));
}

TEST(Conditions, ThatALineIsTooShortForAreRefusedByName) {
  const files::Config config = Settings();
  const auto conditions = CombineConditions({{60, 150}, {1000}, {}}, config.pattern);
  ASSERT_TRUE(conditions.has_value());
  const auto laid = LayConditions(*conditions, config, kReach);
  ASSERT_FALSE(laid.has_value());
  EXPECT_THAT(laid.error().message, HasSubstr("at 150 mm/s and 1000 mm/s^2"));
}

}  // namespace
}  // namespace trammel::app
