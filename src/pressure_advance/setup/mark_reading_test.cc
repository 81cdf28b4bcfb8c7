#include "pressure_advance/setup/mark_reading.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "pressure_advance/setup/setup_pictures_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;
using testing::MarkPicture;

constexpr double kDegree = std::numbers::pi / 180;
constexpr MarkShape kShape{6, 0.5};

MarkReading Read(const MarkPicture& picture, std::uint64_t seed = 1) {
  Random random(seed);
  const Frame frame = picture.Draw(random);
  return ReadMark(frame.view(), kShape);
}

TEST(ReadMark, IsExactOnSharpPicturesOfAnyTurnScaleAndBrightness) {
  // Grey levels are rounded by 0.29 (rms) of a contrast of 14; along an upright side all sections
  // share that: sqrt(sum of 30 distances squared) * 0.29 / (14 * 10 px of bead) per side.
  constexpr double kRounding_px = 0.1;
  for (const double turn_deg : {-44.0, -20.0, -3.0, 0.0, 1.5, 10.0, 30.0}) {
    for (const double px_per_mm : {8.0, 20.0, 32.0}) {
      for (const bool darker : {true, false}) {
        MarkPicture picture;
        picture.turn_rad = turn_deg * kDegree;
        picture.px_per_mm = px_per_mm;
        if (!darker) picture.plate = 60, picture.bead = 180;
        picture.column_px = 331.37, picture.row_px = 176.61;
        const MarkReading mark = Read(picture);
        const std::string where =
            std::to_string(turn_deg) + " deg, " + std::to_string(px_per_mm) + " px/mm";
        ASSERT_EQ(mark.fault, "") << where;
        EXPECT_NEAR(mark.column_px, picture.column_px, kRounding_px) << where;
        EXPECT_NEAR(mark.row_px, picture.row_px, kRounding_px) << where;
        EXPECT_NEAR(mark.side_px, 6 * px_per_mm, 2 * kRounding_px) << where;
        EXPECT_NEAR(mark.turn_rad, picture.turn_rad, 2 * kRounding_px / (6 * px_per_mm)) << where;
        EXPECT_EQ(mark.darker, darker) << where;
      }
    }
  }
}

TEST(ReadMark, StatesTheScatterThatItHas) {
  double squares = 0, stated = 0;
  constexpr int kDraws = 60;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    MarkPicture picture;
    picture.turn_rad = 2 * kDegree;
    picture.noise = 4, picture.grain = 2, picture.waviness_mm = 0.02, picture.slope = 8;
    const MarkReading mark = Read(picture, seed);
    ASSERT_EQ(mark.fault, "") << seed;
    squares +=
        std::pow(mark.column_px - picture.column_px, 2) + std::pow(mark.row_px - picture.row_px, 2);
    stated += 2 * mark.sigma_px * mark.sigma_px;
  }
  const double ratio = std::sqrt(squares / stated);
  std::printf("observed over stated: %.2f, %.3f px rms\n", ratio, std::sqrt(squares / 2 / kDraws));
  // 120 normal values give a root mean square within 20 % (three sigma).
  EXPECT_GT(ratio, 0.6);
  EXPECT_LT(ratio, 1.3);
}

TEST(ReadMark, BearsABrokenSide) {
  MarkPicture picture;
  picture.gap_mm = 1;
  const MarkReading mark = Read(picture);
  ASSERT_EQ(mark.fault, "");
  constexpr double kBroken_px = 0.1;  // the gap's two edges are blurred into it
  EXPECT_NEAR(mark.column_px, picture.column_px, kBroken_px);
  EXPECT_NEAR(mark.row_px, picture.row_px, kBroken_px);
}

TEST(ReadMark, NamesWhyAPictureShowsNoMark) {
  struct Row {
    const char* fault;
    MarkPicture picture;
  };
  for (const Row& row :
       {Row{"too dark", {.plate = 2, .bead = 2, .noise = 1}},
        Row{"overexposed", {.plate = 300, .bead = 280}}, Row{"no square", {.longer = 1.12}},
        Row{"no square mark", {.longer = 1.5}}, Row{"", {.column_px = 20}},
        Row{"", {.column_px = 55}}, Row{"", {.column_px = 590}},
        Row{"no square mark", {.plate = 24, .bead = 24, .noise = 4, .grain = 3, .slope = 15}}}) {
    for (std::uint64_t seed = 1; seed <= (row.picture.grain > 0 ? 20 : 1); ++seed) {
      const std::string fault = Read(row.picture, seed).fault;
      EXPECT_NE(fault, "") << row.picture.column_px;
      EXPECT_THAT(fault, HasSubstr(row.fault)) << seed;
    }
  }
}

TEST(ReadMark, RefusesTinyPictures) {
  for (const int size : {1, 2, 31}) {
    const Frame frame(size, size);
    EXPECT_THAT(ReadMark(frame.view(), kShape).fault, HasSubstr("too small")) << size;
  }
  const Frame smallest(32, 32);
  EXPECT_NE(ReadMark(smallest.view(), kShape).fault, "");
}

}  // namespace
}  // namespace trammel::pressure_advance
