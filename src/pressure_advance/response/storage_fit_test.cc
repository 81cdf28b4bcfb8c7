#include "pressure_advance/response/storage_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "geometry/linear_systems.h"
#include "pressure_advance/response/lag_line_test_support.h"
#include "pressure_advance/response/storage_line.h"

namespace trammel::pressure_advance {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;
using ::trammel::testing::LagLine;
using ::trammel::testing::LagModelTruth;
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

StorageState AnyState() {
  StorageState state;
  state.theta = StoragePriorOf().mean;
  state.theta(kLevel) = 1.1;
  state.theta(kTilt) = 0.05;
  state.theta(kDrift) = 0.2;
  state.theta(kSwell) = -0.05;
  state.theta(kPower) = 0.03;
  state.theta(kLagSeconds) = 0.03;
  state.theta(kSecondStage) = 0.2;
  return state;
}

TEST(StorageLine, HasTheGradientOfItsMean) {
  const HeadMotion head(LineMotion{{{0.16, 10}, {0.6, 150}, {0.24, 10}}, 25.0, 3000.0});
  const LagModel model(head, {});
  LineProfile even;
  even.pressure_advance_s = 0.015;
  for (int i = 0; i < 40; ++i) {
    even.samples.push_back({.position = 1 + 0.6 * i, .width = {}, .height = {}, .area = {1, 0.03}});
  }
  std::vector<StorageLine> lines{*StorageLineOf(even, {1, 24}, 25)};
  lines[0].along = 0.3;
  const StorageState state = AnyState();
  Linearise(model, state, lines);
  const StorageLine at = lines[0];
  const VectorXd read = VectorXd::Ones(at.value.size()) - at.mean;
  const auto laid = LayAll(model.With(LagOf(state.theta)), state.theta, lines);
  EXPECT_LT((at.Off(state, laid[0]) - read).norm(), 1e-12);
  for (int k = 0; k < kUnknowns; ++k) {
    const double step = k == kLagSeconds ? 1e-4 : 5e-3;
    const auto mean = [&](double by) {
      StorageState moved = state;
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
  LagModelTruth law;
  double level_mm2 = 0.08;
  double noise = 0.03;    // per reading, relative
  double scatter = 0.02;  // of line lags, relative
  double power = 1;       // exponent of the area as read
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
    LagModelTruth law = world.law;
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

LagModelTruth LawOf(double exponent) {
  if (exponent == 1) return {.linear_s = 0.033};
  const double power = 0.033 * 145 / (std::pow(150, exponent) - std::pow(5, exponent));
  return {.linear_s = 0, .power = power, .exponent = exponent};
}

TEST(StorageFit, LearnsValueLagsAndSlipAlsoOfReadingsThatAreBentOrBesideTheirPlace) {
  struct Row {
    double exponent;
    World world;
    std::uint64_t seed;
  };
  for (const Row& row :
       {Row{1, {}, 21}, Row{0.5, {}, 21}, Row{1, {}, 40}, Row{0.5, {}, 41},
        Row{1, {.power = 0.93}, 22}, Row{1, {.moved_mm = 0.25}, 23}, Row{1, {.slip = 0.04}, 47}}) {
    SCOPED_TRACE(row.seed);
    World world = row.world;
    world.law = LawOf(row.exponent);
    Random random(row.seed);
    const auto fit = FitStorage(Measure(world, random), MotionOf(kLine), 0.03, kSpan_mm);
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->slip.value, world.slip, 3 * fit->slip.sigma);
    EXPECT_LT(fit->slip.sigma, 0.01);
    if (world.slip > 0) continue;
    EXPECT_NEAR(fit->pressure_advance_s, 0.033, 3 * fit->sigma_s);
    EXPECT_LT(fit->sigma_s, 0.0008);
    if (world.moved_mm == 0) EXPECT_NEAR(fit->power, world.power - 1, 0.04);
    const auto lag_s = [&](double flow) {
      return world.law.linear_s + world.law.power * row.exponent * std::pow(flow, row.exponent - 1);
    };
    EXPECT_NEAR(fit->slow_lag_s.value, lag_s(5), 3 * fit->slow_lag_s.sigma);
    EXPECT_NEAR(fit->fast_lag_s.value, lag_s(150), 3 * fit->fast_lag_s.sigma);
    // Enough to tell a law that thins from one that does not.
    EXPECT_LT(fit->slow_lag_s.sigma, 0.2 * lag_s(5));
    EXPECT_LT(fit->fast_lag_s.sigma, 0.05 * lag_s(150));
  }
}

TEST(StorageFit, LearnsHowFarAlongTheBedLinesAreReadBesideTheirPlace) {
  World world;
  world.law.linear_s = 0.033;
  world.moved_mm = 0.2;
  Random random(29);
  std::vector<LineProfile> profiles = Measure(world, random);
  const auto apart = FitStorage(profiles, MotionOf(kLine), 0.03, kSpan_mm);
  for (std::size_t k = 1; k < profiles.size(); k += 2) profiles[k].heading = -1;
  const auto fit = FitStorage(profiles, MotionOf(kLine), 0.03, kSpan_mm);
  ASSERT_TRUE(apart.has_value() && fit.has_value());
  EXPECT_NEAR(fit->place_mm, -world.moved_mm, 0.06);
  EXPECT_NEAR(apart->place_mm, 0, 0.12);
  EXPECT_NEAR(fit->pressure_advance_s, 0.033, 3 * fit->sigma_s);
  EXPECT_LT(fit->sigma_s, apart->sigma_s);
}

TEST(StorageFit, SeesHowMuchLinesScatter) {
  const auto fit_of = [](double scatter) {
    World world;
    world.law.linear_s = 0.033;
    world.scatter = scatter;
    world.count = 20;
    Random random(24);
    return *FitStorage(Measure(world, random), MotionOf(kLine), 0.03, kSpan_mm);
  };
  const StorageFit even = fit_of(0.03), wild = fit_of(0.12);
  EXPECT_GT(wild.sigma_s, 1.7 * even.sigma_s);
  // A scatter of twenty lines is known to a sixth.
  EXPECT_NEAR(wild.lag_scatter_s / (0.12 * 0.033), 1, 0.35);
  EXPECT_NEAR(even.lag_scatter_s / (0.03 * 0.033), 1, 0.35);
}

// A wave of 15 % along all lines is of no law of the lag.
TEST(StorageFit, SeesThatNeighbouringLinesDifferFromTheLawInTheSameWay) {
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
    const auto fit = FitStorage(profiles, MotionOf(kLine), 0.03, kSpan_mm);
    ASSERT_TRUE(fit.has_value());
    if (wave == 0) {
      EXPECT_NEAR(fit->shared_misfit, 0, 0.2);
    } else {
      EXPECT_GT(fit->shared_misfit, 0.5);
    }
  }
}

TEST(StorageFit, IsNothingOfFewLinesOrOfOneValueAndFiniteWhateverIsRead) {
  World world;
  world.law.linear_s = 0.033;
  Random random(26);
  const std::vector<LineProfile> profiles = Measure(world, random);
  EXPECT_FALSE(
      FitStorage({profiles.begin(), profiles.begin() + 3}, MotionOf(kLine), 0.03, kSpan_mm));
  std::vector<LineProfile> same = profiles;
  for (LineProfile& profile : same) profile.pressure_advance_s = 0.02;
  EXPECT_FALSE(FitStorage(same, MotionOf(kLine), 0.03, kSpan_mm));
  const auto clean = FitStorage(profiles, MotionOf(kLine), 0.03, kSpan_mm);
  ASSERT_TRUE(clean.has_value());
  for (const double wild : {1e300, -1e300, 1e-300, 1e12, 0.0, 3 * world.level_mm2}) {
    std::vector<LineProfile> spoilt = profiles;
    for (LineProfile& profile : spoilt) profile.samples[30].area.value = wild;
    const auto fit = FitStorage(spoilt, MotionOf(kLine), 0.03, kSpan_mm);
    if (!fit) continue;
    EXPECT_TRUE(std::isfinite(fit->pressure_advance_s + fit->sigma_s + fit->lag_scatter_s)) << wild;
    if (wild == 3 * world.level_mm2) {  // a reading that does not fit its neighbours counts less
      EXPECT_NEAR(fit->pressure_advance_s, clean->pressure_advance_s, 0.0005);
    }
  }
}

TEST(StorageFit, LaysTheLinesThatItLearnt) {
  World world;
  world.law.linear_s = 0.033;
  world.moved_mm = 0.2;
  Random random(27);
  std::vector<LineProfile> seen = Measure(world, random);
  for (std::size_t k = 1; k < seen.size(); k += 2) seen[k].heading = -1;
  const auto fit = FitStorage(seen, MotionOf(kLine), 0.03, kSpan_mm);
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
  // The storage model's residuals are the noise, and some edges.
  EXPECT_LT(std::sqrt(off / count), 2 * world.noise);
}

}  // namespace
}  // namespace trammel::pressure_advance
