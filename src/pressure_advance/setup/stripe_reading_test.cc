#include "pressure_advance/setup/stripe_reading.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/setup/setup_pictures_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;
using testing::StripePicture;

StripeReading Read(const StripePicture& picture, std::uint64_t seed = 1) {
  Random random(seed);
  const Frame frame = picture.Draw(random);
  vision::LaserLineWorkspace workspace;
  return ReadStripe(frame.view(), StripeRunsDown(frame.view()), workspace);
}

TEST(ReadStripe, IsExactWithoutNoise) {
  // Rounded grey levels in 240 rows of a stripe; the width's bias is the profile's half-pixel bins.
  constexpr double kRounding_px = 0.02, kWidth = 0.02;
  for (const bool down : {true, false}) {
    for (const double slope : {-0.15, -0.02, 0.0, 0.05, 0.12}) {
      for (const double sigma_px : {1.5, 2.5, 4.0, 7.0}) {
        StripePicture picture;
        picture.down = down, picture.slope = slope, picture.sigma_px = sigma_px;
        picture.at_middle_px = down ? 171.3 : 131.3;
        const StripeReading stripe = Read(picture);
        const std::string where = std::to_string(slope) + ", " + std::to_string(sigma_px) + " px";
        ASSERT_EQ(stripe.fault, "") << where;
        EXPECT_EQ(stripe.down, down) << where;
        EXPECT_NEAR(stripe.at_middle_px, picture.at_middle_px, kRounding_px) << where;
        EXPECT_NEAR(stripe.slope, slope, 2 * kRounding_px / 240) << where;
        const double middle_px = down ? 159.5 : 119.5;
        EXPECT_NEAR(stripe.across_px, (picture.at_middle_px - middle_px) / std::hypot(1.0, slope),
                    kRounding_px)
            << where;
        EXPECT_NEAR(stripe.width_px / sigma_px, 1, kWidth) << where;
      }
    }
  }
}

TEST(ReadStripe, StatesTheScatterThatItHas) {
  constexpr int kDraws = 100;
  double squares = 0, stated = 0;
  std::vector<double> widths;
  double stated_width = 0;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    StripePicture picture;
    picture.noise = 3, picture.speckle = 0.3;
    const StripeReading stripe = Read(picture, seed);
    ASSERT_EQ(stripe.fault, "") << seed;
    squares += std::pow(stripe.at_middle_px - picture.at_middle_px, 2);
    stated += std::pow(stripe.across_sigma_px, 2);
    widths.push_back(stripe.width_px);
    stated_width += std::pow(stripe.width_sigma_px, 2);
  }
  const double place = std::sqrt(squares / stated);
  const double width = StandardDeviation(widths) / std::sqrt(stated_width / kDraws);
  std::printf("observed over stated: place %.2f (%.3f px rms), width %.2f (%.3f px)\n", place,
              std::sqrt(squares / kDraws), width, StandardDeviation(widths));
  // 100 normal values give a root mean square within 21 % (three sigma).
  for (const double ratio : {place, width}) {
    EXPECT_GT(ratio, 0.7);
    EXPECT_LT(ratio, 1.3);
  }
}

TEST(ReadStripe, LeavesOutABead) {
  StripePicture picture;
  picture.noise = 3, picture.bead_from = 100, picture.bead_to = 125;
  const StripeReading stripe = Read(picture);
  ASSERT_EQ(stripe.fault, "");
  constexpr double kNoise_px = 0.05;
  EXPECT_NEAR(stripe.at_middle_px, picture.at_middle_px, kNoise_px);
}

TEST(ReadStripe, NamesALaserThatIsNotThere) {
  StripePicture picture;
  picture.amplitude = 0, picture.noise = 3;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_THAT(Read(picture, seed).fault, HasSubstr("laser")) << seed;
  }
}

TEST(ReadStripe, NamesTooLittleLight) {
  StripePicture picture;
  picture.amplitude = 12, picture.noise = 0.5;
  EXPECT_THAT(Read(picture).fault, HasSubstr("too dark"));
}

TEST(ReadStripe, NamesOverexposure) {
  StripePicture picture;
  picture.amplitude = 50000, picture.sigma_px = 4;
  EXPECT_THAT(Read(picture).fault, HasSubstr("overexposed"));
}

TEST(ReadStripe, RefusesALineThatIsNotStraight) {
  StripePicture picture;
  picture.bend_px = 40, picture.noise = 3;
  EXPECT_THAT(Read(picture).fault, HasSubstr("not straight"));
}

TEST(ReadStripe, RefusesTinyPictures) {
  vision::LaserLineWorkspace workspace;
  for (const int size : {1, 8, 31}) {
    const Frame frame(size, size);
    EXPECT_THAT(ReadStripe(frame.view(), true, workspace).fault, HasSubstr("too small")) << size;
  }
  const Frame smallest(32, 32);
  EXPECT_NE(ReadStripe(smallest.view(), false, workspace).fault, "");
}

}  // namespace
}  // namespace trammel::pressure_advance
