// A page of made-up alignments; no claim about the estimator.
#include "part_alignment/report/alignment_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "document/parsers_test_support.h"

namespace trammel::report {
namespace {

using ::testing::AllOf;
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
  EXPECT_THAT(page, AllOf(HasSubstr("X\u00a01400.000, Y\u00a01000.000, Z\u00a0250.000\u00a0mm"),
                          HasSubstr("95 %: 1399.9608 to 1400.0392 mm"),
                          HasSubstr("G10 L2 P1 X1400.000000"), HasSubstr("&lt;b&gt;mind")));
}

TEST(AlignmentPage, ShowsWhatTheUncertaintyIsMadeOf) {
  const std::string page = AlignmentPage(Made(), {});
  EXPECT_THAT(page,
              AllOf(HasSubstr("eccentricity of the clamping"), HasSubstr("0.0210 mm, not stated"),
                    HasSubstr("the pictures alone"), HasSubstr(">0.0392<")));
}

TEST(AlignmentPage, NamesNoPlaceUnlessTheVerdictIsGood) {
  AlignmentOutput output = Made();
  output.alignment.verdict = Verdict::kCannotTell;
  output.alignment.reason = "the views <do not> tell";
  const std::string page = AlignmentPage(output, {});
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page, AllOf(HasSubstr("No place"), HasSubstr("&lt;do not&gt;"),
                          Not(HasSubstr("1400.0")), Not(HasSubstr("G10"))));
}

TEST(AlignmentPage, SaysACaptionOnceForAllViews) {
  std::vector<Figure> views;
  for (int i = 0; i < 3; ++i) {
    views.push_back(Figure{"view", "caption of a view", Canvas(20, 20), 1, "a view"});
  }
  const std::string page = AlignmentPage(Made(), views);
  const std::size_t first = page.find("caption of a view");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(page.find("caption of a view", first + 1), std::string::npos);
}

}  // namespace
}  // namespace trammel::report
