#include "pressure_advance/response/law_line.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trammel::pressure_advance {
namespace {

using Eigen::Index, Eigen::VectorXd;

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

}  // namespace
}  // namespace trammel::pressure_advance
