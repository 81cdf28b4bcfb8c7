#include "pressure_advance/procedure/placed_sweep.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pressure_advance/procedure/sweep_observer.h"
#include "support/test_pictures.h"

namespace trammel::procedure {
namespace {

constexpr double kExact = 1e-9;

TEST(PlacedSweep, MovesBecomePositionsOfTheLaserOnTheHostsClock) {
  Sweep sweep;
  sweep.along_x = -1;  // printed towards -x
  sweep.along_y = 0;
  sweep.start_x_mm = 99;
  sweep.end_x_mm = 70;
  sweep.origin_mm = -100;  // the laser stands at the line's start where the nozzle is at x = 100
  machine::ClockRelation clock;
  clock.print_from_host = {1000, 50, 1, 0, 0};  // print time 50 is 1000 s of ours
  const std::vector<machine::TrapezoidMove> moves = {
      {52, 0.5, 4, 10, {98, 20, 17.86}, {-1, 0, 0}},
      {53, 0.5, 5, 0, {98, 20, 17.86}, {0, 0, 1}},   // in z: nothing along the line
      {54, 0.0, 5, 0, {98, 20, 17.86}, {-1, 0, 0}},  // without duration
  };
  const auto along = AlongLine(moves, {&sweep, 1}, clock, {});
  ASSERT_EQ(along.size(), 1u);
  EXPECT_NEAR(along[0].start_s, 1002, kExact);
  EXPECT_NEAR(along[0].start_mm, 2, kExact);
  EXPECT_NEAR(along[0].start_speed_mm_s, 4, kExact);
  EXPECT_NEAR(along[0].acceleration_mm_s2, 10, kExact);
}

// A line was printed in G-code's coordinates and is swept in them; the firmware tells its own.
TEST(PlacedSweep, AGcodeOffsetIsNotTakenForAPlaceOnTheLine) {
  Sweep sweep;
  sweep.end_x_mm = 30;
  machine::ClockRelation clock;
  const std::vector<machine::TrapezoidMove> moves = {{1, 0.5, 4, 0, {12.3, 7, 0}, {1, 0, 0}}};
  const auto along = AlongLine(moves, {&sweep, 1}, clock, {0.3, -0.1, 0.02});
  ASSERT_EQ(along.size(), 1u);
  EXPECT_NEAR(along[0].start_mm, 12, kExact);
}

TEST(PlacedSweep, IsWholeWhereTheMovesLeadFromItsBeginToAStandAtItsEnd) {
  Sweep sweep;
  sweep.start_x_mm = 10;
  sweep.end_x_mm = 40;
  auto moves = pressure_advance::TrapezoidSweep(100, 10, 40, 10, 1000);
  const std::span<const Sweep> run(&sweep, 1);
  EXPECT_TRUE(IsWhole(moves, run));
  EXPECT_FALSE(IsWhole(std::span(moves).first(moves.size() - 1), run));  // the end is to come
  EXPECT_FALSE(IsWhole(std::span(moves).subspan(1), run));
  EXPECT_FALSE(IsWhole({}, run));
  moves.erase(moves.begin() + 1);  // a batch got lost
  EXPECT_FALSE(IsWhole(moves, run));
}

TEST(PlacedSweep, OnlySteadyFramesAreScored) {
  using pressure_advance::FrameMotion;
  pressure_advance::SweepTiming timing;
  for (const auto motion :
       {FrameMotion::kStanding, FrameMotion::kRamp, FrameMotion::kSteady, FrameMotion::kUnplaced}) {
    pressure_advance::FrameTiming frame;
    frame.position_mm = 5;
    frame.motion = motion;
    timing.frames.push_back(frame);
  }
  const auto positions = ScoredPositions(timing, {0, 30, 0, 1});
  ASSERT_EQ(positions.size(), 4u);
  EXPECT_FALSE(positions[0].has_value());
  EXPECT_FALSE(positions[1].has_value());
  EXPECT_EQ(positions[2], 5.0);
  EXPECT_FALSE(positions[3].has_value());
}

TEST(PlacedSweep, EachFrameIsComparedWithTheOneBeforeHoweverManyThereAre) {
  std::vector<machine::CapturedFrame> frames;
  for (int i = 0; i < 100; ++i) {
    machine::CapturedFrame& frame = frames.emplace_back();
    const std::string jpeg = test::JpegOf(test::TestPicture(48, 32, i * i));
    frame.image.assign(jpeg.begin(), jpeg.end());
    frame.arrival_s = i;
  }
  const auto all = Observe(frames, {});
  ASSERT_TRUE(all);
  ASSERT_EQ(all->frames.size(), frames.size());
  EXPECT_FALSE(all->frames[0].change);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const auto pair = Observe(std::span(frames).subspan(i - 1, 2), {});
    ASSERT_TRUE(pair);
    EXPECT_EQ(all->frames[i].arrival_s, static_cast<double>(i));
    EXPECT_EQ(all->frames[i].change, pair->frames[1].change) << i;
  }
}

// However far the observer came while frames were added.
TEST(SweepObserver, BeginsWhatObserveEnds) {
  std::vector<machine::CapturedFrame> frames;
  SweepObserver observer;
  for (int i = 0; i < 60; ++i) {
    machine::CapturedFrame& frame = frames.emplace_back();
    const std::string jpeg = test::JpegOf(test::TestPicture(48, 32, i * i));
    frame.image.assign(jpeg.begin(), jpeg.end());
    frame.arrival_s = i;
    observer.Add(frame);
  }
  auto begun = observer.Finish();
  ASSERT_LE(begun.size(), frames.size());
  const auto all = Observe(frames, {}, std::move(begun));
  const auto alone = Observe(frames, {});
  ASSERT_TRUE(all && alone);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(all->frames[i].arrival_s, alone->frames[i].arrival_s);
    EXPECT_EQ(all->frames[i].change, alone->frames[i].change) << i;
  }
}

TEST(PlacedSweep, APictureThatIsNoneIsAnErrorAndNotABlackFrame) {
  machine::CapturedFrame frame;
  frame.image = {1, 2, 3};
  EXPECT_FALSE(Observe(std::vector{frame}, {}).has_value());
  EXPECT_FALSE(Reddened(frame, frame).has_value());
}

}  // namespace
}  // namespace trammel::procedure
