// Reports on taps of which everything is made up; no claim about any method.
#include "tap/report/tap_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace trammel::report
