#include "pressure_advance/response/unseen_stretch.h"

#include <gtest/gtest.h>

namespace trammel::pressure_advance {
namespace {

// Windows of 8 mm: more than 2 mm of either in one piece cannot be bridged.
TransitionPlan TwoWindows() {
  TransitionPlan plan;
  plan.acceleration.span = {8, 16};
  plan.deceleration.span = {16, 24};
  return plan;
}

std::vector<std::optional<double>> FramesBut(double lo, double hi, double step = 0.25) {
  std::vector<std::optional<double>> frames = {std::nullopt};
  for (double at = 0.1; at < 30; at += step) {
    if (at <= lo || at >= hi) frames.emplace_back(at);
  }
  frames.emplace_back(std::nullopt);
  return frames;
}

TEST(UnseenStretch, NamesAGapOfMoreThanAQuarterOfATransition) {
  EXPECT_EQ(NameUnseenStretch(FramesBut(0, 0), TwoWindows()), "");
  EXPECT_EQ(NameUnseenStretch(FramesBut(17, 18.7), TwoWindows()), "");
  EXPECT_EQ(NameUnseenStretch(FramesBut(17, 20), TwoWindows()),
            "no frame shows the line from 16.9 to 20.1 mm");
  EXPECT_EQ(NameUnseenStretch(FramesBut(9, 12), TwoWindows()),
            "no frame shows the line from 8.85 to 12.1 mm");
}

TEST(UnseenStretch, SeesWhereASweepBeganTooLateOrEndedTooEarly) {
  EXPECT_EQ(NameUnseenStretch(FramesBut(21, 40), TwoWindows()),
            "no frame shows the line from 20.9 to 24 mm");
  EXPECT_EQ(NameUnseenStretch(FramesBut(-1, 11), TwoWindows()),
            "no frame shows the line from 8 to 11.1 mm");
}

TEST(UnseenStretch, DoesNotMatterBesideTheTransitions) {
  EXPECT_EQ(NameUnseenStretch(FramesBut(1, 7), TwoWindows()), "");
  EXPECT_EQ(NameUnseenStretch(FramesBut(24.5, 29), TwoWindows()), "");
}

TEST(UnseenStretch, IsNoneWhereAllFramesAreThatFarApart) {
  EXPECT_EQ(NameUnseenStretch(FramesBut(0, 0, 2.5), TwoWindows()), "");
  EXPECT_EQ(NameUnseenStretch({std::nullopt, 3.0}, TwoWindows()), "");
}

}  // namespace
}  // namespace trammel::pressure_advance
