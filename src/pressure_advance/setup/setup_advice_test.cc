#include "pressure_advance/setup/setup_advice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::pressure_advance {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr PictureSize kPicture{1280, 720};

SetupAdvice OnStripe(const Exposure& exposure) {
  SetupResult result;
  result.exposure = exposure;
  return AdviseSetup(result, kPicture);
}

TEST(AdviseSetup, SaysHowTheStripeIsExposedAndWhatToDo) {
  EXPECT_THAT(OnStripe({180, 10, 0, 8}).lines, Contains(HasSubstr("well exposed")));
  EXPECT_THAT(OnStripe({240, 10, 3, 8}).lines, Contains(HasSubstr("shorten")));
  EXPECT_THAT(OnStripe({30, 10, 0, 8}).lines, Contains(HasSubstr("lengthen")));
}

TEST(AdviseSetup, TheThresholdIsHalfOfTheStripesHeightOverThePlate) {
  EXPECT_EQ(OnStripe({180, 10, 0, 8}).threshold, 100);
  EXPECT_FALSE(AdviseSetup({}, kPicture).threshold);
}

TEST(AdviseSetup, ACropThatThePictureCutsOffIsNamed) {
  SetupResult result;
  result.crop = PixelRect{1200, 300, 80, 100};
  EXPECT_THAT(AdviseSetup(result, kPicture).lines, Contains(HasSubstr("picture's edge")));
  result.crop = PixelRect{800, 300, 80, 100};
  EXPECT_THAT(AdviseSetup(result, kPicture).lines, IsEmpty());
}

TEST(AdviseSetup, ASheetThatStandsAskewIsNamedWhicheverAxisItRunsAlong) {
  for (const double turn_rad : {0.06, 0.06 + 1.5707963, -0.06}) {
    SetupResult result;
    result.laser_turn_rad = Measured::Good({turn_rad, 0.001, {turn_rad - 0.002, turn_rad + 0.002}});
    EXPECT_THAT(AdviseSetup(result, kPicture).lines, Contains(HasSubstr("3.4 degrees")))
        << turn_rad;
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
