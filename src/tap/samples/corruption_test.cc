#include "tap/samples/corruption.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tap/samples/finding.h"
#include "tap/samples/hum.h"
#include "tap/samples/lines_test_support.h"
#include "tap/two_line/tap_lines.h"
namespace trammel::tap {
namespace {

using test_support::TapDrawing;

constexpr std::uint64_t kSeed = 700;

// Owns the memory that its samples lie in.
struct Cleaned {
  std::vector<std::byte> memory;
  CleanTap tap;
  TapMotion motion;
};

Cleaned Clean(const RecordedTap& tap) {
  Cleaned cleaned;
  cleaned.memory.resize(CleanWorkspaceBytes(tap.drawn.time_s.size()));
  Workspace workspace(cleaned.memory);
  EXPECT_EQ(FindMotion(tap.moves, cleaned.motion).code, FindingCode::kNone);
  cleaned.tap = CleanSamples(tap.View(), cleaned.motion, workspace);
  return cleaned;
}

std::size_t IndexAt(const RecordedTap& tap, double time_s) {
  const auto& times = tap.drawn.time_s;
  return static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), time_s) -
                                  times.begin());
}

std::size_t InCruise(const RecordedTap& tap) {
  return IndexAt(tap, tap.drawn.contact_time_s - 0.05);
}

void Stick(RecordedTap& tap, std::size_t first) {
  auto& force_g = tap.drawn.force_g;
  std::fill_n(force_g.begin() + static_cast<std::ptrdiff_t>(first), 8, force_g[first]);
}

FindingCode ReasonOf(const RecordedTap& tap) { return AnalyseTwoLine(tap.View()).reason.code; }

TEST(CleanSamples, FindsNothingInCleanTaps) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const Cleaned cleaned = Clean(Record({}, seed));
    EXPECT_EQ(cleaned.tap.duplicated + cleaned.tap.dropped + cleaned.tap.spikes +
                  cleaned.tap.stuck + cleaned.tap.saturated,
              0U)
        << "seed " << seed;
  }
}

TEST(CleanSamples, LeavesOutErrorFramesAndKeepsTheAnswer) {
  RecordedTap tap = Record({}, kSeed);
  const double before = AnalyseTwoLine(tap.View()).contact_mm.value;
  for (const double after_s : {-0.09, 0.01, 0.06}) {
    tap.drawn.force_g[IndexAt(tap, tap.drawn.contact_time_s + after_s)] = -4711;
  }
  const Cleaned cleaned = Clean(tap);
  EXPECT_EQ(cleaned.tap.spikes, 3U);
  EXPECT_TRUE(cleaned.tap.spikes_are_equal);
  const TapAnalysis result = AnalyseTwoLine(tap.View());
  ASSERT_EQ(result.verdict, Verdict::kGood) << Explain(result.reason);
  EXPECT_TRUE(HasNotice(AnalyseTwoLine(tap.View()), FindingCode::kErrorFrames));
  // Three samples fewer: a fraction of the 0.28 um by which one tap scatters.
  EXPECT_NEAR(result.contact_mm.value, before, 0.28e-3);
}

TEST(CleanSamples, RefusesWhatTheConverterDidInThePullBackAndNoticesTheRest) {
  const struct {
    FindingCode code;
    bool refused;
    TapDrawing drawing;
    void (*change)(RecordedTap&);
  } rows[] = {
      {FindingCode::kSpikes,
       true,
       {},
       [](RecordedTap& tap) {
         const std::size_t first = InCruise(tap);
         for (std::size_t k = 0; k < 30; ++k) {
           tap.drawn.force_g[first + 4 * k] += k % 2 == 0 ? 900.0 + static_cast<double>(k) : -1200;
         }
       }},
      {FindingCode::kStuckSamples, true, {}, [](RecordedTap& tap) { Stick(tap, InCruise(tap)); }},
      {FindingCode::kStuckSamples, false, {}, [](RecordedTap& tap) { Stick(tap, 20); }},
      {FindingCode::kSaturatedSamples, true, {.full_scale_g = 100}, [](RecordedTap&) {}},
      // Reached at the halt, no more after the press relaxed.
      {FindingCode::kSaturatedSamples,
       false,
       {.relaxed = 0.3},
       [](RecordedTap& tap) {
         for (double& force_g : tap.drawn.force_g) force_g = std::min(force_g, 130.0);
       }},
  };
  for (const auto& row : rows) {
    RecordedTap tap = Record(row.drawing, kSeed);
    row.change(tap);
    const TapAnalysis analysis = AnalyseTwoLine(tap.View());
    SCOPED_TRACE(Name(row.code));
    if (row.refused) {
      EXPECT_EQ(analysis.reason.code, row.code);
    } else {
      EXPECT_EQ(analysis.verdict, Verdict::kGood);
      EXPECT_TRUE(HasNotice(analysis, row.code));
    }
  }
}

void Erase(RecordedTap& tap, std::size_t first, std::size_t count) {
  const auto from = static_cast<std::ptrdiff_t>(first);
  const auto to = from + static_cast<std::ptrdiff_t>(count);
  tap.drawn.time_s.erase(tap.drawn.time_s.begin() + from, tap.drawn.time_s.begin() + to);
  tap.drawn.force_g.erase(tap.drawn.force_g.begin() + from, tap.drawn.force_g.begin() + to);
}

TEST(CleanSamples, CountsDroppedSamplesAndRefusesOnlyABreakInAGap) {
  RecordedTap tap = Record({}, kSeed);
  Erase(tap, IndexAt(tap, tap.drawn.contact_time_s + 0.1), 10);
  EXPECT_EQ(Clean(tap).tap.dropped, 10U);
  EXPECT_EQ(AnalyseTwoLine(tap.View()).verdict, Verdict::kGood);
  EXPECT_TRUE(HasNotice(AnalyseTwoLine(tap.View()), FindingCode::kDroppedSamples));
  Erase(tap, IndexAt(tap, tap.drawn.contact_time_s) - 6, 12);
  EXPECT_EQ(ReasonOf(tap), FindingCode::kDroppedSamples);
}

TEST(CleanSamples, LeavesOutRepeatedTimesAndRefusesMany) {
  RecordedTap tap = Record({}, kSeed);
  const double before = AnalyseTwoLine(tap.View()).contact_mm.value;
  const auto repeat = [&tap](std::size_t at) {
    tap.drawn.time_s.insert(tap.drawn.time_s.begin() + static_cast<std::ptrdiff_t>(at),
                            tap.drawn.time_s[at]);
    tap.drawn.force_g.insert(tap.drawn.force_g.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                             tap.drawn.force_g[at]);
  };
  repeat(InCruise(tap));
  EXPECT_EQ(Clean(tap).tap.duplicated, 1U);
  EXPECT_NEAR(AnalyseTwoLine(tap.View()).contact_mm.value, before, 1e-9);
  for (std::size_t k = 0; k < 60; ++k) {
    repeat(InCruise(tap) + 2 * k);
  }
  EXPECT_EQ(ReasonOf(tap), FindingCode::kDuplicateTimes);
}

TEST(CleanSamples, LeavesOutValuesThatASlowConverterHolds) {
  for (const std::size_t in_turn : {2U, 4U}) {
    RecordedTap tap = Record({}, kSeed);
    EXPECT_EQ(Clean(tap).tap.held, 0U);
    auto& force_g = tap.drawn.force_g;
    for (std::size_t i = 0; i < force_g.size(); ++i) {
      force_g[i] = force_g[i - i % in_turn];
    }
    const Cleaned cleaned = Clean(tap);
    const double samples = static_cast<double>(cleaned.tap.samples.size());
    const double held = static_cast<double>(cleaned.tap.held);
    constexpr double kEnds = 2;  // a value may be cut by either end
    EXPECT_NEAR(held, samples * static_cast<double>(in_turn - 1),
                kEnds * static_cast<double>(in_turn));
    EXPECT_NEAR(cleaned.tap.held_s * static_cast<double>(in_turn), cleaned.tap.period_s, 1e-4);
    EXPECT_TRUE(HasNotice(AnalyseTwoLine(tap.View()), FindingCode::kHeldValues));
  }
}

TEST(CleanSamples, TakesNoCoarseStepsForHeldValues) {
  for (const double step_g : {0.2, 1.0, 5.0, 20.0}) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      RecordedTap tap = Record({}, kSeed + seed);
      for (double& force_g : tap.drawn.force_g) {
        force_g = step_g * std::round(force_g / step_g);
      }
      EXPECT_EQ(Clean(tap).tap.held, 0U) << step_g << " gf, seed " << seed;
    }
  }
}

TEST(CleanSamples, BearsWhatNobodyWouldRecord) {
  RecordedTap tap = Record({}, kSeed);
  std::fill(tap.drawn.force_g.begin(), tap.drawn.force_g.end(), 5.0);
  EXPECT_EQ(ReasonOf(tap), FindingCode::kNoContact);
  std::fill(tap.drawn.time_s.begin(), tap.drawn.time_s.end(), tap.drawn.contact_time_s);
  EXPECT_NE(AnalyseTwoLine(tap.View()).verdict, Verdict::kGood);
  tap = Record({}, kSeed);
  for (std::size_t i = 0; i < tap.drawn.force_g.size(); ++i) {
    tap.drawn.force_g[i] = i % 2 == 0 ? 1e12 : -1e12;
  }
  EXPECT_NE(AnalyseTwoLine(tap.View()).verdict, Verdict::kGood);
}

TEST(Hum, NamesMainsItsAmplitudeAndWhereItAppears) {
  const struct {
    double rate_hz, hum_hz, seen_hz;
    FindingCode code;
  } cases[] = {{320, 50, 50, FindingCode::kHum50Hz},
               {320, 60, 60, FindingCode::kHum60Hz},
               {320, 100, 100, FindingCode::kHum100Hz},
               {320, 120, 120, FindingCode::kHum120Hz},
               {80, 50, 30, FindingCode::kHum50Hz}};
  for (const auto& item : cases) {
    TapDrawing drawing;
    drawing.rate_hz = item.rate_hz;
    drawing.pull_back_mm_s = item.rate_hz < 100 ? 0.1 : 0.32;
    drawing.hum_g = 5;
    drawing.hum_hz = item.hum_hz;
    const TapAnalysis result = AnalyseTwoLine(Record(drawing, kSeed).View());
    bool found = false;
    for (const Finding& notice : result.Notices()) {
      if (notice.code == item.code) {
        found = true;
        // An amplitude from n samples scatters by noise sqrt(2 / n), and the departure's line and
        // leakage of a window of some periods take a tenth.
        EXPECT_NEAR(notice.figure, 5, 1.0) << item.hum_hz;
        EXPECT_NEAR(notice.limit, item.seen_hz, 0.1) << item.hum_hz;
      }
    }
    EXPECT_TRUE(found) << item.hum_hz << " Hz at " << item.rate_hz << " samples/s";
  }
}

TEST(Hum, IsSeldomHeardInNoise) {
  int heard = 0;
  constexpr int kTaps = 1000;
  for (std::uint64_t seed = 0; seed < kTaps; ++seed) {
    const Cleaned cleaned = Clean(Record({}, seed));
    const TapLines lines = FindTapLines(cleaned.tap, cleaned.motion);
    heard += FindHum(cleaned.tap.samples, lines.break_at, lines.departure_end, lines.departure,
                     cleaned.tap.period_s)
                 .mains_hz > 0;
  }
  EXPECT_LE(heard, 2);  // 0.1 expected
}

}  // namespace
}  // namespace trammel::tap
