#include "pressure_advance/response/lag_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "pressure_advance/response/lag_line_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::trammel::testing::LagLine;
using ::trammel::testing::LagModelTruth;
using ::trammel::testing::PrintLagLine;

LineMotion QuickLine() { return {{{0.16, 10}, {0.6, 150}, {0.24, 10}}, 25.0, 3000.0}; }

// The head's speed at a place, and steps of time through a line: nothing of it in closed form.
double SpeedAt(const LineMotion& motion, double s) {
  const double rise = motion.segments[0].fraction * *motion.length_mm;
  const double fall = rise + motion.segments[1].fraction * *motion.length_mm;
  if (s <= rise) return motion.segments[0].speed_mm_s;
  if (s >= fall) return motion.segments[2].speed_mm_s;
  const auto from = [&](double v, double way) {
    return std::sqrt(v * v + 2 * *motion.acceleration_mm_s2 * way);
  };
  return std::min({motion.segments[1].speed_mm_s, from(motion.segments[0].speed_mm_s, s - rise),
                   from(motion.segments[2].speed_mm_s, fall - s)});
}

struct Stepped {
  static constexpr double kStep_s = 2e-6;
  double begin_s;
  std::vector<double> position_mm;

  Stepped(const LineMotion& motion, double begin, double end_s) : begin_s(begin) {
    double s =
        motion.segments[0].fraction * *motion.length_mm + begin * motion.segments[0].speed_mm_s;
    for (double t = begin; t < end_s; t += kStep_s) {
      position_mm.push_back(s);
      s += SpeedAt(motion, s + SpeedAt(motion, s) * kStep_s / 2) * kStep_s;
    }
  }
  [[nodiscard]] double At(double time_s) const {
    return position_mm.at(static_cast<std::size_t>(std::lround((time_s - begin_s) / kStep_s)));
  }
};

TEST(HeadMotion, MovesAsTheHeadDoes) {
  for (const LineMotion& motion :
       {QuickLine(), LineMotion{{{0.25, 20}, {0.5, 100}, {0.25, 20}}, 60.0, 1500.0},
        // Too short for its speed; slower behind it than before.
        LineMotion{{{0.25, 20}, {0.5, 300}, {0.25, 5}}, 30.0, 1000.0}}) {
    const HeadMotion head(motion);
    const Stepped stepped(motion, -0.2, head.times_s().back() + 0.01);
    for (std::size_t i = 0; i < head.times_s().size(); ++i) {
      EXPECT_NEAR(head.positions_mm()[i], stepped.At(head.times_s()[i]), 0.003) << i;
    }
    EXPECT_GT(head.positions_mm().back(), *motion.length_mm);
  }
}

TEST(HeadMotion, TakesFewCellsHoweverSlowTheHeadIs) {
  const LineMotion creeping{{{0.25, 0.001}, {0.5, 0.1}, {0.25, 0.001}}, 100.0, 1.0};
  const HeadMotion head(creeping);
  EXPECT_LT(head.times_s().size(), 1500U);
  EXPECT_GT(head.times_s().back(), 25000);
}

TEST(HeadMotion, AveragesByATriangle) {
  constexpr double kWidth_s = 0.04;
  const HeadMotion head(QuickLine());
  const HeadMotion::Drive drive = head.Averaged(kWidth_s);
  const Stepped stepped(QuickLine(), -0.2, head.times_s().back() + 0.1);
  for (std::size_t i = 0; i < head.times_s().size(); i += 7) {
    double sum = 0, weights = 0;
    for (double dt = -kWidth_s / 2; dt <= kWidth_s / 2; dt += 2e-5) {
      const double weight = kWidth_s / 2 - std::abs(dt);
      sum += weight * stepped.At(head.times_s()[i] + dt);
      weights += weight;
    }
    EXPECT_NEAR(drive.position_mm[i], sum / weights, 0.003) << head.times_s()[i];
  }
  // Far from any change of speed nothing is to be averaged.
  EXPECT_NEAR(drive.speed_mm_s.front(), 10, 1e-6);
  EXPECT_NEAR(drive.position_mm.back(), head.positions_mm().back(), 1e-6);
}

std::vector<double> LayOne(const LagModel& model, double lag_s, double pressure_advance_s,
                           const std::vector<double>& places) {
  const LagModel::Line line{lag_s, pressure_advance_s, places};
  return model.Lay({&line, 1}).front();
}

std::vector<double> Places(double from_mm, double to_mm, double step_mm) {
  std::vector<double> places;
  for (double s = from_mm; s < to_mm; s += step_mm) places.push_back(s);
  return places;
}

TEST(StoredModel, IsAPowerWhereAllExponentsAreOne) {
  const HeadMotion head(MotionOf({}));
  const double slow = head.slow_mm_s(), fast = head.fast_mm_s();
  for (const double n : {0.3, 0.6, 1.0, 1.3}) {
    const StoredModel law(head, {n, n, n, n});
    const double unit = (fast - slow) / (std::pow(fast, n) - std::pow(slow, n));
    for (const double flow : {slow / 3, slow, 0.2 * fast, 0.5 * fast, fast, 1.8 * fast}) {
      const double stored = unit * std::pow(flow, n);
      EXPECT_NEAR(law.Stored(flow), stored, 1e-9 * stored);
      const StoredModel::Flow seen = law.At(stored);
      EXPECT_NEAR(seen.mm_s, flow, 1e-3 * fast) << n;
      if (flow > 0.1 * fast) {
        EXPECT_NEAR(seen.per_s * n * stored / flow, 1, 0.01) << n;
      }
    }
  }
}

TEST(StoredModel, HasNoJumpWhereItsExponentChanges) {
  const HeadMotion head(MotionOf({}));
  const StoredModel law(head, {0.4, 1.2, 0.6, 0.9});
  for (const double part : kStorageBreaks) {
    const double at = part * head.fast_mm_s();
    EXPECT_NEAR(law.Stored(at * (1 - 1e-9)), law.Stored(at * (1 + 1e-9)), 1e-5);
    // Nor has its slope, the lag at a flow.
    const auto lag_s = [&](double a, double b) {
      return (law.Stored(b) - law.Stored(a)) / (b - a);
    };
    EXPECT_NEAR(lag_s(at * 0.999, at) / lag_s(at, at * 1.001), 1, 0.01);
    EXPECT_NEAR(lag_s(at * 0.999, at * 1.001) / law.LagAt(at), 1, 0.01);
  }
}

TEST(LagModel, LaysTheLinesOfAnotherModel) {
  LagLine line;
  const HeadMotion head(MotionOf(line));
  for (const double exponent : {1.0, 0.5}) {
    const double fast = line.fast_mm_s, slow = line.slow_mm_s;
    LagModelTruth law;
    law.linear_s = exponent == 1 ? 0.035 : 0;
    law.power = exponent == 1
                    ? 0
                    : 0.035 * (fast - slow) / (std::pow(fast, exponent) - std::pow(slow, exponent));
    law.exponent = exponent;
    Lag lag;
    lag.exponent.fill(exponent);
    lag.smooth_s = 0.04;
    lag.smear_mm = 0.4;
    const LagModel model(head, lag);
    for (const double pressure_advance_s : {0.01, 0.02, 0.035, 0.06}) {
      const std::vector<double> there = PrintLagLine(line, law, pressure_advance_s);
      std::vector<double> places;
      for (std::size_t i = 0; i < there.size(); ++i) {
        places.push_back(line.step_mm * static_cast<double>(i));
      }
      const std::vector<double> here = LayOne(model, 0.035, pressure_advance_s, places);
      double off = 0;
      int count = 0;
      for (std::size_t i = 0; i < there.size(); ++i) {
        if (places[i] < 4 || places[i] > line.length_mm - 4) continue;
        off += (here[i] - there[i]) * (here[i] - there[i]);
        ++count;
      }
      EXPECT_LT(std::sqrt(off / count), 0.03) << exponent << " " << pressure_advance_s;
    }
  }
}

TEST(LagModel, LaysEvenLinesWhereAdvanceFeedsWhatALinearLagStores) {
  LagLine line;
  const HeadMotion head(MotionOf(line));
  Lag lag;
  lag.smooth_s = 0.002;
  const LagModel model(head, lag);
  for (const double area : LayOne(model, 0.03, 0.03, Places(5, line.length_mm - 5, 0.5))) {
    EXPECT_NEAR(area, 1, 0.04);
  }
  EXPECT_NEAR(LagModel(head, lag).RightPressureAdvance(), lag.lag_s, 1e-12);
}

TEST(LagModel, LosesFilamentOnlyInAGapThatIsNotRefilled) {
  LagLine line;
  const HeadMotion head(MotionOf(line));
  const auto laid = [&](double loss) {
    Lag lag;
    lag.loss = loss;
    const std::vector<double> areas =
        LayOne(LagModel(head, lag), 0.02, 0.06, Places(2, line.length_mm, 0.1));
    return std::accumulate(areas.begin(), areas.end(), 0.0) * 0.1;
  };
  EXPECT_NEAR(laid(0), line.length_mm - 2, 0.2);
  EXPECT_GT(laid(1), laid(0.5) + 0.1);  // lost filament is laid again
  EXPECT_GT(laid(0.5), laid(0) + 0.1);
}

}  // namespace
}  // namespace trammel::pressure_advance
