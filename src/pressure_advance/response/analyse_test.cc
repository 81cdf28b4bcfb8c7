#include "pressure_advance/response/analyse.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "pressure_advance/response/lag_line_test_support.h"
#include "support/lag_line.h"

namespace trammel::pressure_advance {
namespace {

const testing::LagLine kLine;

// The paper's lines of one pattern, by an extruder of this lag.
void Print(int pattern, double lag_s, Random& random, std::vector<LineProfile>& profiles) {
  constexpr double kArea_mm2 = 0.11, kNoise = 0.02, kEnds_mm = 4;
  for (int line = 0; line < 10; ++line) {
    LineProfile profile;
    profile.pattern = pattern;
    profile.pressure_advance_s = 0.06 * line / 9;
    const testing::LagLaw law{.linear_s = lag_s + 0.001 * random.Normal()};
    const auto areas = PrintLagLine(kLine, law, profile.pressure_advance_s);
    for (std::size_t i = 0; i < areas.size(); ++i) {
      const double position = kLine.step_mm * static_cast<double>(i);
      if (position < kEnds_mm || position > kLine.length_mm - kEnds_mm) continue;
      ProfileSample sample;
      sample.position = position;
      sample.area = {kArea_mm2 * (areas[i] + kNoise * random.Normal()), kArea_mm2 * kNoise};
      profile.samples.push_back(sample);
    }
    profiles.push_back(std::move(profile));
  }
}

TEST(Analyse, SaysWhatEachOfSeveralPatternsSaysAlone) {
  Random random(11);
  std::vector<LineProfile> profiles;
  for (const int pattern : {0, 1, 2}) Print(pattern, 0.03, random, profiles);
  const Analysis analysis = Analyse(profiles, MotionOf(kLine), {});
  ASSERT_TRUE(analysis.pressure_advance.good()) << analysis.pressure_advance.reason();
  ASSERT_TRUE(analysis.repeats.has_value());
  ASSERT_EQ(analysis.repeats->pattern_s.size(), 3U);
  double mean_s = 0;
  for (const Measured& pattern : analysis.repeats->pattern_s) {
    ASSERT_TRUE(pattern.good());
    mean_s += pattern.quantity().value / 3;
  }
  const Quantity& answer = analysis.pressure_advance.quantity();
  EXPECT_NEAR(answer.value, mean_s, 0.0001);
  EXPECT_NEAR(answer.value, 0.03, 3 * answer.standard_uncertainty);
  EXPECT_FALSE(analysis.repeats->disagree);
  EXPECT_EQ(analysis.lines.back().pattern, 2);
  // Points and curve of a transition fall through zero at its value.
  const TransitionResult& rise = analysis.response.acceleration;
  const double value_s = rise.pressure_advance.quantity().value;
  for (std::size_t i = 1; i < 10; ++i) {
    const double before_s = profiles[i - 1].pressure_advance_s;
    const double behind_s = profiles[i].pressure_advance_s;
    if (value_s < before_s || value_s > behind_s) continue;
    const double share = (value_s - before_s) / (behind_s - before_s);
    EXPECT_NEAR(std::lerp(rise.fitted_s[i - 1], rise.fitted_s[i], share), 0, 0.0003);
  }
}

TEST(Analyse, NamesPatternsThatDiffer) {
  Random random(12);
  std::vector<LineProfile> profiles;
  Print(0, 0.026, random, profiles);
  Print(1, 0.034, random, profiles);
  const Analysis analysis = Analyse(profiles, MotionOf(kLine), {});
  ASSERT_TRUE(analysis.repeats.has_value());
  EXPECT_TRUE(analysis.repeats->disagree);
  EXPECT_TRUE(std::ranges::any_of(analysis.notices, [](const std::string& notice) {
    return notice.find("the patterns differ") != std::string::npos;
  }));
}

TEST(Analyse, OfOnePatternHasNothingToRepeat) {
  Random random(13);
  std::vector<LineProfile> profiles;
  Print(0, 0.03, random, profiles);
  EXPECT_FALSE(Analyse(profiles, MotionOf(kLine), {}).repeats.has_value());
}

}  // namespace
}  // namespace trammel::pressure_advance
