#include "pressure_advance/setup/stripe_reading.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

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

TEST(ReadStripe, LeavesOutABead) {
  StripePicture picture;
  picture.noise = 3, picture.bead_from = 100, picture.bead_to = 125;
  const StripeReading stripe = Read(picture);
  ASSERT_EQ(stripe.fault, "");
  constexpr double kNoise_px = 0.05;
  EXPECT_NEAR(stripe.across_px, (picture.at_middle_px - 159.5) / std::hypot(1.0, stripe.slope),
              kNoise_px);
}

TEST(ReadStripe, NamesWhyAPictureShowsNoStripe) {
  struct Row {
    const char* fault;
    StripePicture picture;
  };
  for (const Row& row : {Row{"laser", {.amplitude = 0, .noise = 3}},
                         Row{"too dark", {.amplitude = 12, .noise = 0.5}},
                         Row{"overexposed", {.sigma_px = 4, .amplitude = 50000}},
                         Row{"not straight", {.noise = 3, .bend_px = 40}}}) {
    for (std::uint64_t seed = 1; seed <= (row.picture.amplitude > 0 ? 1 : 20); ++seed) {
      EXPECT_THAT(Read(row.picture, seed).fault, HasSubstr(row.fault)) << seed;
    }
  }
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
