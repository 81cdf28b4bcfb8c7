#include "pressure_advance/response/responding_stretch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

// Lines of width 30 px that change with PA only in a bump around `at`, under noise and uneven
// light.
std::vector<LineProfile> Lines(double at, double half_width, double gain, double noise,
                               Random& random) {
  std::vector<LineProfile> profiles;
  for (int line = 0; line < 21; ++line) {
    LineProfile profile;
    profile.pressure_advance_s = 0.005 * line;
    profile.position_unit = PositionUnit::kLineLength;
    for (int i = 0; i < 300; ++i) {
      ProfileSample sample;
      sample.position = (i + 0.5) / 300;
      const double u = (sample.position - at) / half_width;
      const double bump = std::abs(u) < 1 ? 1 - u * u : 0;
      const double light = 1 + 0.05 * std::sin(3 * sample.position + line);
      sample.width = {
          30 * light * (1 + gain * profile.pressure_advance_s * bump) + noise * random.Normal(), 1};
      profile.samples.push_back(sample);
    }
    profiles.push_back(profile);
  }
  return profiles;
}

TEST(RespondingStretch, HoldsTheStretchThatAnswersAndLittleMore) {
  Random random(1);
  const auto lines = Lines(0.3, 0.06, 4, 1, random);
  const auto stretch = RespondingStretch(lines, Reading::kWidth, {0.1, 0.6}, true);
  ASSERT_TRUE(stretch);
  EXPECT_LT(stretch->lo, 0.26);
  EXPECT_GT(stretch->lo, 0.19);
  EXPECT_GT(stretch->hi, 0.34);
  EXPECT_LT(stretch->hi, 0.41);
}

TEST(RespondingStretch, KnowsTheSign) {
  Random random(2);
  const auto lines = Lines(0.3, 0.06, -4, 1, random);
  const auto falling = RespondingStretch(lines, Reading::kWidth, {0.1, 0.6}, false);
  ASSERT_TRUE(falling);
  EXPECT_NEAR((falling->lo + falling->hi) / 2, 0.3, 0.04);
}

TEST(RespondingStretch, FindsNothingWithoutEnoughLines) {
  Random random(3);
  const auto lines = Lines(0.3, 0.06, 0, 0, random);
  EXPECT_FALSE(RespondingStretch({}, Reading::kWidth, {0.1, 0.6}, true));
  EXPECT_FALSE(RespondingStretch({lines[0], lines[1]}, Reading::kWidth, {0.1, 0.6}, true));
}

}  // namespace
}  // namespace trammel::pressure_advance
