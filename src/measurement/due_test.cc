#include "measurement/due.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::measurement {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kNow = "2026-06-01T12:00:00Z";

Series MeasuredAt(const char* utc) {
  Series series;
  series.last_good_utc = utc;
  return series;
}

TEST(Due, ComesSoonAtFourFifthsOfTheAgeAndDueAtAllOfIt) {
  const DueRules rules{.age_days = 10, .soon = 0.8};
  EXPECT_EQ(JudgeDue(MeasuredAt("2026-05-24T12:00:01Z"), kNow, rules).need, Need::kNone);
  EXPECT_EQ(JudgeDue(MeasuredAt("2026-05-24T12:00:00Z"), kNow, rules).need, Need::kSoon);
  EXPECT_EQ(JudgeDue(MeasuredAt("2026-05-22T12:00:01Z"), kNow, rules).need, Need::kSoon);
  const Due due = JudgeDue(MeasuredAt("2026-05-22T12:00:00Z"), kNow, rules);
  EXPECT_EQ(due.need, Need::kDue);
  EXPECT_THAT(due.reasons, ElementsAre(HasSubstr("10 days old, of 10")));
}

TEST(Due, IsWhatChangedOrCreepsUnlessTheNewValueIsInForce) {
  Series series = MeasuredAt("2026-05-31T00:00:00Z");
  EXPECT_THAT(JudgeDue(series, kNow, {}).reasons, IsEmpty());
  series.changed = true;
  EXPECT_EQ(JudgeDue(series, kNow, {}).need, Need::kDue);
  series.applied = true;
  EXPECT_EQ(JudgeDue(series, kNow, {}).need, Need::kNone);
  series.creeps = true;
  EXPECT_EQ(JudgeDue(series, kNow, {}).need, Need::kDue);
}

TEST(Due, IsWhatWasMeasuredWithTheNozzleBefore) {
  Series series = MeasuredAt("2026-05-31T00:00:00Z");
  EXPECT_EQ(JudgeDue(series, kNow, {}).need, Need::kNone);
  series.nozzle_utc = "1970-01-01T00:00:10Z";  // whatever the clock made of it
  const Due due = JudgeDue(series, kNow, {});
  EXPECT_EQ(due.need, Need::kDue);
  EXPECT_THAT(due.reasons, ElementsAre(HasSubstr("nozzle was changed")));
}

TEST(Due, SaysTheWorstFirst) {
  Series series = MeasuredAt("2026-05-31T00:00:00Z");
  series.last_reason = "the line was torn";
  series.creeps = true;
  EXPECT_THAT(JudgeDue(series, kNow, {}).reasons,
              ElementsAre(HasSubstr("creep"), HasSubstr("no answer: the line was torn")));
}

TEST(Due, IsWhatNeverHadAnAnswer) {
  Series series;
  series.last_reason = "too dark";
  const Due due = JudgeDue(series, kNow, {});
  EXPECT_EQ(due.need, Need::kDue);
  EXPECT_THAT(due.reasons, ElementsAre("no answer yet: too dark"));
}

TEST(Due, TrustsNoClockThatIsWrong) {
  const Due future = JudgeDue(MeasuredAt("2027-01-01T00:00:00Z"), kNow, {});
  EXPECT_EQ(future.need, Need::kSoon);
  EXPECT_THAT(future.reasons, ElementsAre(HasSubstr("clock")));
  EXPECT_THAT(JudgeDue(MeasuredAt("yesterday"), kNow, {}).reasons,
              ElementsAre(HasSubstr("'yesterday'")));
}

TEST(Due, CountsDaysOverMonthsAndYears) {
  EXPECT_EQ(DaysBetween("2026-02-28T00:00:00Z", "2026-03-01T00:00:00Z"), 1);
  EXPECT_EQ(DaysBetween("2028-02-28T00:00:00Z", "2028-03-01T12:00:00Z"), 2.5);
  EXPECT_EQ(DaysBetween("2026-01-01T00:00:00Z", "2025-01-01T00:00:00Z"), -365);
  for (const char* wrong : {"", "2026-02-30T00:00:00Z", "2026-01-01T24:00:00Z",
                            "2026-01-01T00:00:00", "2026-1-01T00:00:00ZZ", "-026-01-01T00:00:00Z",
                            "2026-01-01T00:00:0xZ", "2026-01-01 00:00:00Z"}) {
    EXPECT_FALSE(DaysBetween(wrong, kNow)) << wrong;
  }
}

}  // namespace
}  // namespace trammel::measurement
