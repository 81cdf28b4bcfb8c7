#include "app/slow_work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::app {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::internal::CaptureStderr;
using ::testing::internal::GetCapturedStderr;

TEST(SlowWork, SaysWhatTakesLongAndSaysItAgain) {
  CaptureStderr();
  {
    const SlowWork work("reading the photo", 1ms, 1ms);
    std::this_thread::sleep_for(500ms);
  }
  const std::string said = GetCapturedStderr();
  EXPECT_THAT(said, StartsWith("  reading the photo\n"));
  EXPECT_THAT(said, HasSubstr("  reading the photo, 0 s so far\n"));
}

TEST(SlowWork, SaysNothingOfWhatIsDoneSooner) {
  CaptureStderr();
  { const SlowWork work("reading the photo", 1h, 1h); }
  EXPECT_EQ(GetCapturedStderr(), "");
}

}  // namespace
}  // namespace trammel::app
