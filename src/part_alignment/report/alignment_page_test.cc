// A page and pictures of made-up alignments; no claim about the estimator.
#include "part_alignment/report/alignment_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "document/parsers_test_support.h"
#include "document/plot.h"
#include "support/matchers.h"

namespace trammel::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace pa = part_alignment;

AlignmentOutput Made() {
  AlignmentOutput output;
  pa::Measurement& measurement = output.measurement;
  for (const auto& [id, x, y] : {std::tuple{"T1", -750.0, -500.0}, std::tuple{"T2", 750.0, -500.0},
                                 std::tuple{"T3 <&>", 750.0, 500.0}}) {
    measurement.targets.push_back({id, {x, y, 0}});
    pa::View view;
    view.spindle_mm = {1400 + x, 1000 + y, 300};
    view.observations.push_back({id, 100, 100, 0.03});
    measurement.views.push_back(view);
  }
  pa::Alignment& alignment = output.alignment;
  alignment.verdict = Verdict::kGood;
  alignment.machine_from_part = {{1400, 1000, 250}, {-0.001, -0.002, 0.003}};
  alignment.parameters = {"x_mm",     "y_mm",      "z_mm",           "alpha_rad",
                          "beta_rad", "gamma_rad", "clamp_angle_rad"};
  alignment.covariance = Eigen::MatrixXd::Identity(7, 7) * 1e-10;
  alignment.covariance.topLeftCorner<3, 3>() *= 4e6;  // 0.02 mm
  alignment.residuals = {{0, "T1", 0.01, -0.0001, 0.03, 1}, {1, "T2", 3, 3, 0.03, 0}};
  alignment.notices = {"<b>mind</b>"};
  output.contributions = {{"all", 0, false, {0.02, 0.02, 0.02}},
                          {"clamp_eccentricity_mm", 0.021, true, {0.001, 0.001, 0.02}},
                          {"pixels", 0, false, {0.0005, 0.0005, 0.0005}}};
  return output;
}

TEST(AlignmentPage, LeadsWithThePlaceItsIntervalsAndTheLinesForTheControl) {
  const std::string page = AlignmentPage(Made(), {});
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page, Containing("X\u00a01400.000, Y\u00a01000.000, Z\u00a0250.000\u00a0mm",
                               "95 %: 1399.9608 to 1400.0392 mm", "G10 L2 P1 X1400.000000",
                               "&lt;b&gt;mind"));
}

TEST(AlignmentPage, ShowsWhatTheUncertaintyIsMadeOf) {
  const std::string page = AlignmentPage(Made(), {});
  EXPECT_THAT(page, Containing("clamp eccentricity", "0.0210 mm, not stated", "the pictures alone",
                               ">0.0392<"));
}

TEST(AlignmentPage, NamesNoPlaceUnlessTheVerdictIsGood) {
  AlignmentOutput output = Made();
  output.alignment.verdict = Verdict::kCannotTell;
  output.alignment.reason = "the views <do not> tell";
  const std::string page = AlignmentPage(output, {});
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page, Containing("No place", "&lt;do not&gt;", Not(HasSubstr("1400.0")),
                               Not(HasSubstr("G10"))));
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

}  // namespace
}  // namespace trammel::report
