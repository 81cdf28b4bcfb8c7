#include "measurement/due.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::measurement {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kNow = "2026-06-01T12:00:00Z";
constexpr double kAge_days = 90;

Series MeasuredAt(const char* utc) {
  Series series;
  series.last_good_utc = utc;
  return series;
}

TEST(Due, IsAnAnswerOfThatAge) {
  EXPECT_THAT(ReasonsToMeasure(MeasuredAt("2026-05-22T12:00:01Z"), kNow, 10), IsEmpty());
  EXPECT_THAT(ReasonsToMeasure(MeasuredAt("2026-05-22T12:00:00Z"), kNow, 10),
              ElementsAre(HasSubstr("10 days old, of 10")));
  EXPECT_THAT(ReasonsToMeasure(MeasuredAt("2026-02-28T00:00:00Z"), "2026-03-01T00:00:00Z", 1),
              ElementsAre(HasSubstr("1 days old")));
}

TEST(Due, IsWhatChangedUnlessTheNewValueIsInForce) {
  Series series = MeasuredAt("2026-05-31T00:00:00Z");
  EXPECT_THAT(ReasonsToMeasure(series, kNow, kAge_days), IsEmpty());
  series.changed = true;
  EXPECT_THAT(ReasonsToMeasure(series, kNow, kAge_days), ElementsAre(HasSubstr("differs")));
  series.applied = true;
  EXPECT_THAT(ReasonsToMeasure(series, kNow, kAge_days), IsEmpty());
}

TEST(Due, IsWhatWasMeasuredWithTheNozzleBefore) {
  Series series = MeasuredAt("2026-05-31T00:00:00Z");
  series.nozzle_utc = "1970-01-01T00:00:10Z";  // whatever the clock made of it
  series.last_reason = "the line was torn";
  EXPECT_THAT(ReasonsToMeasure(series, kNow, kAge_days),
              ElementsAre(HasSubstr("nozzle was changed"), HasSubstr("the line was torn")));
}

TEST(Due, IsWhatNeverHadAnAnswer) {
  Series series;
  series.last_reason = "too dark";
  EXPECT_THAT(ReasonsToMeasure(series, kNow, kAge_days), ElementsAre("no answer yet: too dark"));
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
