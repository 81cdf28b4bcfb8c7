#include "pressure_advance/response/law_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "geometry/linear_systems.h"
#include "pressure_advance/response/lag_line_test_support.h"
#include "pressure_advance/response/law_line.h"

namespace trammel::pressure_advance {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;
using ::trammel::testing::LagLaw;
using ::trammel::testing::LagLine;
using ::trammel::testing::PrintLagLine;

LineCovariance::Terms Draw(Random& random, Index n, Index causes) {
  const auto any = [&](double lo, double hi, Index rows) {
    return VectorXd(VectorXd::NullaryExpr(rows, [&] { return random.Uniform(lo, hi); }));
  };
  LineCovariance::Terms terms{any(1e-4, 1e-2, n), any(0, 1e-2, n - 1), any(0, 0.05, n),
                              any(0, 0.99, n - 1), MatrixXd(n, causes)};
  for (Index k = 0; k < causes; ++k) terms.common.col(k) = any(-0.3, 0.3, n);
  return terms;
}

MatrixXd Dense(const LineCovariance::Terms& terms) {
  const Index n = terms.own.size();
  MatrixXd dense = terms.own.asDiagonal();
  for (Index i = 0; i + 1 < n; ++i) {
    dense(i, i) += terms.between(i);
    dense(i + 1, i + 1) += terms.between(i);
    dense(i, i + 1) -= terms.between(i);
    dense(i + 1, i) -= terms.between(i);
  }
  for (Index i = 0; i < n; ++i) {
    double together = 1;
    for (Index j = i; j < n; ++j) {
      const double both = terms.wander(i) * terms.wander(j) * together;
      dense(i, j) += both;
      if (j != i) dense(j, i) += both;
      if (j + 1 < n) together *= terms.correlation(j);
    }
  }
  return dense + terms.common * terms.common.transpose();
}

TEST(LineCovariance, SolvesAsTheWholeMatrixDoes) {
  Random random(11);
  for (const Index n : {Index{1}, Index{2}, Index{8}, Index{60}}) {
    for (const Index causes : {Index{1}, Index{3}}) {
      const LineCovariance::Terms terms = Draw(random, n, causes);
      const LineCovariance covariance(terms);
      const MatrixXd dense = Dense(terms);
      const MatrixXd columns = MatrixXd::NullaryExpr(n, 4, [&] { return random.Normal(); });
      const MatrixXd expected = geometry::SolveSymmetric(dense, columns);
      EXPECT_LT((covariance.Solve(columns) - expected).norm(), 1e-7 * expected.norm());
      const VectorXd diagonal = geometry::Inverse(dense).diagonal();
      EXPECT_LT((covariance.InverseDiagonal() - diagonal).norm(), 1e-7 * diagonal.norm());
      const double log_determinant =
          2 * geometry::CholeskyRoot(dense).diagonal().array().log().sum();
      EXPECT_NEAR(covariance.LogDeterminant(), log_determinant, 1e-6 * static_cast<double>(n));
    }
  }
}

LineMotion QuickLine() { return {{{0.16, 10}, {0.6, 150}, {0.24, 10}}, 25.0, 3000.0}; }

LineProfile EvenProfile(double pressure_advance_s) {
  LineProfile profile;
  profile.pressure_advance_s = pressure_advance_s;
  for (int i = 0; i < 40; ++i) {
    ProfileSample sample;
    sample.position = 1 + 0.6 * i;
    sample.area = {1, 0.03};
    profile.samples.push_back(sample);
  }
  return profile;
}

LawState AnyState() {
  LawState state;
  state.theta = PriorOfLaw().mean;
  state.theta(kLevel) = 1.1;
  state.theta(kTilt) = 0.05;
  state.theta(kDrift) = 0.2;
  state.theta(kSwell) = -0.05;
  state.theta(kPower) = 0.03;
  state.theta(kLagSeconds) = 0.03;
  state.theta(kSecondStage) = 0.2;
  return state;
}

TEST(LawLine, LeavesOutWhatIsNotSeenAndWhatStandsBesideABeadThatIsCutOff) {
  LineProfile profile = EvenProfile(0.02);
  profile.samples[10].gap = profile.samples[10].cut_off = true;
  profile.samples[20].area = {};
  const auto line = LawLineOf(profile, {3, 20}, 25);
  ASSERT_TRUE(line.has_value());
  for (const double at : line->position_mm) {
    EXPECT_GE(at, 3);
    EXPECT_LE(at, 20);
    for (const int left_out : {9, 10, 11, 20}) {
      EXPECT_NE(at, profile.samples[static_cast<std::size_t>(left_out)].position);
    }
  }
  EXPECT_NEAR(line->tilt(0), line->position_mm[0] / 25 - 0.5, 1e-12);
}

TEST(LawLine, IsNothingOfFewReadingsOrOfALineThatMustNotBeUsed) {
  EXPECT_FALSE(LawLineOf(EvenProfile(0.02), {3, 6}, 25).has_value());
  LineProfile unusable = EvenProfile(0.02);
  unusable.unusable = "torn off";
  EXPECT_FALSE(LawLineOf(unusable, {0, 25}, 25).has_value());
}

TEST(LawLine, ReadsAPowerOfTheArea) {
  EXPECT_DOUBLE_EQ(ReadArea(0.7, 0, 0), 0.7);
  EXPECT_DOUBLE_EQ(ReadArea(0, 0.1, 0.1), 0);
  for (const double area : {0.2, 0.6, 1.0, 1.4}) {
    EXPECT_NEAR(ReadArea(area, 0, -0.05), std::pow(area, 0.95), 1e-3);
  }
  EXPECT_DOUBLE_EQ(ReadArea(3, 0.1, 0), 3.2);
}

TEST(LawLine, HasTheGradientOfItsMean) {
  const HeadMotion head(QuickLine());
  const LagModel model(head, {});
  std::vector<LawLine> lines{*LawLineOf(EvenProfile(0.015), {1, 24}, 25)};
  lines[0].along = 0.3;
  const LawState state = AnyState();
  Linearise(model, state, lines);
  const LawLine at = lines[0];
  const VectorXd read = VectorXd::Ones(at.value.size()) - at.mean;
  const auto laid = LayAll(model.With(LagOf(state.theta)), state.theta, lines);
  EXPECT_LT((at.Off(state, laid[0]) - read).norm(), 1e-12);
  for (int k = 0; k < kUnknowns; ++k) {
    const double step = k == kLagSeconds ? 1e-4 : 5e-3;
    const auto mean = [&](double by) {
      LawState moved = state;
      moved.theta(k) += by;
      Linearise(model, moved, lines);
      return lines[0].mean;
    };
    const VectorXd slope = (mean(step) - mean(-step)) / (2 * step);
    EXPECT_LT((slope - at.gradient.col(k)).norm(), 0.08 * slope.norm() + 1e-3) << "unknown " << k;
  }
}

const LagLine kLine{};
const Interval kSpan_mm{4, 26};

struct World {
  LagLaw law;
  double level_mm2 = 0.08;
  double noise = 0.03;    // of readings, relative
  double scatter = 0.02;  // of a line's lag, relative
  double power = 1;       // of the area that is read
  double moved_mm = 0;    // lines alternately, to and fro
  double slip = 0;        // share of the flow that is lost at the fast speed
  int count = 10;
};

std::vector<LineProfile> Measure(const World& world, Random& random) {
  std::vector<LineProfile> profiles;
  LagLine printed = kLine;
  printed.flow_loss_when_fast = world.slip;
  for (int k = 0; k < world.count; ++k) {
    LineProfile profile;
    profile.pressure_advance_s = 0.06 * k / (world.count - 1);
    LagLaw law = world.law;
    const double lag = 1 + world.scatter * random.Normal();
    law.linear_s *= lag;
    law.power *= lag;
    const std::vector<double> areas = PrintLagLine(printed, law, profile.pressure_advance_s);
    for (std::size_t i = 0; i < areas.size(); i += 2) {
      ProfileSample sample;
      sample.position =
          kLine.step_mm * static_cast<double>(i) + (k % 2 == 0 ? world.moved_mm : -world.moved_mm);
      const double sigma = world.level_mm2 * world.noise;
      sample.area = {world.level_mm2 * std::pow(std::max(0.0, areas[i]), world.power) +
                         sigma * random.Normal(),
                     sigma};
      profile.samples.push_back(sample);
    }
    profiles.push_back(profile);
  }
  return profiles;
}

TEST(LawFit, LearnsALinearLagAndAThinningOne) {
  for (const double exponent : {1.0, 0.5}) {
    World world;
    world.law.linear_s = exponent == 1 ? 0.033 : 0;
    world.law.exponent = exponent;
    world.law.power =
        exponent == 1 ? 0 : 0.033 * 145 / (std::pow(150, exponent) - std::pow(5, exponent));
    Random random(21);
    const auto fit = FitLaw(Measure(world, random), MotionOf(kLine), 0.025, kSpan_mm);
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->pressure_advance_s, 0.033, 3 * fit->sigma_s);
    EXPECT_LT(fit->sigma_s, 0.0008);
    EXPECT_NEAR(fit->lag.exponent[2], exponent, 0.25);
    EXPECT_NEAR(fit->level, world.level_mm2, 0.03 * world.level_mm2);
    EXPECT_EQ(fit->lines, 10);
  }
}

TEST(LawFit, KnowsTheLagAtTheSlowAndAtTheFastSpeed) {
  for (const double exponent : {1.0, 0.5}) {
    World world;
    world.law.linear_s = exponent == 1 ? 0.033 : 0;
    world.law.exponent = exponent;
    world.law.power =
        exponent == 1 ? 0 : 0.033 * 145 / (std::pow(150, exponent) - std::pow(5, exponent));
    const double slow_s = exponent == 1 ? 0.033 : world.law.power * 0.5 / std::sqrt(5);
    const double fast_s = exponent == 1 ? 0.033 : world.law.power * 0.5 / std::sqrt(150);
    for (int seed = 40; seed < 46; ++seed) {
      Random random(static_cast<std::uint64_t>(seed));
      const auto fit = FitLaw(Measure(world, random), MotionOf(kLine), 0.03, kSpan_mm);
      ASSERT_TRUE(fit.has_value());
      EXPECT_NEAR(fit->slow_lag_s.value, slow_s, 3 * fit->slow_lag_s.sigma) << exponent;
      EXPECT_NEAR(fit->fast_lag_s.value, fast_s, 3 * fit->fast_lag_s.sigma) << exponent;
      // Enough to tell a law that thins from one that does not.
      EXPECT_LT(fit->slow_lag_s.sigma, 0.2 * slow_s);
      EXPECT_LT(fit->fast_lag_s.sigma, 0.05 * fast_s);
    }
  }
}

TEST(LawFit, KnowsHowMuchSlips) {
  World world;
  world.law.linear_s = 0.033;
  for (const double slip : {0.0, 0.04}) {
    world.slip = slip;
    Random random(47);
    const auto fit = FitLaw(Measure(world, random), MotionOf(kLine), 0.03, kSpan_mm);
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->slip.value, slip, 3 * fit->slip.sigma);
    EXPECT_LT(fit->slip.sigma, 0.01);
  }
}

// Expects the right value of a linear lag.
LawFit FitOfLinearLag(World world, std::uint64_t seed) {
  world.law.linear_s = 0.033;
  Random random(seed);
  const auto fit = FitLaw(Measure(world, random), MotionOf(kLine), 0.03, kSpan_mm);
  EXPECT_TRUE(fit.has_value());
  if (!fit) return {};
  EXPECT_NEAR(fit->pressure_advance_s, 0.033, 3 * fit->sigma_s);
  return *fit;
}

TEST(LawFit, TakesReadingsThatAreNoStraightImageOfTheArea) {
  EXPECT_NEAR(FitOfLinearLag({.power = 0.93}, 22).power, -0.07, 0.04);
}

TEST(LawFit, TakesLinesWhosePlaceIsNotKnownWell) { FitOfLinearLag({.moved_mm = 0.25}, 23); }

TEST(LawFit, LearnsHowFarAlongTheBedLinesAreReadBesideTheirPlace) {
  World world;
  world.law.linear_s = 0.033;
  world.moved_mm = 0.2;
  Random random(29);
  std::vector<LineProfile> profiles = Measure(world, random);
  const auto apart = FitLaw(profiles, MotionOf(kLine), 0.03, kSpan_mm);
  for (std::size_t k = 1; k < profiles.size(); k += 2) profiles[k].heading = -1;
  const auto fit = FitLaw(profiles, MotionOf(kLine), 0.03, kSpan_mm);
  ASSERT_TRUE(apart.has_value() && fit.has_value());
  EXPECT_NEAR(fit->place_mm, -world.moved_mm, 0.06);
  EXPECT_NEAR(apart->place_mm, 0, 0.12);
  EXPECT_NEAR(fit->pressure_advance_s, 0.033, 3 * fit->sigma_s);
  EXPECT_LT(fit->sigma_s, apart->sigma_s);
}

TEST(LawFit, SeesHowMuchLinesScatter) {
  const auto fit_of = [](double scatter) {
    World world;
    world.law.linear_s = 0.033;
    world.scatter = scatter;
    world.count = 20;
    Random random(24);
    return *FitLaw(Measure(world, random), MotionOf(kLine), 0.03, kSpan_mm);
  };
  const LawFit even = fit_of(0.03), wild = fit_of(0.12);
  EXPECT_GT(wild.sigma_s, 1.7 * even.sigma_s);
  // A scatter of twenty lines is known to a sixth.
  EXPECT_NEAR(wild.lag_scatter_s / (0.12 * 0.033), 1, 0.35);
  EXPECT_NEAR(even.lag_scatter_s / (0.03 * 0.033), 1, 0.35);
}

// A wave of 15 % along all lines is of no law of the lag.
TEST(LawFit, SeesThatNeighbouringLinesDifferFromTheLawInTheSameWay) {
  World world;
  world.law.linear_s = 0.033;
  for (const double wave : {0.0, 0.15}) {
    Random random(30);
    std::vector<LineProfile> profiles = Measure(world, random);
    for (LineProfile& profile : profiles) {
      for (ProfileSample& sample : profile.samples) {
        sample.area.value *= 1 + wave * std::sin(2.5 * sample.position);
      }
    }
    const auto fit = FitLaw(profiles, MotionOf(kLine), 0.03, kSpan_mm);
    ASSERT_TRUE(fit.has_value());
    if (wave == 0) {
      EXPECT_NEAR(fit->shared_misfit, 0, 0.2);
    } else {
      EXPECT_GT(fit->shared_misfit, 0.5);
    }
  }
}

TEST(LawFit, LetsAReadingThatDoesNotFitItsNeighboursCountLess) {
  World world;
  world.law.linear_s = 0.033;
  Random random(25);
  std::vector<LineProfile> profiles = Measure(world, random);
  const auto clean = FitLaw(profiles, MotionOf(kLine), 0.03, kSpan_mm);
  for (LineProfile& profile : profiles) profile.samples[30].area.value *= 3;
  const auto spoilt = FitLaw(profiles, MotionOf(kLine), 0.03, kSpan_mm);
  ASSERT_TRUE(clean.has_value() && spoilt.has_value());
  EXPECT_NEAR(spoilt->pressure_advance_s, clean->pressure_advance_s, 0.0005);
}

TEST(LawFit, IsNothingOfFewLinesOrOfOneValue) {
  World world;
  Random random(26);
  std::vector<LineProfile> profiles = Measure(world, random);
  std::vector<LineProfile> few(profiles.begin(), profiles.begin() + 3);
  EXPECT_FALSE(FitLaw(few, MotionOf(kLine), 0.03, kSpan_mm).has_value());
  for (LineProfile& profile : profiles) profile.pressure_advance_s = 0.02;
  EXPECT_FALSE(FitLaw(profiles, MotionOf(kLine), 0.03, kSpan_mm).has_value());
}

TEST(LawFit, IsNothingOrFiniteWhateverIsRead) {
  for (const double wild : {1e300, -1e300, 1e-300, 1e12, 0.0}) {
    World world;
    world.law.linear_s = 0.033;
    Random random(28);
    std::vector<LineProfile> profiles = Measure(world, random);
    for (std::size_t k = 0; k < profiles.size(); k += 2) {
      for (std::size_t i = k; i < profiles[k].samples.size(); i += 5) {
        profiles[k].samples[i].area.value = wild;
        profiles[k].samples[i].area.sigma = std::abs(wild) * 1e-3 + 1e-300;
      }
    }
    const auto fit = FitLaw(profiles, MotionOf(kLine), 0.03, kSpan_mm);
    if (!fit) continue;
    EXPECT_TRUE(std::isfinite(fit->pressure_advance_s)) << wild;
    EXPECT_TRUE(std::isfinite(fit->sigma_s)) << wild;
    EXPECT_TRUE(std::isfinite(fit->lag_scatter_s)) << wild;
  }
}

TEST(LawFit, LaysTheLinesThatItLearnt) {
  World world;
  world.law.linear_s = 0.033;
  world.moved_mm = 0.2;
  Random random(27);
  std::vector<LineProfile> seen = Measure(world, random);
  for (std::size_t k = 1; k < seen.size(); k += 2) seen[k].heading = -1;
  const auto fit = FitLaw(seen, MotionOf(kLine), 0.03, kSpan_mm);
  ASSERT_TRUE(fit.has_value());
  const std::vector<LineProfile> laid = LayLines(*fit, seen, MotionOf(kLine));
  double off = 0;
  int count = 0;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    for (std::size_t i = 0; i < seen[k].samples.size(); ++i) {
      const double at = seen[k].samples[i].position;
      if (at < kSpan_mm.lo || at > kSpan_mm.hi) continue;
      off += std::pow(
          (laid[k].samples[i].area.value - seen[k].samples[i].area.value) / world.level_mm2, 2);
      ++count;
    }
  }
  // What the law leaves over is the noise, and some edges.
  EXPECT_LT(std::sqrt(off / count), 2 * world.noise);
}

}  // namespace
}  // namespace trammel::pressure_advance
