#include "pressure_advance/response/response.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "pressure_advance/response/lag_line_test_support.h"
#include "support/lag_line.h"

namespace trammel::pressure_advance {
namespace {

using testing::LagLine;
using testing::LagModelTruth;

struct World {
  LagLine line;
  LagModelTruth law;
  double lag_scatter = 0;   // between lines, relative
  double flow_scatter = 0;  // between lines, relative
  double noise = 0;         // per reading, relative
  std::vector<double> pa;
};

std::vector<double> Range(double lo, double hi, int count) {
  std::vector<double> values(count);
  for (int i = 0; i < count; ++i) values[i] = lo + (hi - lo) * i / (count - 1);
  return values;
}

std::vector<LineProfile> Measure(const World& world, Random& random) {
  std::vector<LineProfile> profiles;
  for (const double pa : world.pa) {
    LagModelTruth law = world.law;
    const double lag = 1 + world.lag_scatter * random.Normal();
    law.linear_s *= lag;
    law.power *= lag;
    const double flow = 1 + world.flow_scatter * random.Normal();
    profiles.push_back(ReadLagLine(world.line, law, pa, world.noise, random, flow));
  }
  return profiles;
}

World PaperWorld(double lag_s) {
  World world;
  world.law.linear_s = lag_s;
  world.pa = Range(0, 0.06, 10);
  return world;
}

// Positions as fractions and widths instead of areas: what a photo gives.
std::vector<LineProfile> AsPhoto(std::vector<LineProfile> profiles, double length_mm) {
  for (LineProfile& profile : profiles) {
    profile.position_unit = PositionUnit::kLineLength;
    profile.cross_section_unit = CrossSectionUnit::kPixel;
    for (ProfileSample& sample : profile.samples) {
      sample.position /= length_mm;
      sample.width = {sample.area.value * 200 + 3, sample.area.sigma * 200};
      sample.area = {};
    }
  }
  return profiles;
}

TEST(Response, FindsALinearLagWithin400MicrosecondsOnNoiseFreeLines) {
  // The smoothing of the firmware and the finite windows move each crossing by up to 0.2 ms, and
  // slip and tail are estimated from them; gaps bend the deceleration within one step of the tested
  // values.
  constexpr double kAcceleration_s = 0.0003;
  constexpr double kBound_s = 0.0004;
  for (const double lag_s : {0.017, 0.0302, 0.0441}) {
    Random random(1);
    const World world = PaperWorld(lag_s);
    const Analysis fit = FitResponse(Measure(world, random), MotionOf(world.line));
    ASSERT_TRUE(fit.response.pressure_advance.good()) << fit.response.pressure_advance.reason();
    EXPECT_NEAR(fit.response.pressure_advance.quantity().value, lag_s, kBound_s);
    EXPECT_NEAR(fit.response.acceleration.pressure_advance.quantity().value, lag_s,
                kAcceleration_s);
  }
}

TEST(Response, FindsTheSecantOfOtherLagLawsWithin1Millisecond) {
  for (const double exponent : {0.3, 0.5, 0.8}) {
    for (const bool lost : {false, true}) {
      World world = PaperWorld(0.005);
      world.law.exponent = exponent;
      world.law.power = 0.03 * 145 / (std::pow(150, exponent) - std::pow(5, exponent));
      world.line.negative_flow_is_lost = lost;
      Random random(2);
      const Analysis fit = FitResponse(Measure(world, random), MotionOf(world.line));
      ASSERT_TRUE(fit.response.pressure_advance.good()) << fit.response.pressure_advance.reason();
      EXPECT_NEAR(fit.response.pressure_advance.quantity().value, world.law.Secant(5, 150), 0.001)
          << "exponent " << exponent << ", lost " << lost;
    }
  }
}

TEST(Response, CoversTheTruthUnderScatterAndNoise) {
  // 300 worlds: a 95 % interval must hold the truth in at least 91 % (3.2 standard errors below 95
  // %).
  constexpr int kWorlds = 300;
  int good = 0, covered = 0, close = 0;
  std::vector<double> pull;
  for (int seed = 0; seed < kWorlds; ++seed) {
    Random random(500 + seed);
    World world = PaperWorld(random.Uniform(0.015, 0.045));
    world.lag_scatter = 0.05;
    world.flow_scatter = 0.02;
    world.noise = 0.04;
    world.line.negative_flow_is_lost = seed % 2 == 0;
    world.line.flow_loss_when_fast = 0.01 * random.Uniform();
    const Analysis fit = FitResponse(Measure(world, random), MotionOf(world.line));
    if (!fit.response.pressure_advance.good()) continue;
    ++good;
    const Quantity& q = fit.response.pressure_advance.quantity();
    covered += q.interval95.lo <= world.law.linear_s && world.law.linear_s <= q.interval95.hi;
    close += std::abs(q.value - world.law.linear_s) <= 0.002;
    pull.push_back((q.value - world.law.linear_s) / q.standard_uncertainty);
  }
  EXPECT_GE(good, 0.98 * kWorlds);
  EXPECT_GE(covered, 0.91 * good);
  EXPECT_GE(close, 0.95 * good);
  EXPECT_GT(StandardDeviation(pull), 0.6) << "the stated uncertainty is far too large";
  RecordProperty("good", good);
  RecordProperty("covered", covered);
  RecordProperty("close", close);
}

TEST(Response, OneBadLineMovesTheAnswerByLessThan1Millisecond) {
  Random random(7);
  World world = PaperWorld(0.031);
  world.lag_scatter = 0.02;
  const std::vector<LineProfile> clean = Measure(world, random);
  const double answer =
      FitResponse(clean, MotionOf(world.line)).response.pressure_advance.quantity().value;
  for (std::size_t bad = 0; bad < clean.size(); ++bad) {
    std::vector<LineProfile> profiles = clean;
    for (ProfileSample& sample : profiles[bad].samples) {
      if (sample.position > 10 && sample.position < 14) sample.area.value *= 3;  // a blob
    }
    const Analysis fit = FitResponse(profiles, MotionOf(world.line));
    ASSERT_TRUE(fit.response.pressure_advance.good()) << fit.response.pressure_advance.reason();
    EXPECT_NEAR(fit.response.pressure_advance.quantity().value, answer, 0.001) << "line " << bad;
  }
}

TEST(Response, PoisonInUnseenSamplesChangesNothing) {
  Random random(8);
  const World world = PaperWorld(0.031);
  std::vector<LineProfile> profiles = Measure(world, random);
  for (LineProfile& profile : profiles) profile.samples[40].area.sigma = 0;
  const double answer =
      FitResponse(profiles, MotionOf(world.line)).response.pressure_advance.quantity().value;
  for (LineProfile& profile : profiles) profile.samples[40].area.value = 1e30;
  EXPECT_EQ(FitResponse(profiles, MotionOf(world.line)).response.pressure_advance.quantity().value,
            answer);
}

TEST(Response, FollowsTheLabels) {
  Random random(9);
  World world = PaperWorld(0.031);
  world.lag_scatter = 0.05;
  const std::vector<LineProfile> photo = AsPhoto(Measure(world, random), world.line.length_mm);
  LineMotion motion = MotionOf(world.line);
  motion.length_mm.reset();
  motion.acceleration_mm_s2.reset();
  const Quantity plain = FitResponse(photo, motion).response.pressure_advance.quantity();
  EXPECT_NEAR(plain.value, 0.031, 0.0025);
  std::vector<LineProfile> moved = photo;
  for (LineProfile& profile : moved) {
    profile.pressure_advance_s = 2 * profile.pressure_advance_s + 0.01;
  }
  const Quantity other = FitResponse(moved, motion).response.pressure_advance.quantity();
  EXPECT_NEAR(other.value, 2 * plain.value + 0.01, 1e-6);
  EXPECT_NEAR(other.standard_uncertainty, 2 * plain.standard_uncertainty,
              0.1 * other.standard_uncertainty);
}

TEST(Response, SaysWhyItCannotTell) {
  Random random(10);
  const World world = PaperWorld(0.031);
  const LineMotion motion = MotionOf(world.line);

  World low = world;
  low.pa = Range(0, 0.02, 10);
  const Measured outside = FitResponse(Measure(low, random), motion).response.pressure_advance;
  EXPECT_EQ(outside.verdict(), Verdict::kCannotTell);
  EXPECT_NE(outside.reason().find("above the tested range"), std::string::npos) << outside.reason();

  std::vector<LineProfile> reversed = Measure(world, random);
  for (std::size_t i = 0; i < reversed.size(); ++i)
    reversed[i].pressure_advance_s = world.pa[9 - i];
  const Measured wrong = FitResponse(reversed, motion).response.pressure_advance;
  EXPECT_EQ(wrong.verdict(), Verdict::kCannotTell);
  EXPECT_NE(wrong.reason().find("wrong way round"), std::string::npos) << wrong.reason();

  World same = world;
  same.noise = 0.05;
  same.pa.assign(10, 0.031);
  std::vector<LineProfile> flat = Measure(same, random);
  for (std::size_t i = 0; i < flat.size(); ++i) flat[i].pressure_advance_s = world.pa[i];
  const Measured deaf = FitResponse(flat, motion).response.pressure_advance;
  EXPECT_EQ(deaf.verdict(), Verdict::kCannotTell);
  EXPECT_NE(deaf.reason().find("do not answer"), std::string::npos) << deaf.reason();

  std::vector<LineProfile> shuffled = Measure(world, random);
  const std::vector<int> order = {4, 9, 1, 7, 0, 3, 8, 2, 6, 5};
  for (std::size_t i = 0; i < 10; ++i) shuffled[i].pressure_advance_s = world.pa[order[i]];
  EXPECT_EQ(FitResponse(shuffled, motion).response.pressure_advance.verdict(),
            Verdict::kCannotTell);
}

// OrcaSlicer's line: 20 mm, 40 mm, 20 mm. High values leave a gap to the line's end, where the line
// is compared with itself.
World OrcaWorld(double lag_s, double longest_s) {
  World world;
  world.line.length_mm = 80;
  world.line.slow_mm_s = 10;
  world.line.fast_mm_s = 60;
  world.line.acceleration_mm_s2 = 5000;
  world.law.linear_s = lag_s;
  world.flow_scatter = 0.01;
  world.noise = 0.01;
  world.pa = Range(0, longest_s, 21);
  return world;
}

Analysis AnalysePhoto(const World& world, Random& random) {
  return FitResponse(AsPhoto(Measure(world, random), world.line.length_mm), MotionOf(world.line));
}

TEST(Response, FindsALagWhereHalfOfTheLinesAreEmptyToTheirEnd) {
  constexpr double kPart = 0.05;  // of the lag
  for (const auto& [lag_s, longest_s] : {std::pair{0.1, 0.5}, {0.22, 1.0}, {0.3, 1.0}}) {
    Random random(3);
    const Analysis fit = AnalysePhoto(OrcaWorld(lag_s, longest_s), random);
    ASSERT_TRUE(fit.response.pressure_advance.good())
        << lag_s << " " << fit.response.pressure_advance.reason();
    EXPECT_NEAR(fit.response.pressure_advance.quantity().value, lag_s, kPart * lag_s);
    EXPECT_LE(fit.response.pressure_advance.quantity().interval95.lo, lag_s);
    EXPECT_GE(fit.response.pressure_advance.quantity().interval95.hi, lag_s);
  }
}

TEST(Response, RefusesALagThatTheFastSegmentIsTooShortFor) {
  Random random(3);
  for (const double lag_s : {0.5, 0.7}) {
    const Analysis fit = AnalysePhoto(OrcaWorld(lag_s, 1), random);
    ASSERT_FALSE(fit.response.pressure_advance.good())
        << fit.response.pressure_advance.quantity().value;
    EXPECT_NE(fit.response.pressure_advance.reason().find("with a fast speed of at most"),
              std::string::npos)
        << fit.response.pressure_advance.reason();
  }
}

// A glare over the ends of the lines with high values, which look thinner there.
TEST(Response, RefusesLinesWhoseEndsAreReadUnevenly) {
  ResponseOptions options;
  options.widest_interval = 1;
  for (const double share : {0.0, 0.36}) {
    Random random(3);
    const World world = OrcaWorld(0.05, 0.1);
    auto profiles = AsPhoto(Measure(world, random), world.line.length_mm);
    for (LineProfile& profile : profiles) {
      for (ProfileSample& sample : profile.samples) {
        const double into = std::clamp((sample.position - 0.3) / 0.6, 0.0, 1.0);
        sample.width.value *= 1 - share * into * profile.pressure_advance_s / 0.1;
      }
    }
    const Analysis fit = FitResponse(profiles, MotionOf(world.line), options);
    EXPECT_EQ(fit.response.pressure_advance.good(), share == 0);
    if (share > 0) {
      EXPECT_NE(fit.response.pressure_advance.reason().find("ends grow thinner by"),
                std::string::npos)
          << fit.response.pressure_advance.reason();
    }
  }
}

TEST(Response, OneTransitionTheWrongWayRoundContradictsTheOther) {
  Random random(14);
  const World world = PaperWorld(0.031);
  std::vector<LineProfile> profiles = Measure(world, random);
  for (LineProfile& profile : profiles) {
    for (ProfileSample& sample : profile.samples) {
      if (sample.position > 19 && sample.position < 24) {
        sample.area.value = std::max(0.0, 0.22 - sample.area.value);  // surplus becomes lack
      }
    }
  }
  const Measured measured = FitResponse(profiles, MotionOf(world.line)).response.pressure_advance;
  EXPECT_EQ(measured.verdict(), Verdict::kCannotTell);
  EXPECT_NE(measured.reason().find("wrong way round"), std::string::npos) << measured.reason();
}

TEST(Response, SaysWhichStretchesAScanDidNotCover) {
  Random random(13);
  const World world = PaperWorld(0.031);
  std::vector<LineProfile> profiles = Measure(world, random);
  for (LineProfile& profile : profiles) {
    std::erase_if(profile.samples, [](const ProfileSample& sample) {
      return sample.position < 8 || sample.position > 22;
    });
  }
  const Measured measured = FitResponse(profiles, MotionOf(world.line)).response.pressure_advance;
  EXPECT_EQ(measured.verdict(), Verdict::kRefused);
  EXPECT_NE(measured.reason().find("scan more of the line"), std::string::npos)
      << measured.reason();
}

TEST(Response, RefusesTooFewLinesAndOtherSegments) {
  Random random(11);
  World world = PaperWorld(0.031);
  world.pa = {0, 0.06};
  const Measured two =
      FitResponse(Measure(world, random), MotionOf(world.line)).response.pressure_advance;
  EXPECT_EQ(two.verdict(), Verdict::kRefused);
  EXPECT_NE(two.reason().find("at least 4"), std::string::npos) << two.reason();
  world.pa = Range(0, 0.06, 10);
  LineMotion motion = MotionOf(world.line);
  motion.segments = {{0.5, 100}, {0.5, 5}};
  EXPECT_EQ(FitResponse(Measure(world, random), motion).response.pressure_advance.verdict(),
            Verdict::kRefused);
  EXPECT_EQ(FitResponse({}, motion).response.pressure_advance.verdict(), Verdict::kRefused);
}

// The paper's lines of one pattern, by an extruder of this lag.
void Print(int pattern, double lag_s, Random& random, std::vector<LineProfile>& profiles) {
  for (int line = 0; line < 10; ++line) {
    const LagModelTruth law{.linear_s = lag_s + 0.001 * random.Normal()};
    profiles.push_back(ReadLagLine({}, law, 0.06 * line / 9, 0.02, random));
    profiles.back().pattern = pattern;
  }
}

TEST(Analyse, SaysWhatEachOfSeveralPatternsSaysAlone) {
  Random random(11);
  std::vector<LineProfile> profiles;
  for (const int pattern : {0, 1, 2}) Print(pattern, 0.03, random, profiles);
  const Analysis analysis = Analyse(profiles, MotionOf({}), {});
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
  const Analysis analysis = Analyse(profiles, MotionOf({}), {});
  ASSERT_TRUE(analysis.repeats.has_value());
  EXPECT_TRUE(analysis.repeats->disagree);
  EXPECT_TRUE(std::ranges::any_of(analysis.notices, [](const std::string& notice) {
    return notice.find("the patterns differ") != std::string::npos;
  }));
}

}  // namespace
}  // namespace trammel::pressure_advance
