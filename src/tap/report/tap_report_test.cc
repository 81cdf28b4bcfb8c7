// Reports on taps of which everything is made up; no claim about any method.
#include "tap/report/tap_report.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/random.h"
#include "document/parsers_test_support.h"
#include "tap/report/tap_text.h"
#include "tap/samples/finding.h"

namespace trammel::report {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

PlottedTap MakeTap(double z_mm, Random& random) {
  PlottedTap tap;
  tap.recording.name = "a & b <\xff>.json";
  tap.recording.moves = {{0, 1, 2, 0, 2 - 0.04, -1},
                         {1, 0, 0, 0, -0.04, 0},
                         {1.2, 0.001, 0, 300, -0.04, 1},
                         {1.201, 0.333, 0.3, 0, -0.03985, 1}};
  for (double t = 0.5; t < 1.8; t += 1.0 / 320) {
    const double z = t < 1.2 ? -0.04 : std::min(0.06, -0.04 + 0.3 * (t - 1.2));
    const double depth = t < 0.98 ? 0 : std::max(0.0, z_mm - z);
    tap.recording.time_s.push_back(t);
    tap.recording.force_g.push_back(3500 * depth + 2 * random.Normal());
  }
  tap.contact.verdict = Verdict::kGood;
  tap.contact.contact_mm = {z_mm, 0.0007, {z_mm - 0.0014, z_mm + 0.0014}};
  tap.contact.contact_time_s = 1.2 + (z_mm + 0.04) / 0.3;
  tap.contact.quality = 90;
  tap.contact.noise_g = 2;
  tap.contact.force = {true, -0.0399, 0.06, z_mm, 0, 0, {3500, 0, 0, 0}};
  tap.two_line.method = tap::Method::kTwoLine;
  tap.two_line.reason = {tap::FindingCode::kNoSamples, 3, 16};
  return tap;
}

TapReportInput InputOf(std::span<const PlottedTap> taps) {
  std::vector<tap::TapResult> results;
  std::vector<tap::TapView> views;
  for (const PlottedTap& tap : taps) {
    results.push_back({ContactOf(tap.contact), tap.contact.contact_time_s, 0, tap.recording.x_mm,
                       tap.recording.y_mm});
    views.push_back(tap.recording.View());
  }
  return {taps, tap::Summarise(results), tap::FindNoise(views), {}};
}

TEST(TapJson, HasTheKeysThatAreDocumentedAndNullWhereRefused) {
  Random random(1);
  const PlottedTap tap = MakeTap(-0.005, random);
  const json good = JsonOf(AnalysedTap{tap.recording, tap.contact, {}});
  EXPECT_EQ(good["verdict"], "good");
  EXPECT_EQ(good["reason"], "");
  EXPECT_EQ(good["contact_z_mm"], -0.005);
  EXPECT_EQ(good["interval95_mm"].size(), 2u);
  EXPECT_EQ(good["method"], "contact");
  const json refused = JsonOf(AnalysedTap{tap.recording, tap.two_line, {}});
  EXPECT_EQ(refused["verdict"], "refused");
  EXPECT_EQ(refused["reason_code"], "no_samples");
  for (const char* key :
       {"contact_z_mm", "standard_uncertainty_mm", "interval95_mm", "contact_time_s"}) {
    EXPECT_TRUE(refused.at(key).is_null()) << key;
  }
  for (const char* key : {"format", "quality", "points", "notices"}) {
    EXPECT_TRUE(good.contains(key)) << key;
  }
}

TEST(TapJson, AListKeepsTheOrderAndThePlaceOfAFileThatCannotBeRead) {
  Random random(1);
  const PlottedTap tap = MakeTap(-0.005, random);
  std::vector<AnalysedTap> taps = {{tap.recording, tap.contact, {}}, {{}, {}, "cut off"}};
  const json list = JsonOf(taps);
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[1]["verdict"], "refused");
  EXPECT_EQ(list[1]["reason"], "cut off");
  const json summary = JsonOf(taps, tap::Ensemble{});
  EXPECT_EQ(summary["taps"], list);
  EXPECT_TRUE(summary["ensemble"]["drift_with_time"].is_null());
}

TEST(TapReport, DrawsEveryFigureOfAMeshOfTaps) {
  Random random(2);
  std::vector<PlottedTap> taps;
  for (int i = 0; i < 9; ++i) {
    taps.push_back(MakeTap(-0.005 + 0.001 * i, random));
    taps.back().recording.x_mm = 50 + 40.0 * (i % 3);
    taps.back().recording.y_mm = 50 + 40.0 * (i / 3);
    taps.back().recording.firmware_z_mm = -0.004;
  }
  const TapReportInput input = InputOf(taps);
  std::vector<std::string> names;
  for (const Figure& figure : TapFigures(input, 1)) {
    names.push_back(figure.name);
    EXPECT_EQ(test::XmlProblem(figure.canvas.ToSvg()), "") << figure.name;
    EXPECT_TRUE(test::DecodePng(figure.canvas.ToPng())) << figure.name;
  }
  EXPECT_THAT(names, testing::ElementsAre("series", "mesh", "tap", "noise"));
}

TEST(TapReport, AMeshShowsWhereEveryTapWasRefused) {
  Random random(5);
  std::vector<PlottedTap> taps;
  for (int i = 0; i < 9; ++i) {
    taps.push_back(MakeTap(-0.005 + 0.001 * i, random));
    taps.back().recording.x_mm = 50 + 40.0 * (i % 3);
    taps.back().recording.y_mm = 50 + 40.0 * (i / 3);
  }
  const auto refused = [&taps] {
    const auto figure = MeshFigure(taps, InputOf(taps).ensemble);
    EXPECT_TRUE(figure);
    const std::string svg = figure->canvas.ToSvg();
    EXPECT_EQ(test::XmlProblem(svg), "");
    return svg;
  };
  const std::string all_good = refused();
  taps[4].contact.verdict = Verdict::kRefused;
  const std::string one_refused = refused();
  EXPECT_NE(one_refused, all_good);
  const PlottedTap again = taps[4];
  taps.push_back(again);
  EXPECT_EQ(refused(), one_refused) << "a place is shown once";
  taps.push_back(MakeTap(-0.001, random));
  taps.back().recording.x_mm = again.recording.x_mm;
  taps.back().recording.y_mm = again.recording.y_mm;
  EXPECT_NE(refused(), one_refused) << "one good tap makes a height";
}

TEST(TapReport, ANarrowMeshSaysTheHeightOfEveryPlace) {
  Random random(5);
  std::vector<PlottedTap> taps;
  for (int i = 0; i < 25; ++i) {
    taps.push_back(MakeTap(-0.03 + 0.0025 * i, random));
    taps.back().recording.x_mm = 20 + 50.0 * (i % 5);
    taps.back().recording.y_mm = 20 + 45.0 * (i / 5);
  }
  const tap::Ensemble ensemble = InputOf(taps).ensemble;
  const auto figure = MeshFigure(taps, ensemble);
  ASSERT_TRUE(figure && figure->narrow);
  const std::string svg = figure->narrow->ToSvg();
  double mean_mm = 0;
  for (const tap::Place& place : ensemble.places) mean_mm += place.z_mm.value / 25;
  for (const tap::Place& place : ensemble.places) {
    EXPECT_THAT(svg, HasSubstr(fmt::format(">{:+.1f}<", 1000 * (place.z_mm.value - mean_mm))));
  }
}

TEST(TapReport, IsWellFormedWhateverTheNamesHold) {
  Random random(3);
  const std::vector<PlottedTap> one = {MakeTap(-0.005, random)};
  EXPECT_EQ(test::XmlProblem(TapReport(InputOf(one))), "");
  EXPECT_THAT(TapReport(InputOf(one)), HasSubstr("a &amp; b &lt;"));
  std::vector<PlottedTap> many = {one[0], MakeTap(-0.004, random)};
  many[1].contact.verdict = Verdict::kRefused;
  EXPECT_EQ(test::XmlProblem(TapReport(InputOf(many))), "");
}

TEST(TapReport, HostileTapsAreShownAsFarAsTheyGo) {
  Random random(4);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  std::vector<PlottedTap> taps(7, MakeTap(-0.005, random));
  taps[0].recording = {};
  for (double& force : taps[1].recording.force_g) force = nan;
  for (double& time : taps[2].recording.time_s) time = inf;
  taps[3].recording.moves[3].start_velocity_mm_s = 1e300;
  taps[5].contact.force.break_z_mm = 1e300;
  taps[5].contact.noise_g = nan;
  taps[6].recording.time_s = {1, 1};
  taps[6].recording.force_g = {5, 5};
  for (const PlottedTap& tap : taps) {
    const Figure figure = TapFigure(tap);
    EXPECT_TRUE(test::DecodePng(figure.canvas.ToPng()));
    EXPECT_EQ(test::XmlProblem(figure.canvas.ToSvg()), "");
  }
  EXPECT_EQ(test::XmlProblem(TapReport(InputOf(taps))), "");
}

TEST(TapReport, NamesTheContactHeightFirst) {
  Random random(6);
  const std::vector<PlottedTap> one = {MakeTap(-0.00512345, random)};
  const std::string page = TapReport(InputOf(one));
  EXPECT_LT(page.find("Contact at -0.0051 mm"), page.find("<svg"));
  EXPECT_THAT(page, HasSubstr("95 %: -0.0065 to -0.0037 mm"));
  const std::vector<PlottedTap> many = {one[0], MakeTap(-0.004, random), MakeTap(-0.0045, random)};
  const std::string pages = TapReport(InputOf(many));
  EXPECT_LT(pages.find("Contact at -0.00"), pages.find("standard deviation"));
  EXPECT_THAT(pages, HasSubstr("Mean of 3 taps at one place"));
  // A table keeps its rows on a phone; the height stands above it.
  EXPECT_THAT(pages, HasSubstr(">mean step</td>"));
  EXPECT_THAT(pages, Not(HasSubstr("contact z")));
  const std::size_t explained = pages.find("Top: the whole tap");
  ASSERT_NE(explained, std::string::npos);
  EXPECT_EQ(pages.find("Top: the whole tap", explained + 1), std::string::npos);
  EXPECT_THAT(pages, HasSubstr("drawn as the first tap"));
}

TEST(TapReport, NamesOutliersWithoutTheRecordingsOfTheSummary) {
  Random random(7);
  std::vector<PlottedTap> taps;
  for (int i = 0; i < 9; ++i) taps.push_back(MakeTap(-0.005 + 1e-5 * i, random));
  taps.push_back(MakeTap(0.5, random));
  taps.back().recording.name = "far";
  TapReportInput input = InputOf(taps);
  input.ensemble.outliers = {9};
  EXPECT_THAT(TapReport(input), HasSubstr("too far from the others: far at 0.5000 mm"));
}

TEST(TapText, ATrendHasNoMoreDigitsThanItsIntervalKnows) {
  tap::Ensemble ensemble;
  ensemble.with_time = tap::Trend{{-5e-6, 1e-4, {-2e-4, 1.9e-4}}, false};
  EXPECT_THAT(
      EnsembleText(ensemble, {}),
      HasSubstr("drift with time   -0.3 µm per minute (95 %: -12.0 to +11.4 µm per minute), "
                "not significant\n"));
}

TEST(TapText, SaysAVerdictInWords) {
  Random random(5);
  PlottedTap tap = MakeTap(-0.005, random);
  tap.contact.verdict = Verdict::kCannotTell;
  const AnalysedTap analysed{tap.recording, tap.contact, {}};
  EXPECT_THAT(TapText(analysed), HasSubstr("verdict           cannot tell\n"));
  EXPECT_THAT(TapLine(analysed), HasSubstr(" cannot tell "));
}

TEST(TapText, NamesNoHeightWhereThereIsNone) {
  Random random(5);
  const PlottedTap tap = MakeTap(-0.00512345, random);
  const std::string good = TapText({tap.recording, tap.contact, {}});
  EXPECT_THAT(good, HasSubstr("-0.0051 mm (95 %: -0.0065 to -0.0037 mm)"));
  const std::string refused = TapText({tap.recording, tap.two_line, {}});
  EXPECT_THAT(refused, Not(HasSubstr("contact z")));
  EXPECT_THAT(refused, HasSubstr("because"));
}

}  // namespace
}  // namespace trammel::report
