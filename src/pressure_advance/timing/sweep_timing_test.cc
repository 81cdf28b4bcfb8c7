#include "pressure_advance/timing/sweep_timing.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
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

/// Time information of a sweep available to the client.
enum class Known { kCaptureAndOffset, kCaptureOnly, kArrivals };

struct Tally {
  int good = 0;
  std::size_t steady = 0;  ///< frames that may be scored
  std::size_t unplaced = 0;
  std::size_t wrongly_steady = 0;  ///< of these, captured while the head was slower
  double worst_mm = 0;             ///< error of position among the steady ones
  std::vector<double> session_worst_mm;
  std::vector<double> normal;  ///< error of one frame a sweep, in its standard uncertainty
  std::vector<double> sigma_mm;
  std::string last_reason;  ///< from a session that failed
};

SweepObservation Observe(const SweepWorld& world, const test::WorldSweep& sweep, Known known) {
  SweepObservation observed;
  observed.motion = TrapezoidSweep(sweep.start_s, world.start_mm, world.end_mm, world.speed_mm_s,
                                   world.acceleration_mm_s2);
  constexpr double kClockSigma_s = 0.001;
  observed.arrival_offset = {0, kClockSigma_s};
  if (known == Known::kCaptureAndOffset) {
    observed.captured_offset = ClockOffset{-world.clock_s, kClockSigma_s};
  }
  for (const test::SweepFrame& frame : sweep.frames) {
    FrameObservation seen;
    seen.arrival_s = frame.arrival_s;
    if (known != Known::kArrivals) seen.captured_s = frame.stamp_s;
    if (!observed.frames.empty()) seen.change = frame.change;
    observed.frames.push_back(seen);
  }
  return observed;
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
    const auto timing = MatchSweeps(observed);
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

/// Tolerance of the calibration for every scored frame.
constexpr double kWithin_mm = 0.05;

TEST(SweepTiming, TenLinesPlaceEveryScoredFrameWithin50Microns) {
  constexpr int kSessions = 8;
  constexpr std::size_t kLines = 10;
  SweepWorld backwards;
  std::swap(backwards.start_mm, backwards.end_mm);
  SweepWorld abrupt;
  abrupt.acceleration_mm_s2 = 1000;
  SweepWorld bursty;
  bursty.delivery = Delivery::kBursty;
  SweepWorld lossy;
  lossy.loss = 0.01;
  for (const auto& [name, world, known] : {
           std::tuple{"capture times, offset known", SweepWorld{}, Known::kCaptureAndOffset},
           std::tuple{"capture times alone", SweepWorld{}, Known::kCaptureOnly},
           std::tuple{"arrivals, 50 ms even jitter", SweepWorld{}, Known::kArrivals},
           std::tuple{"arrivals, backwards", backwards, Known::kArrivals},
           std::tuple{"arrivals, abrupt ramps", abrupt, Known::kArrivals},
           std::tuple{"arrivals, 50 ms bursts", bursty, Known::kArrivals},
           std::tuple{"arrivals, 1 % lost", lossy, Known::kArrivals},
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

class Faults : public testing::Test {
 protected:
  Faults() {
    Random random(11);
    session_ = test::RecordSession(world_, 4, random);
    for (const auto& sweep : session_) {
      observed_.push_back(Observe(world_, sweep, Known::kCaptureAndOffset));
    }
  }
  void ForgetOffsets() {
    for (auto& sweep : observed_) sweep.captured_offset.reset();
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

TEST_F(Faults, RefusesWhatContradictsTheMotionOrTheClocks) {
  using Sweeps = std::vector<SweepObservation>;
  const auto moved = [](double by_s) {
    return [by_s](Sweeps& sweeps) {
      for (auto& sweep : sweeps) {
        for (auto& move : sweep.motion) move.start_s += by_s;
      }
    };
  };
  const auto changes = [](double level, double noise) {
    return [=](Sweeps& sweeps) {
      Random random(3);
      for (auto& sweep : sweeps) {
        for (auto& frame : sweep.frames) {
          if (frame.change) frame.change = level + noise * random.Normal();
        }
      }
    };
  };
  const auto bursts = [](std::size_t burst) {
    return [burst](Sweeps& sweeps) {
      for (auto& sweep : sweeps) {
        for (std::size_t i = 0; i < sweep.frames.size(); ++i) {
          const std::size_t last = std::min(i - i % burst + burst, sweep.frames.size()) - 1;
          sweep.frames[i].arrival_s = sweep.frames[last].arrival_s;
        }
      }
    };
  };
  struct Row {
    const char* words;
    std::function<void(Sweeps&)> spoil;
    bool arrivals_only = false;
  };
  for (const Row& row : {
           Row{"earlier", moved(0.3)},
           Row{"later", moved(-0.5)},
           Row{"laser", changes(1, 0.2)},
           Row{"laser", changes(0, 0)},
           Row{"did the head stop",
               [](Sweeps& sweeps) {
                 auto& frames = sweeps[1].frames;
                 for (std::size_t i = 60; i < 90; ++i) frames[i].change = frames[5].change;
               }},
           Row{"standing head before",
               [](Sweeps& sweeps) {
                 auto& frames = sweeps[0].frames;
                 frames.erase(frames.begin(), frames.begin() + 17);
               }},
           // From 30 to 27 frames/s in mid-sweep, as an automatic exposure does.
           Row{"sweep 2",
               [](Sweeps& sweeps) {
                 auto& frames = sweeps[1].frames;
                 for (std::size_t i = 70; i < frames.size(); ++i) {
                   frames[i].arrival_s += static_cast<double>(i - 70) * (1.0 / 27 - 1.0 / 30);
                 }
               },
               true},
           Row{"", bursts(10), true},
           Row{"", bursts(1000), true},
           // A camera's server that has no processor stamps frames when it fetches them.
           Row{"computer is too busy",
               [](Sweeps& sweeps) {
                 for (auto& sweep : sweeps) {
                   auto& frames = sweep.frames;
                   for (std::size_t i = 0; i + 9 < frames.size(); ++i) {
                     if (i % 9 > 3 || i - i % 9 + 9 >= frames.size()) continue;
                     const double gap_s = 1e-3 * static_cast<double>(4 - i % 9);
                     frames[i].captured_s = *frames[i - i % 9 + 4].captured_s - gap_s;
                     frames[i].arrival_s = std::max(frames[i].arrival_s, *frames[i].captured_s);
                   }
                   for (std::size_t i = 1; i < frames.size(); ++i) {
                     frames[i].arrival_s = std::max(frames[i].arrival_s, frames[i - 1].arrival_s);
                   }
                 }
               }},
           Row{"frame 4",
               [](Sweeps& sweeps) {
                 sweeps[0].frames[3].arrival_s = std::numeric_limits<double>::quiet_NaN();
               }},
           Row{"frame 4", [](Sweeps& sweeps) { sweeps[0].frames[3].arrival_s -= 10; }},
           Row{"change of -1", [](Sweeps& sweeps) { sweeps[0].frames[3].change = -1; }},
           Row{"7 frames", [](Sweeps& sweeps) { sweeps[3].frames.resize(7); }},
       }) {
    SCOPED_TRACE(row.words);
    Sweeps spoilt = observed_;
    for (auto& sweep : spoilt) {
      if (!row.arrivals_only) continue;
      sweep.captured_offset.reset();
      for (auto& frame : sweep.frames) frame.captured_s.reset();
    }
    row.spoil(spoilt);
    const SessionTiming timing = MatchSweeps(spoilt);
    EXPECT_EQ(timing.latency_s.verdict(), Verdict::kRefused);
    EXPECT_TRUE(timing.sweeps.empty());
    EXPECT_THAT(timing.latency_s.reason(), HasSubstr(row.words));
  }
}

TEST_F(Faults, TakesArrivalsWhereTheCamerasClockIsSet) {
  auto& frames = observed_[3].frames;
  for (std::size_t i = 80; i < frames.size(); ++i) *frames[i].captured_s += 0.4;
  ForgetOffsets();
  const SessionTiming timing = MatchSweeps(observed_);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  ASSERT_FALSE(timing.notices.empty());
  EXPECT_THAT(timing.notices[0], AllOf(HasSubstr("sweep 4"), HasSubstr("clock moved by")));
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
  ForgetOffsets();
  const SessionTiming timing = MatchSweeps(observed_);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_TRUE(timing.notices.empty()) << timing.notices[0];
  EXPECT_LT(WorstSteady(timing), kWithin_mm);
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
  const SessionTiming timing = MatchSweeps(observed_);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_TRUE(timing.notices.empty()) << timing.notices[0];
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
  const SessionTiming timing = MatchSweeps(observed_);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  EXPECT_EQ(timing.sweeps[1].frames[71].motion, FrameMotion::kUnplaced);
  EXPECT_THAT(timing.sweeps[1].frames[71].note, HasSubstr("ms late: the camera's computer"));
  EXPECT_EQ(timing.sweeps[1].frames[76].motion, FrameMotion::kSteady);
  EXPECT_LT(WorstSteady(timing), kWithin_mm);
}

TEST_F(Faults, ASteadyCameraOnAnIdleComputerIsNotNamed) {
  EXPECT_EQ(NameBusyComputer(MeasureLateness(observed_[0], 30)), "");
  // A camera in the dark that takes half of what it was asked for loses nothing.
  EXPECT_EQ(NameBusyComputer(MeasureLateness(observed_[0], 60)), "");
}

TEST_F(Faults, LeavesOutTheOneSweepThatContradictsTheOthers) {
  for (auto& move : observed_[2].motion) move.start_s += 0.12;
  const SessionTiming timing = MatchSweeps(observed_);
  ASSERT_TRUE(timing.latency_s.good()) << timing.latency_s.reason();
  for (const FrameTiming& frame : timing.sweeps[2].frames) {
    EXPECT_EQ(frame.motion, FrameMotion::kUnplaced);
  }
  EXPECT_LT(WorstSteady(timing), kWithin_mm);
  EXPECT_THAT(timing.notices.at(0), HasSubstr("sweep 3"));
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
