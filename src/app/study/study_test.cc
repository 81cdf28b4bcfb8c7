// The study's values: files that read back, the paper's own numbers, sums that are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "app/study/study_figures.h"
#include "app/study/study_scan.h"
#include "app/study/study_summary.h"
#include "app/study/study_world.h"

namespace trammel::app {
namespace {

using ::testing::DoubleNear;
using ::testing::HasSubstr;

constexpr double kTight = 1e-9;  // sums of a few terms in double precision

// Ten lines whose deviation is a parabola about 40 ms and whose response crosses 0 at 36 ms.
StudyScan MadeUp(int pattern, double lowest_s) {
  StudyScan scan{.seed = 5, .condition = {}, .pattern = pattern};
  scan.truth_s = 0.035;
  for (int i = 0; i < 10; ++i) {
    const double p = 0.06 * i / 9;
    scan.pressure_advances_s.push_back(p);
    scan.score_px.push_back(30 + 4e4 * (p - lowest_s) * (p - lowest_s));
    scan.excess_s.push_back(0.036 - p);
  }
  scan.excess_s[3].reset();
  scan.response = Quantity{0.036, 0.001, {0.034, 0.038}};
  return scan;
}

TEST(StudyScan, ReadsBackWhatItWrote) {
  StudyScan scan = MadeUp(3, 0.04);
  scan.score_px[1].reset();
  const auto read = ParseStudyScan(FormatStudyScan(scan), "scan.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->pressure_advances_s, scan.pressure_advances_s);
  EXPECT_EQ(read->score_px, scan.score_px);
  EXPECT_EQ(read->excess_s, scan.excess_s);
  EXPECT_EQ(read->response->interval95.hi, 0.038);
  EXPECT_EQ(FormatStudyScan(*read), FormatStudyScan(scan));
}

TEST(StudyScan, KeepsTheReasonWhereThereIsNoAnswer) {
  StudyScan scan = MadeUp(0, 0.04);
  scan.response.reset();
  scan.reason = "too dark";
  const auto read = ParseStudyScan(FormatStudyScan(scan), "scan.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->response);
  EXPECT_EQ(read->reason, "too dark");
}

TEST(StudyScan, NamesWhatCannotBe) {
  StudyScan scan = MadeUp(0, 0.04);
  scan.score_px.pop_back();
  const auto lengths = ParseStudyScan(FormatStudyScan(scan), "scan.json");
  ASSERT_FALSE(lengths);
  EXPECT_THAT(lengths.error().message, HasSubstr("score_px has 9 values for 10 lines"));
  scan = MadeUp(0, 0.04);
  scan.response->interval95.hi = 0.035;
  const auto interval = ParseStudyScan(FormatStudyScan(scan), "scan.json");
  ASSERT_FALSE(interval);
  EXPECT_THAT(interval.error().message, HasSubstr("interval95_s does not hold response_s"));
  const auto condition = ParseStudyValidation(
      R"({"format": 1, "seed": 1, "condition": "gold", "pressure_advance_s": 0.03,
          "control_px": 90, "calibrated_px": 20})",
      "validation.json");
  ASSERT_FALSE(condition);
  EXPECT_THAT(condition.error().message, HasSubstr("matte-black-dark"));
}

TEST(StudyPaper, ItsCubicsHaveTheirMinimaWhereItSaysSo) {
  // Three digits of the coefficients move the minimum by less than this.
  constexpr double kDigits_s = 0.0015;
  for (const sim::Condition& condition : sim::AllConditions()) {
    const PaperFigures paper = PaperOf(condition);
    const auto& c = paper.cubic;
    const double slope = c[1] + paper.minimum_s * (2 * c[2] + paper.minimum_s * 3 * c[3]);
    const double curvature = 2 * c[2] + 6 * c[3] * paper.minimum_s;
    EXPECT_GT(curvature, 0) << sim::ToString(condition);
    EXPECT_LT(std::abs(slope / curvature), kDigits_s) << sim::ToString(condition);
  }
}

TEST(StudySummary, FindsTheCubicTheLineAndTheSharesOfMadeUpScans) {
  const StudySummary summary =
      Summarize({}, {MadeUp(0, 0.04), MadeUp(1, 0.04), MadeUp(2, 0.0533)}, std::nullopt);
  EXPECT_NEAR(summary.step_s, 0.06 / 9, kTight);
  ASSERT_EQ(summary.deviation.value_s.size(), 3U);
  EXPECT_NEAR(summary.deviation.value_s[2], 0.06 * 8 / 9, kTight);
  // The mean of 40, 40 and 53.3 ms is 44.4: the last is 8.9 away, a step is 6.7.
  EXPECT_EQ(summary.deviation.within_step, 2);
  EXPECT_EQ(summary.response.within_step, 3);
  EXPECT_EQ(summary.covered, 3);
  ASSERT_TRUE(summary.line);
  EXPECT_NEAR(*summary.line->zero_s, 0.036, kTight);
  EXPECT_NEAR(summary.line->slope, -1, kTight);
  EXPECT_NEAR(summary.line->r_squared, 1, kTight);
  EXPECT_THAT(summary.error_s, ::testing::Each(DoubleNear(0.001, kTight)));
}

TEST(StudySummary, ComparesItsCurveWithThePapersByTheirLargestFactor) {
  StudyScan scan = MadeUp(0, 0.04);
  const sim::Condition condition{sim::Plate::kPei, sim::Filament::kWhite, false};
  const PaperFigures paper = PaperOf(condition);
  for (std::size_t i = 0; i < scan.score_px.size(); ++i) {
    scan.score_px[i] =
        0.5 * CubicAt({paper.cubic.begin(), paper.cubic.end()}, scan.pressure_advances_s[i]);
  }
  constexpr double kFit = 1e-6;  // of a cubic through a cubic
  const StudySummary summary = Summarize(condition, {scan}, std::nullopt);
  ASSERT_TRUE(summary.curve_factor);
  EXPECT_NEAR(*summary.curve_factor, 2, kFit);
}

TEST(StudySummary, AScanThatWasRefusedCountsAndSaysNothing) {
  const StudyScan refused{.seed = 5, .condition = {}, .pattern = 0};
  const StudySummary summary = Summarize({}, {refused}, std::nullopt);
  EXPECT_EQ(summary.scans.size(), 1U);
  EXPECT_TRUE(summary.deviation.value_s.empty());
  EXPECT_FALSE(summary.curve_factor);
  EXPECT_FALSE(summary.line);
  EXPECT_THAT(SummaryText({summary}), HasSubstr("matte-black-dark"));
}

TEST(StudySummary, TheImprovementIsTheShareOfTheDeviationThatWent) {
  EXPECT_NEAR(*ImprovementOf({5, {}, 0.04, 100, 19.6}), 0.804, kTight);
  EXPECT_FALSE(ImprovementOf({5, {}, 0.04, 0, 0}));
}

TEST(StudyWorld, Prints162PatternsFor324Scans) {
  StudyOptions options;
  for (const sim::Condition& condition : sim::AllConditions()) {
    options.conditions.push_back(condition);
  }
  const std::vector<StudyPrint> prints = StudyPrints(options);
  EXPECT_EQ(prints.size(), 162U);
  // A shard has prints of all conditions: the pattern's number changes last.
  EXPECT_TRUE(std::is_sorted(prints.begin(), prints.end(),
                             [](const auto& a, const auto& b) { return a.pattern < b.pattern; }));
}

TEST(StudyFigures, HasFourFiguresWithAPanelForEachConditionEvenWithoutScans) {
  std::vector<StudySummary> summaries;
  for (const sim::Condition& condition : sim::AllConditions()) {
    summaries.push_back(Summarize(condition, {}, std::nullopt));
  }
  summaries[0] = Summarize(summaries[0].condition, {MadeUp(0, 0.04)}, std::nullopt);
  const auto figures = StudyFigures(summaries);
  ASSERT_EQ(figures.size(), 4U);
  for (const auto& figure : figures) {
    EXPECT_THAT(figure.canvas.ToSvg(), HasSubstr("PEI, white, dark")) << figure.name;
    EXPECT_TRUE(figure.narrow) << figure.name;
  }
  EXPECT_THAT(StudyPage(summaries, figures, 5), HasSubstr("Seed 5"));
}

}  // namespace
}  // namespace trammel::app
