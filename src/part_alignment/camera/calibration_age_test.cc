#include "part_alignment/camera/calibration_age.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::part_alignment {
namespace {

using ::testing::HasSubstr;

TEST(CalibrationAge, AYearIsTrustedAndADayMoreIsNot) {
  EXPECT_FALSE(NoticeOfAge("2025-11-22", "2026-11-22"));
  EXPECT_THAT(NoticeOfAge("2025-11-21", "2026-11-22").value_or(""), HasSubstr("366 days"));
  EXPECT_FALSE(NoticeOfAge("2026-11-22", "2026-11-22", 0));
}

TEST(CalibrationAge, DatesThatCannotBeAreSaid) {
  EXPECT_THAT(NoticeOfAge("2026-11-23", "2026-11-22").value_or(""), HasSubstr("after today"));
  for (const char* date :
       {"", "2026-13-01", "2026-02-30", "22.11.2026", "2026-1-010", "20x6-01-01"}) {
    EXPECT_THAT(NoticeOfAge(date, "2026-11-22").value_or(""), HasSubstr("no date")) << date;
  }
}

}  // namespace
}  // namespace trammel::part_alignment
