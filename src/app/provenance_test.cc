#include "app/provenance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace trammel::app {
namespace {

using ::testing::MatchesRegex;

TEST(Provenance, TimesAreUtcToTheSecond) {
  EXPECT_EQ(UtcOf(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(UtcOf(1767323045.9), "2026-01-02T03:04:05Z");
  EXPECT_EQ(UtcOf(253402300799), "9999-12-31T23:59:59Z");
}

TEST(Provenance, ATimeThatNoCalendarHasIsItsNumber) {
  EXPECT_EQ(UtcOf(-1), "-1");
  EXPECT_EQ(UtcOf(253402300800), "253402300800");
  EXPECT_EQ(UtcOf(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(UtcOf(std::numeric_limits<double>::quiet_NaN()), "nan");
}

TEST(Provenance, ARecordingIsNamedByInstrumentAndTime) {
  EXPECT_THAT(RecordingName(measurement::Instrument::kPartAlignment),
              MatchesRegex("part_alignment-[0-9]{8}T[0-9]{6}Z"));
}

}  // namespace
}  // namespace trammel::app
