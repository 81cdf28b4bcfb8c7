#include "pressure_advance/timing/sweep_timing.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/timing/frame_stamps.h"
#include "pressure_advance/timing/sweep_positions.h"
#include "support/sweep_world.h"

namespace trammel::pressure_advance {
namespace {

using test::Delivery;
using test::SweepWorld;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// What the client knows of a sweep's times.
enum class Known { kCaptureAndOffset, kCaptureOnly, kArrivals };

struct Tally {
  int good = 0;
  std::size_t steady = 0;  ///< frames that may be scored
  std::size_t unplaced = 0;
  std::size_t wrongly_steady = 0;  ///< of them, taken while the head was slower
  double worst_mm = 0;             ///< error of position among the steady ones
  std::vector<double> session_worst_mm;
  std::vector<double> normal;  ///< error of one frame a sweep, in its standard uncertainty
  std::vector<double> sigma_mm;
  std::string last_reason;  ///< of a session that was not good
};

SweepObservation Observe(const SweepWorld& world, const test::WorldSweep& sweep, Known known) {
  SweepObservation observed;
  observed.motion = TrapezoidSweep(sweep.start_s, world.start_mm, world.end_mm, world.speed_mm_s,
                                   world.acceleration_mm_s2);
  for (const test::SweepFrame& frame : sweep.frames) {
    FrameObservation seen;
    seen.arrival_s = frame.arrival_s;
    if (known != Known::kArrivals) seen.captured_s = frame.stamp_s;
    if (!observed.frames.empty()) seen.change = frame.change;
    observed.frames.push_back(seen);
  }
  return observed;
}

SweepTimingOptions OptionsFor(const SweepWorld& world, Known known) {
  constexpr double kClockSigma_s = 0.001;
  SweepTimingOptions options;
  options.arrival_offset = ClockOffset{0, kClockSigma_s};
  if (known == Known::kCaptureAndOffset) {
    options.captured_offset = ClockOffset{-world.clock_s, kClockSigma_s};
  }
  return options;
}

void Compare(const SweepWorld& world, const std::vector<test::WorldSweep>& session,
             const SessionTiming& timing, Tally& tally) {
  double worst_mm = 0;
  for (std::size_t s = 0; s < session.size(); ++s) {
    const auto& truths = session[s].frames;
    for (std::size_t i = 0; i < truths.size(); ++i) {
      const FrameTiming& frame = timing.sweeps[s].frames[i];
      tally.unplaced += frame.motion == FrameMotion::kUnplaced ? 1 : 0;
      if (frame.motion != FrameMotion::kSteady) continue;
      ++tally.steady;
      const double error_mm = frame.position_mm - truths[i].true_position_mm;
      worst_mm = std::max(worst_mm, std::abs(error_mm));
      constexpr double kSteady = 0.98;
      if (std::abs(truths[i].true_speed_mm_s) < kSteady * world.speed_mm_s) ++tally.wrongly_steady;
      if (i == truths.size() / 2) {
        tally.normal.push_back(error_mm / frame.position_sigma_mm);
        tally.sigma_mm.push_back(frame.position_sigma_mm);
      }
    }
  }
  tally.session_worst_mm.push_back(worst_mm);
  tally.worst_mm = std::max(tally.worst_mm, worst_mm);
}

/// Times `sessions` sessions with seeds first_seed … and prints one line of figures.
Tally RunStudy(const std::string& name, const SweepWorld& world, Known known, std::size_t lines,
               int sessions, std::uint64_t first_seed) {
  Tally tally;
  for (int i = 0; i < sessions; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    Random random(seed);
    const auto session = test::RecordSession(world, lines, random);
    std::vector<SweepObservation> observed;
    for (const test::WorldSweep& sweep : session) observed.push_back(Observe(world, sweep, known));
    const auto timing = MatchSweeps(observed, OptionsFor(world, known));
    if (!timing.latency_s.good()) {
      tally.last_reason = fmt::format("seed {}: {}", seed, timing.latency_s.reason());
      continue;
    }
    ++tally.good;
    Compare(world, session, timing, tally);
  }
  if (tally.normal.empty()) return tally;
  double square = 0;
  for (const double z : tally.normal) square += z * z;
  fmt::print(
      "{:30} good {}/{}; worst frame of a session: median {:.1f}, 95 % {:.1f}, largest {:.1f} um; "
      "stated sigma {:.1f} um, rms error / sigma {:.2f}; {} frames, {} unplaced\n",
      name, tally.good, sessions, 1e3 * Median(tally.session_worst_mm),
      1e3 * Quantile(tally.session_worst_mm, 0.95), 1e3 * tally.worst_mm,
      1e3 * Median(tally.sigma_mm), std::sqrt(square / static_cast<double>(tally.normal.size())),
      tally.steady, tally.unplaced);
  return tally;
}

/// What the calibration asks of every frame that is scored.
constexpr double kWithin_mm = 0.05;

SweepWorld Bursty() {
  SweepWorld world;
  world.delivery = Delivery::kBursty;
  return world;
}

SweepWorld Lossy() {
  SweepWorld world;
  world.loss = 0.01;
  return world;
}

TEST(SweepTiming, TenLinesPlaceEveryScoredFrameWithin50Microns) {
  constexpr int kSessions = 8;
  constexpr std::size_t kLines = 10;
  SweepWorld backwards;
  std::swap(backwards.start_mm, backwards.end_mm);
  SweepWorld abrupt;
  abrupt.acceleration_mm_s2 = 1000;
  for (const auto& [name, world, known] : {
           std::tuple{"capture times, offset known", SweepWorld{}, Known::kCaptureAndOffset},
           std::tuple{"capture times alone", SweepWorld{}, Known::kCaptureOnly},
           std::tuple{"arrivals, 50 ms even jitter", SweepWorld{}, Known::kArrivals},
           std::tuple{"arrivals, backwards", backwards, Known::kArrivals},
           std::tuple{"arrivals, abrupt ramps", abrupt, Known::kArrivals},
           std::tuple{"arrivals, 50 ms bursts", Bursty(), Known::kArrivals},
           std::tuple{"arrivals, 1 % lost", Lossy(), Known::kArrivals},
       }) {
    const Tally tally = RunStudy(name, world, known, kLines, kSessions, 1);
    EXPECT_EQ(tally.good, kSessions) << name << ": " << tally.last_reason;
    EXPECT_LT(tally.worst_mm, kWithin_mm) << name;
    EXPECT_EQ(tally.wrongly_steady, 0) << name;
  }
}

TEST(SweepTiming, OneLineStatesHowLittleItKnows) {
  // One beginning and one end tell the latency to a good part of a frame's period.
  constexpr int kRepeats = 100;
  for (const auto& [name, world, known] : {
           std::tuple{"one line, capture times", SweepWorld{}, Known::kCaptureAndOffset},
           std::tuple{"one line, arrivals", SweepWorld{}, Known::kArrivals},
       }) {
    const Tally tally = RunStudy(name, world, known, 1, kRepeats, 1);
    EXPECT_GE(tally.good, 0.95 * kRepeats) << tally.last_reason;
    EXPECT_EQ(tally.wrongly_steady, 0) << name;
    const auto within = std::count_if(tally.normal.begin(), tally.normal.end(),
                                      [](double z) { return std::abs(z) < 2; });
    // 95 % are claimed; binomial scatter of 100 is 2.2 %.
    EXPECT_GE(static_cast<double>(within), 0.91 * static_cast<double>(tally.normal.size())) << name;
  }
}

TEST(SweepTiming, IsExactWithoutNoiseToTheClocksLimit) {
  SweepWorld world;
  world.delivery = Delivery::kPrompt;
  world.capture_scatter_s = 0;
  world.noise = 0;
  world.exposure_s = 0;
  const Tally tally = RunStudy("ten lines, no noise", world, Known::kCaptureAndOffset, 10, 5, 1);
  // 20 ends, each seen between two frames: a period of 33 ms in 20 places leaves 2 ms, or 13 um.
  EXPECT_LT(tally.worst_mm, 0.02);
}

TEST(SweepTiming, CountsWhatWasLostAndMarksWhereItCannotTell) {
  SweepWorld world = Lossy();
  Random random(7);
  const auto session = test::RecordSession(world, 6, random);
  std::vector<SweepObservation> observed;
  for (const auto& sweep : session) {
    observed.push_back(Observe(world, sweep, Known::kCaptureAndOffset));
  }
  const SessionTiming timing = MatchSweeps(observed, OptionsFor(world, Known::kCaptureOnly));
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  std::size_t lost = 0;
  for (std::size_t s = 0; s < session.size(); ++s) {
    for (std::size_t i = 1; i < session[s].frames.size(); ++i) {
      const std::size_t missing =
          session[s].frames[i].sequence - session[s].frames[i - 1].sequence - 1;
      EXPECT_EQ(timing.sweeps[s].frames[i].lost_before, missing);
      lost += missing;
    }
  }
  EXPECT_GT(lost, 0);
}

class Faults : public testing::Test {
 protected:
  Faults() {
    Random random(11);
    session_ = test::RecordSession(world_, 4, random);
    for (const auto& sweep : session_) {
      observed_.push_back(Observe(world_, sweep, Known::kCaptureAndOffset));
    }
  }
  SessionTiming Match(Known known = Known::kCaptureAndOffset) const {
    return MatchSweeps(observed_, OptionsFor(world_, known));
  }
  std::string Reason(Known known = Known::kCaptureAndOffset) const {
    const SessionTiming timing = Match(known);
    EXPECT_EQ(timing.latency_s.verdict(), Verdict::kRefused);
    EXPECT_TRUE(timing.sweeps.empty());
    return timing.latency_s.reason();
  }
  void ForgetCaptureTimes() {
    for (auto& sweep : observed_) {
      for (auto& frame : sweep.frames) frame.captured_s.reset();
    }
  }
  double WorstSteady(const SessionTiming& timing) const {
    double worst = 0;
    for (std::size_t s = 0; s < timing.sweeps.size(); ++s) {
      for (std::size_t i = 0; i < timing.sweeps[s].frames.size(); ++i) {
        const FrameTiming& frame = timing.sweeps[s].frames[i];
        if (frame.motion != FrameMotion::kSteady) continue;
        worst =
            std::max(worst, std::abs(frame.position_mm - session_[s].frames[i].true_position_mm));
      }
    }
    return worst;
  }
  SweepWorld world_;
  std::vector<test::WorldSweep> session_;
  std::vector<SweepObservation> observed_;
};

TEST_F(Faults, RefusesAMotionSeen300MillisecondsFromWhereTheClocksSay) {
  for (const double shift_s : {-0.3, 0.5}) {
    auto moved = observed_;
    for (auto& sweep : moved) {
      for (auto& move : sweep.motion) move.start_s -= shift_s;
    }
    const SessionTiming timing = MatchSweeps(moved, OptionsFor(world_, Known::kCaptureAndOffset));
    EXPECT_EQ(timing.latency_s.verdict(), Verdict::kRefused);
    EXPECT_THAT(timing.latency_s.reason(), HasSubstr(shift_s < 0 ? "earlier" : "later"));
  }
}

TEST_F(Faults, RefusesAPictureThatDoesNotTellStandingFromMoving) {
  Random random(3);
  for (auto& sweep : observed_) {
    for (auto& frame : sweep.frames) {
      if (frame.change) frame.change = 1 + 0.2 * random.Normal();
    }
  }
  EXPECT_THAT(Reason(), HasSubstr("laser"));
  for (auto& sweep : observed_) {
    for (auto& frame : sweep.frames) {
      if (frame.change) frame.change = 0;
    }
  }
  EXPECT_THAT(Reason(), HasSubstr("laser"));
}

TEST_F(Faults, RefusesAHeadThatStoppedOnTheWay) {
  auto& frames = observed_[1].frames;
  const double still = *frames[5].change;
  for (std::size_t i = 60; i < 90; ++i) frames[i].change = still;
  EXPECT_THAT(Reason(), AllOf(HasSubstr("sweep 2"), HasSubstr("did the head stop")));
}

TEST_F(Faults, LeavesOutFramesThatRepeatTheOneBefore) {
  const std::size_t repeated = 70;
  observed_[2].frames[repeated].change = 0;
  const SessionTiming timing = Match();
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_EQ(timing.sweeps[2].frames[repeated].motion, FrameMotion::kUnplaced);
  EXPECT_THAT(timing.sweeps[2].frames[repeated].note, HasSubstr("repeats"));
  EXPECT_EQ(timing.sweeps[2].frames[repeated + 1].motion, FrameMotion::kSteady);
}

TEST_F(Faults, RefusesARecordingThatBeganTooLate) {
  auto& frames = observed_[0].frames;
  frames.erase(frames.begin(), frames.begin() + 17);
  EXPECT_THAT(Reason(), AllOf(HasSubstr("sweep 1"), HasSubstr("standing head before")));
}

TEST_F(Faults, RefusesACameraWhoseRateChanges) {
  // From 30 to 27 frames/s in mid-sweep, as an automatic exposure does; without capture times.
  ForgetCaptureTimes();
  auto& frames = observed_[1].frames;
  for (std::size_t i = 70; i < frames.size(); ++i) {
    frames[i].arrival_s += static_cast<double>(i - 70) * (1.0 / 27 - 1.0 / 30);
  }
  EXPECT_THAT(Reason(Known::kArrivals), HasSubstr("sweep 2"));
}

TEST_F(Faults, RefusesFramesThatComeInBurstsWithoutCaptureTimes) {
  ForgetCaptureTimes();
  for (const std::size_t burst : {10, 40, 1000}) {
    auto bursts = observed_;
    for (auto& sweep : bursts) {
      for (std::size_t i = 0; i < sweep.frames.size(); ++i) {
        const std::size_t last = std::min(i - i % burst + burst, sweep.frames.size()) - 1;
        sweep.frames[i].arrival_s = sweep.frames[last].arrival_s;
      }
    }
    const SessionTiming timing = MatchSweeps(bursts, OptionsFor(world_, Known::kArrivals));
    EXPECT_EQ(timing.latency_s.verdict(), Verdict::kRefused) << burst;
  }
}

TEST_F(Faults, TakesArrivalsWhereTheCamerasClockIsSet) {
  auto& frames = observed_[3].frames;
  for (std::size_t i = 80; i < frames.size(); ++i) *frames[i].captured_s += 0.4;
  const SessionTiming timing = Match(Known::kCaptureOnly);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  ASSERT_FALSE(timing.notices.empty());
  EXPECT_THAT(timing.notices[0], AllOf(HasSubstr("sweep 4"), HasSubstr("clock moved by")));
  EXPECT_FALSE(timing.sweeps[0].from_capture_times);
  EXPECT_LT(WorstSteady(timing), 2 * kWithin_mm);  // four lines only
}

TEST_F(Faults, ABusyHostThatDeliversLateIsNotTakenForAClockThatWasSet) {
  for (auto& sweep : observed_) {
    double last_s = 0;
    for (std::size_t i = 0; i < sweep.frames.size(); ++i) {
      if (i > 40 && i < 90) sweep.frames[i].arrival_s += 0.12;
      last_s = sweep.frames[i].arrival_s = std::max(last_s, sweep.frames[i].arrival_s);
    }
  }
  const SessionTiming timing = Match(Known::kCaptureOnly);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_TRUE(timing.notices.empty()) << timing.notices[0];
  EXPECT_TRUE(timing.sweeps[0].from_capture_times);
  EXPECT_LT(WorstSteady(timing), kWithin_mm);
}

TEST_F(Faults, NorAreGapsOfManyFramesBetweenTimesCutToMilliseconds) {
  for (auto& sweep : observed_) {
    for (auto& frame : sweep.frames) frame.captured_s = std::floor(*frame.captured_s * 1e3) / 1e3;
    auto& frames = sweep.frames;
    frames.erase(frames.begin() + 50, frames.begin() + 69);
    frames[50].change.reset();
    for (std::size_t i = 50; i < 70; ++i) {
      frames[i].arrival_s = std::max(frames[i].arrival_s, frames[70].arrival_s);
    }
    for (std::size_t i = 70; i < frames.size(); ++i) {
      frames[i].arrival_s = std::max(frames[i].arrival_s, frames[i - 1].arrival_s);
    }
  }
  const SessionTiming timing = Match(Known::kCaptureOnly);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_TRUE(timing.notices.empty()) << timing.notices[0];
}

TEST_F(Faults, NorIsABusyCameraThatLosesMostOfItsFramesAndSendsTheRestLate) {
  for (auto& sweep : observed_) {
    std::vector<FrameObservation> kept;
    double last_s = 0;
    for (std::size_t i = 0; i < sweep.frames.size(); ++i) {
      // Every other frame, and now and then two in a row; busy in the middle.
      if (i % 7 != 3 && i % 2 == 1) continue;
      FrameObservation frame = sweep.frames[i];
      frame.captured_s = std::floor(*frame.captured_s * 1e3) / 1e3;
      if (i > 40 && i < 100) frame.arrival_s += 0.18;
      frame.arrival_s = last_s = std::max(last_s, frame.arrival_s);
      if (kept.empty()) frame.change.reset();
      kept.push_back(frame);
    }
    sweep.frames = std::move(kept);
  }
  const SessionTiming timing = Match();
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_TRUE(timing.notices.empty()) << timing.notices[0];
  EXPECT_TRUE(timing.sweeps[0].from_capture_times);
  const Lateness lateness = MeasureLateness(observed_[0], 30);
  EXPECT_NEAR(lateness.late_s, 0.2, 0.04);
  EXPECT_GT(lateness.lost, lateness.frames / 2);
  EXPECT_THAT(NameBusyComputer(lateness),
              AllOf(HasSubstr("ms late and "), HasSubstr("never came"), HasSubstr("too busy")));
}

TEST_F(Faults, LeavesOutFramesThatWereStampedWhenTheyWereFetchedLate) {
  // The camera's server had no processor for 150 ms, and stamped five frames at once.
  auto& frames = observed_[1].frames;
  for (std::size_t i = 70; i < 75; ++i) {
    frames[i].captured_s = *frames[75].captured_s - 1e-3 * static_cast<double>(75 - i);
    frames[i].arrival_s = std::max(frames[i].arrival_s, frames[75].arrival_s - 0.04);
  }
  for (std::size_t i = 75; i < frames.size(); ++i) {
    frames[i].arrival_s = std::max(frames[i].arrival_s, frames[i - 1].arrival_s);
  }
  const SessionTiming timing = Match();
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_EQ(timing.sweeps[1].frames[71].motion, FrameMotion::kUnplaced);
  EXPECT_THAT(timing.sweeps[1].frames[71].note, HasSubstr("ms late: the camera's computer"));
  EXPECT_EQ(timing.sweeps[1].frames[76].motion, FrameMotion::kSteady);
  EXPECT_LT(WorstSteady(timing), kWithin_mm);
}

TEST_F(Faults, ACameraThatStampsMostlyLateIsNamedAsTooBusy) {
  for (auto& sweep : observed_) {
    auto& frames = sweep.frames;
    for (std::size_t i = 0; i + 9 < frames.size(); i += 9) {
      for (std::size_t k = 0; k < 4; ++k) {
        frames[i + k].captured_s = *frames[i + 4].captured_s - 1e-3 * static_cast<double>(4 - k);
        frames[i + k].arrival_s = std::max(frames[i + k].arrival_s, *frames[i + k].captured_s);
      }
    }
    for (std::size_t i = 1; i < frames.size(); ++i) {
      frames[i].arrival_s = std::max(frames[i].arrival_s, frames[i - 1].arrival_s);
    }
  }
  EXPECT_THAT(Reason(), AllOf(HasSubstr("sweep 1"), HasSubstr("stamped up to"),
                              HasSubstr("computer is too busy")));
}

TEST_F(Faults, AMotionSeenAtAnotherTimeIsNotBlamedOnTheRecording) {
  for (auto& sweep : observed_) {
    for (auto& move : sweep.motion) move.start_s += 0.3;
  }
  EXPECT_THAT(Reason(), AllOf(HasSubstr("earlier than the clocks allow"),
                              testing::Not(HasSubstr("recording"))));
}

TEST_F(Faults, ASteadyCameraOnAnIdleComputerIsNotNamed) {
  EXPECT_EQ(NameBusyComputer(MeasureLateness(observed_[0], 30)), "");
  // A camera in the dark that takes half of what it was asked for loses nothing.
  EXPECT_EQ(NameBusyComputer(MeasureLateness(observed_[0], 60)), "");
}

TEST_F(Faults, LeavesOutASingleCaptureTimeThatJumpsBack) {
  *observed_[0].frames[50].captured_s -= 3;
  const SessionTiming timing = Match();
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_EQ(timing.sweeps[0].frames[50].motion, FrameMotion::kUnplaced);
  EXPECT_EQ(timing.sweeps[0].frames[51].motion, FrameMotion::kSteady);
}

TEST_F(Faults, LeavesOutTheOneSweepThatContradictsTheOthers) {
  for (auto& move : observed_[2].motion) move.start_s += 0.12;
  const SessionTiming timing = Match();
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  for (const FrameTiming& frame : timing.sweeps[2].frames) {
    EXPECT_EQ(frame.motion, FrameMotion::kUnplaced);
  }
  EXPECT_LT(WorstSteady(timing), kWithin_mm);
  EXPECT_THAT(timing.notices.at(0), HasSubstr("sweep 3"));
}

TEST_F(Faults, WithoutAnyRelationOfTheClocksThePictureAloneDecides) {
  for (auto& sweep : observed_) {
    for (auto& frame : sweep.frames) {
      frame.arrival_s += 5000;
      frame.captured_s.reset();
    }
  }
  SweepTimingOptions options;
  const SessionTiming timing = MatchSweeps(observed_, options);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_LT(WorstSteady(timing), 2 * kWithin_mm);
}

TEST_F(Faults, RefusesNumbersThatAreNone) {
  const auto clean = observed_;
  observed_[0].frames[3].arrival_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Reason(), HasSubstr("frame 4"));
  observed_ = clean;
  observed_[0].frames[3].arrival_s -= 10;
  EXPECT_THAT(Reason(), HasSubstr("frame 4"));
  observed_ = clean;
  observed_[0].frames[3].change = -1;
  EXPECT_THAT(Reason(), HasSubstr("change of -1"));
  observed_ = clean;
  observed_[3].frames.resize(7);
  EXPECT_THAT(Reason(), AllOf(HasSubstr("sweep 4"), HasSubstr("7 frames")));
}

TEST(SweepMotion, FollowsATrapezoid) {
  const auto moves = TrapezoidSweep(10, 26, 4, 5, 50);
  EXPECT_EQ(HeadAt(moves, 9).position_mm, 26);
  EXPECT_TRUE(HeadAt(moves, 9).standing);
  // 0.1 s and 0.25 mm of ramp; 21.5 mm at 5 mm/s.
  EXPECT_NEAR(HeadAt(moves, 10.05).position_mm, 26 - 0.0625, 1e-9);
  EXPECT_NEAR(HeadAt(moves, 11.1).position_mm, 26 - 0.25 - 5, 1e-9);
  EXPECT_NEAR(HeadAt(moves, 11.1).speed_mm_s, -5, 1e-9);
  EXPECT_NEAR(MotionEnd_s(moves), 10 + 0.1 + 4.3 + 0.1, 1e-9);
  EXPECT_NEAR(HeadAt(moves, 20).position_mm, 4, 1e-9);
  EXPECT_TRUE(IsSteady(moves, 10.11, 14.39, 0.01));
  EXPECT_FALSE(IsSteady(moves, 10.08, 14.39, 0.01));
  EXPECT_FALSE(IsSteady(moves, 9.9, 10.3, 0.01));
  EXPECT_TRUE(StandsWithin(moves, 9.9, 10.3));
  EXPECT_FALSE(StandsWithin(moves, 10.01, 14.49));
  EXPECT_TRUE(StandsWithin(moves, 14.49, 14.6));
}

}  // namespace
}  // namespace trammel::pressure_advance
