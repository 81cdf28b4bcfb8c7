// Reports on a comparison of which everything is made up.
#include "tap/report/comparison_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "document/parsers_test_support.h"
#include "tap/report/comparison_json.h"
#include "tap/report/comparison_text.h"

namespace trammel::report {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

tap::MethodComparison Compared(std::size_t taps) {
  std::vector<tap::TwiceRead> read(taps);
  for (std::size_t i = 0; i < taps; ++i) {
    const double swing = std::sin(2.1 * static_cast<double>(i));
    read[i].two_line = {.good = true, .z_mm = 0.004 * swing, .standard_uncertainty_mm = 0.002};
    read[i].contact = {.good = true, .z_mm = 0.001 * swing, .standard_uncertainty_mm = 0.001};
  }
  return tap::CompareMethods(read);
}

TEST(ComparisonText, SaysTheConclusionFirstWithItsInterval) {
  EXPECT_THAT(ComparisonText(Compared(12)),
              AllOf(testing::StartsWith("better            contact repeats better"),
                    HasSubstr("contact / two-line 0.25 (95 %: "), HasSubstr("back-to-back"),
                    HasSubstr("12 compared, at 1 place;"), HasSubstr("say no place on the bed")));
}

TEST(ComparisonText, HasNoNumberWhereTapsAreTooFew) {
  EXPECT_THAT(ComparisonText(Compared(5)),
              AllOf(HasSubstr("cannot tell: 5 of 5 taps"), Not(HasSubstr("µm"))));
}

TEST(ComparisonJson, HasNullsExactlyWhereNothingIsTold) {
  const nlohmann::json good = JsonOf(Compared(12));
  EXPECT_EQ(good["verdict"], "good");
  EXPECT_EQ(good["better"], "contact");
  EXPECT_NEAR(good["ratio"]["value"].get<double>(), 0.25, 1e-9);
  EXPECT_EQ(good["two_line"]["deviation_mm"]["interval95"].size(), 2U);
  const nlohmann::json few = JsonOf(Compared(5));
  EXPECT_EQ(few["verdict"], "cannot_tell");
  EXPECT_EQ(few["better"], "cannot_tell");
  EXPECT_TRUE(few["ratio"]["value"].is_null());
  EXPECT_TRUE(few["contact"]["deviation_mm"]["interval95"].is_null());
  EXPECT_EQ(few["reason"], few["because"]);
}

TEST(ComparisonReport, DrawsBothMethodsAndEscapesNames) {
  const auto figure = ComparisonFigure(Compared(12));
  ASSERT_TRUE(figure);
  EXPECT_EQ(test::XmlProblem(figure->canvas.ToSvg()), "");
  EXPECT_EQ(test::XmlProblem(figure->narrow->ToSvg()), "");
  const std::string page = ComparisonReport(Compared(12), {"a & <b>.json"});
  EXPECT_THAT(page, AllOf(HasSubstr("a &amp; &lt;b&gt;.json"), HasSubstr("<svg"),
                          HasSubstr("contact repeats better")));
}

TEST(ComparisonReport, SaysWhyThereIsNoComparison) {
  EXPECT_FALSE(ComparisonFigure(tap::CompareMethods({})));
  EXPECT_THAT(ComparisonReport(tap::CompareMethods({}), {}),
              AllOf(HasSubstr("No comparison"), Not(HasSubstr("<svg"))));
}

}  // namespace
}  // namespace trammel::report
