#include "measurement/change.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/random.h"

namespace trammel::measurement {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Quantity Normal(double value, double u) { return {value, u, {value - 1.96 * u, value + 1.96 * u}}; }

Outcome Of(const Measured& value, const std::string& unit = "s") {
  Outcome outcome;
  outcome.answers = {{"pressure_advance", unit, value}};
  outcome.subject = {"printer.local", "0.40", "PLA"};
  return outcome;
}

TEST(Compare, GivesTheDifferenceWithBothUncertainties) {
  const auto changes =
      Compare(Of(Measured::Good(Normal(0.030, 0.003))), Of(Measured::Good(Normal(0.040, 0.004))));
  ASSERT_THAT(changes, SizeIs(1));
  const Quantity& difference = changes[0].difference.quantity();
  EXPECT_NEAR(difference.value, 0.010, 1e-12);
  EXPECT_NEAR(difference.standard_uncertainty, 0.005, 1e-12);
  EXPECT_NEAR(difference.interval95.lo, 0.010 - 1.96 * 0.005, 1e-12);
  EXPECT_TRUE(changes[0].differs());
  EXPECT_FALSE(
      Compare(Of(Measured::Good(Normal(0.030, 0.004))), Of(Measured::Good(Normal(0.040, 0.004))))[0]
          .differs());
}

TEST(Compare, KeepsIntervalsThatLieAslant) {
  // The value before may be much larger, the one after much larger: each widens its own side.
  const Measured before = Measured::Good({10, 1, {9, 14}});
  const Measured after = Measured::Good({20, 1, {18, 23}});
  const Quantity difference = Compare(Of(before), Of(after))[0].difference.quantity();
  EXPECT_NEAR(difference.interval95.lo, 10 - std::hypot(2, 4), 1e-12);
  EXPECT_NEAR(difference.interval95.hi, 10 + std::hypot(3, 1), 1e-12);
}

TEST(Compare, LeavesOutOtherUnitsAndSaysWhichValueIsNotGood) {
  const Measured good = Measured::Good(Normal(1, 0.1));
  EXPECT_THAT(Compare(Of(good, "s"), Of(good, "ms")), IsEmpty());
  const auto changes = Compare(Of(Measured::Refused("no line was found")), Of(good));
  ASSERT_THAT(changes, SizeIs(1));
  EXPECT_FALSE(changes[0].differs());
  EXPECT_THAT(changes[0].difference.reason(), HasSubstr("before is refused: no line was found"));
}

TEST(Drift, AsksForThreeGoodEarlierResults) {
  const Outcome one = Of(Measured::Good(Normal(1, 0.1)));
  EXPECT_THAT(Drift(std::vector{one, one, Of(Measured::CannotTell("too little light"))}, one),
              IsEmpty());
  EXPECT_THAT(Drift(std::vector{one, one, one}, one), SizeIs(1));
  EXPECT_THAT(Drift(std::vector{one, one, one}, Of(Measured::Refused("torn"))), IsEmpty());
}

TEST(Drift, KnowsSubjectsByAllThatIsNotedOfThem) {
  const Outcome one = Of(Measured::Good(Normal(1, 0.1)));
  Outcome other = one;
  EXPECT_TRUE(SameSubject(one, other));
  other.subject.nozzle = "0.60";
  EXPECT_FALSE(SameSubject(one, other));
  Outcome nameless = one;
  nameless.subject.filament.clear();
  EXPECT_FALSE(SameSubject(nameless, nameless));
  nameless.provenance.instrument = Instrument::kToolOffset;
  EXPECT_TRUE(SameSubject(nameless, nameless));
  Outcome unknown = one;
  unknown.subject = {};
  EXPECT_FALSE(SameSubject(unknown, unknown));
}

TEST(Drift, TakesNoOtherToolheadOrTemperatureForTheSame) {
  Outcome one = Of(Measured::Good(Normal(1, 0.1)));
  one.subject.toolhead = "extruder";
  one.subject.nozzle_c = "215";
  Outcome other = one;
  other.subject.spool = "18";
  other.subject.bed_c = "65";
  EXPECT_TRUE(SameSubject(one, other)) << "another spool is what drift is looked for in";
  other.subject.toolhead = "extruder1";
  EXPECT_FALSE(SameSubject(one, other));
  other.subject.toolhead = {};
  EXPECT_TRUE(SameSubject(one, other)) << "it is not noted";
  other.subject.nozzle_c = "230";
  EXPECT_FALSE(SameSubject(one, other));
}

/// The share of results called different though nothing changed, whether results scatter by more
/// than they state or not, and, without that, the share
/// where the value changed by ten standard uncertainties.
struct Called {
  double falsely = 0;
  double rightly = 0;
};

Called Try(std::size_t earlier, double beyond_stated, std::uint64_t seed) {
  constexpr int kDraws = 2000;
  constexpr double kU = 0.001;
  Random random(seed);
  const auto draw = [&](double truth) {
    const double value = truth + kU * random.Normal() + beyond_stated * kU * random.Normal();
    return Of(Measured::Good(Normal(value, kU)));
  };
  Called called;
  for (int i = 0; i < kDraws; ++i) {
    std::vector<Outcome> before;
    for (std::size_t k = 0; k < earlier; ++k) before.push_back(draw(0.04));
    const Outcome same = draw(0.04);
    called.falsely += Drift(before, same)[0].differs() ? 1.0 / kDraws : 0;
    if (beyond_stated > 0) continue;
    called.rightly += Drift(before, draw(0.04 + 10 * kU))[0].differs() ? 1.0 / kDraws : 0;
  }
  return called;
}

TEST(Drift, IsCalledFalselyAtMostOnceInTwenty) {
  // Three standard deviations of a share of 2000 draws about 0.05.
  constexpr double kMax = 0.05 + 3 * 0.0049;
  std::uint64_t seed = 4100;
  for (const std::size_t earlier : {3, 10}) {
    for (const double beyond_stated : {0.0, 1.0, 10.0}) {
      const Called called = Try(earlier, beyond_stated, ++seed);
      EXPECT_LE(called.falsely, kMax) << earlier << " results, scatter " << beyond_stated;
      if (beyond_stated == 0) {
        EXPECT_GE(called.rightly, earlier == 3 ? 0.8 : 0.99)
            << earlier << " results, scatter " << beyond_stated;
      }
    }
  }
}

/// Ten quantities about the same values, and `moved` of them by a shift.
Outcome TenOf(Random& random, int moved, double shift) {
  constexpr int kQuantities = 10;
  Outcome outcome;
  for (int i = 0; i < kQuantities; ++i) {
    const double value = random.Normal() + (i < moved ? shift : 0);
    outcome.answers.push_back(
        {"offset_" + std::to_string(i), "mm", Measured::Good(Normal(value, 1))});
  }
  return outcome;
}

TEST(Drift, IsCalledFalselyAtMostOnceInTwentyHoweverManyQuantitiesThereAre) {
  const auto any = [](const std::vector<Change>& changes) {
    return std::ranges::any_of(changes, [](const Change& change) { return change.differs(); });
  };
  constexpr int kSeries = 200;
  constexpr double kMax = 0.05 + 2 * 0.0154;  // and twice its scatter
  Random random(20261126);
  for (const int results : {3, 10}) {
    int alarms = 0;
    int found = 0;
    for (int i = 0; i < kSeries; ++i) {
      std::vector<Outcome> earlier;
      for (int k = 0; k < results; ++k) earlier.push_back(TenOf(random, 0, 0));
      alarms += any(Drift(earlier, TenOf(random, 0, 0))) ? 1 : 0;
      found += any(Drift(earlier, TenOf(random, 1, 40))) ? 1 : 0;
    }
    EXPECT_LE(alarms, kMax * kSeries) << results;
    EXPECT_GE(found, 0.9 * kSeries) << results;
  }
}

using ::testing::ElementsAre;

constexpr const char* kNow = "2026-06-01T12:00:00Z";
constexpr double kAge_days = 90;

Series MeasuredAt(const char* utc) { return {.last_good_utc = utc}; }

TEST(Due, IsAnAnswerOfThatAge) {
  EXPECT_THAT(ReasonsToMeasure(MeasuredAt("2026-05-22T12:00:01Z"), kNow, 10), IsEmpty());
  EXPECT_THAT(ReasonsToMeasure(MeasuredAt("2026-05-22T12:00:00Z"), kNow, 10),
              ElementsAre(HasSubstr("10 days old, of 10")));
  EXPECT_THAT(ReasonsToMeasure(MeasuredAt("2026-02-28T00:00:00Z"), "2026-03-01T00:00:00Z", 1),
              ElementsAre(HasSubstr("1 days old")));
}

TEST(Due, IsWhatChangedUnlessItIsInForceAndWhatHadNoAnswerOrAnotherNozzle) {
  constexpr const char* kFresh = "2026-05-31T00:00:00Z";
  const auto reasons = [](const Series& series) {
    return ReasonsToMeasure(series, kNow, kAge_days);
  };
  EXPECT_THAT(reasons(MeasuredAt(kFresh)), IsEmpty());
  EXPECT_THAT(reasons({.last_good_utc = kFresh, .changed = true}),
              ElementsAre(HasSubstr("differs")));
  EXPECT_THAT(reasons({.last_good_utc = kFresh, .changed = true, .applied = true}), IsEmpty());
  EXPECT_THAT(reasons({.last_good_utc = kFresh,
                       .last_reason = "the line was torn",
                       .nozzle_utc = "1970-01-01T00:00:10Z"}),  // whatever the clock made of it
              ElementsAre(HasSubstr("nozzle was changed"), HasSubstr("the line was torn")));
  EXPECT_THAT(reasons({.last_reason = "too dark"}), ElementsAre("no answer yet: too dark"));
}

TEST(Due, TrustsNoClockThatIsWrong) {
  EXPECT_THAT(ReasonsToMeasure(MeasuredAt("2027-01-01T00:00:00Z"), kNow, kAge_days),
              ElementsAre(HasSubstr("clock")));
  for (const char* wrong : {"yesterday", "2026-01-01T00:00:00", "2026-01-01T00:00:00ZZ"}) {
    EXPECT_THAT(ReasonsToMeasure(MeasuredAt(wrong), kNow, kAge_days),
                ElementsAre(HasSubstr(std::string("'") + wrong)));
  }
}

}  // namespace

}  // namespace trammel::measurement
