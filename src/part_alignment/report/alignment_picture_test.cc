// What was found in a view and where the solution has it, and the scale that it is drawn at.
#include "part_alignment/report/alignment_picture.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>
#include <vector>

#include "document/parsers_test_support.h"
#include "document/plot.h"

namespace trammel::report {
namespace {

TEST(AlignmentPicture, PeopleReadViewsFromOne) {
  const Figure figure = AlignmentPicture(0, {}, 2592, 1944, {}, 500);
  EXPECT_EQ(figure.name, "view-01");
  EXPECT_EQ(AlignmentPicture(99, {}, 16, 16, {}, 500).name, "view-100");
}

TEST(AlignmentPicture, AnyTargetsAreDrawn) {
  const double infinite = std::numeric_limits<double>::infinity();
  const std::vector<DrawnTarget> targets = {
      {"found <1>", Eigen::Vector2d(100, 100), Eigen::Vector2d(100.02, 99.99), false, 0.03},
      {"left out", Eigen::Vector2d(1900, 100), Eigen::Vector2d(-1e9, 1e9), true, 1e6},
      {"where it should be", Eigen::Vector2d(500, 500), Eigen::Vector2d(500, 500), false, 0},
      {"missed", {}, Eigen::Vector2d(1000, 1000), false, 0},
      {"not projected", Eigen::Vector2d(1200, 1000), {}, false, 0},
      {"nowhere", Eigen::Vector2d(0, 0), Eigen::Vector2d(infinite, 0), false, infinite},
      {"neither", {}, {}, false, 0}};
  const Figure figure = AlignmentPicture(2, {}, 2592, 1944, targets, 2000);
  EXPECT_EQ(test::XmlProblem(figure.canvas.ToSvg()), "");
  const auto size = test::DecodePng(figure.canvas.ToPng(1));
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 800);
  ASSERT_TRUE(figure.narrow);
  EXPECT_EQ(figure.narrow->width_px(), kNarrowWidthPx);
  EXPECT_EQ(test::XmlProblem(figure.narrow->ToSvg()), "");
  // A tall picture leaves room for its key.
  EXPECT_EQ(AlignmentPicture(0, {}, 100, 2000, {}, 1).canvas.width_px(), 800);
}

TEST(AlignmentPicture, ResidualsOfTheRootMeanSquareAreDrawnAFewMillimetresLong) {
  constexpr int kWidth = 2592;
  constexpr int kHeight = 1944;
  constexpr double kPage_px = 800;  // the longer side on the page
  for (const double rms_px : {3e-4, 0.0025, 0.03, 0.7}) {
    const double length_px =
        rms_px * ResidualEnlargement(rms_px, kWidth, kHeight) * kPage_px / kWidth;
    EXPECT_GE(length_px, 10.8) << rms_px;
    EXPECT_LE(length_px, 27.1) << rms_px;
  }
  EXPECT_EQ(ResidualEnlargement(0, kWidth, kHeight), 1e6);
  EXPECT_EQ(ResidualEnlargement(1e9, kWidth, kHeight), 1);
  EXPECT_EQ(ResidualEnlargement(std::numeric_limits<double>::quiet_NaN(), kWidth, kHeight), 1);
}

TEST(ScaleKey, RoundsDownToOneTwoOrFive) {
  for (const auto& [most, rounded] :
       {std::pair{0.02, 0.02}, std::pair{0.0199, 0.01}, std::pair{7.3, 5.0}, std::pair{10.0, 10.0},
        std::pair{9.99e-13, 5e-13}, std::pair{1e300, 1e300}}) {
    EXPECT_DOUBLE_EQ(RoundedDown(most), rounded);
  }
}

}  // namespace
}  // namespace trammel::report
