#include "pressure_advance/report/analysis_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "base/json_text.h"
#include "pressure_advance/report/made_up_test_support.h"

namespace trammel::report {
namespace {

using nlohmann::json;
namespace pa = pressure_advance;

pressure_advance::Analysis Good() { return test::MakeAnalysis({}); }

TEST(AnalysisJson, ValueUncertaintyAndIntervalAreNullUnlessGood) {
  auto analysis = Good();
  for (const Measured& bad : {Measured::CannotTell("flat"), Measured::Refused("no laser line")}) {
    analysis.pressure_advance = bad;
    analysis.response.deceleration.pressure_advance = bad;
    const json root = JsonOf(analysis);
    for (const json* object : {&root, &root["deceleration"]}) {
      EXPECT_EQ((*object)["verdict"], ToString(bad.verdict()));
      EXPECT_EQ((*object)["reason"], bad.reason());
      EXPECT_TRUE((*object)["pressure_advance_s"].is_null());
      EXPECT_TRUE((*object)["standard_uncertainty_s"].is_null());
      EXPECT_TRUE((*object)["interval95_s"].is_null());
    }
  }
}

TEST(AnalysisJson, GivesHeightsAndAreasInMillimetresAsWellAsScaleAndAngleAreKnown) {
  auto analysis = Good();
  // Uncertainty by noise alone: a hundred readings of 0.008 mm and 0.004 mm^2.
  constexpr double kHeightNoise_mm = 1.2533 * 0.008 / 10, kAreaNoise_mm2 = 1.2533 * 0.004 / 10;
  const auto line = [&] { return JsonOf(analysis)["lines"][5]; };
  const double height_mm = line()["height_mm"]["value"], area_mm2 = line()["area_mm2"]["value"];
  EXPECT_NEAR(height_mm, 0.25, 0.01);
  EXPECT_NEAR(area_mm2, 0.11, 0.01);
  EXPECT_NEAR(line()["height_mm"]["standard_uncertainty"].get<double>(),
              std::hypot(kHeightNoise_mm, 0.01 * height_mm,
                         pressure_advance::kHeightReadingShare * height_mm),
              1e-6);
  EXPECT_NEAR(
      line()["area_mm2"]["standard_uncertainty"].get<double>(),
      std::hypot(kAreaNoise_mm2, 0.015 * area_mm2, pressure_advance::kAreaReadingShare * area_mm2),
      1e-6);
  EXPECT_EQ(JsonOf(analysis)["scale"]["area_standard_uncertainty"].get<double>(), 0.015);
  analysis.scale->height_share.reset();
  EXPECT_TRUE(line()["height_mm"]["standard_uncertainty"].is_null());
  EXPECT_TRUE(line()["height_mm"]["value"].is_number());
  analysis.scale.reset();
  EXPECT_TRUE(line()["height_mm"].is_null());
  EXPECT_TRUE(JsonOf(analysis)["scale"].is_null());
}

TEST(AnalysisJson, HasTheFlowRatioWithItsWordsAndPartsOrNull) {
  auto analysis = Good();
  const json flow = JsonOf(analysis)["flow_ratio"];
  EXPECT_EQ(flow["verdict"], "good");
  EXPECT_EQ(flow["value"], 1.031);
  EXPECT_EQ(flow["says"], "the printer lays 3.0 % too little: set the flow ratio to 1.031");
  EXPECT_EQ(flow["slow_area_read"]["lines"], 10);
  EXPECT_EQ(flow["fast_area_read"]["value"], 0.927);
  EXPECT_EQ(flow["budget"]["scale"], 0.005);
  analysis.flow->ratio = Measured::CannotTell("no scale");
  const json none = JsonOf(analysis)["flow_ratio"];
  EXPECT_TRUE(none["value"].is_null());
  EXPECT_TRUE(none["budget"].is_null());
  EXPECT_EQ(none["reason"], "no scale");
  analysis.flow.reset();
  EXPECT_TRUE(JsonOf(analysis)["flow_ratio"].is_null());
}

TEST(AnalysisJson, UnusedLinesAndMissingScoresAreNull) {
  auto analysis = Good();
  analysis.deviation.score_px[1].reset();
  analysis.deviation.r_squared.reset();
  analysis.response.acceleration.surplus_s.resize(
      5);  // shorter than the lines: the rest is unknown
  const json root = JsonOf(analysis);
  EXPECT_TRUE(root["acceleration"]["excess_s"][2].is_null());
  EXPECT_TRUE(root["acceleration"]["excess_s"][3].is_number());
  EXPECT_TRUE(root["acceleration"]["excess_s"][9].is_null());
  EXPECT_EQ(root["acceleration"]["excess_s"].size(), analysis.lines.size());
  EXPECT_TRUE(root["lines"][1]["deviation_px"].is_null());
  EXPECT_TRUE(root["deviation"]["r_squared"].is_null());
  EXPECT_TRUE(root["report"].is_null());
}

TEST(AnalysisJson, SurvivesNonFiniteNumbersAndBytesThatAreNotUtf8) {
  auto analysis = Good();
  analysis.deviation.score_px[0] = std::numeric_limits<double>::quiet_NaN();
  analysis.deviation.cubic[0] = std::numeric_limits<double>::infinity();
  analysis.notices = {"video \xff\xfe\"<b>"};
  const json root = json::parse(JsonText(JsonOf(analysis)));
  EXPECT_TRUE(root["lines"][0]["deviation_px"].is_null());
  EXPECT_TRUE(root["deviation"]["cubic"][0].is_null());
  EXPECT_EQ(root["notices"][0], "video \xEF\xBF\xBD\xEF\xBF\xBD\"<b>");
}

Measured Known(double value) { return Measured::Good({value, 0.01, {value - 0.02, value + 0.02}}); }

struct MadeUp {
  pa::SetupObservations seen;
  pa::SetupResult result;
  pa::MarkPlan mark;

  MadeUp() {
    seen.picture = {64, 48};
    seen.height_mm = 17.5;
    for (int i = 0; i < 12; ++i) {
      pa::PlacedStripe stripe;
      stripe.head.z_mm = 15 + 0.5 * i;
      stripe.head.from_z = i % 2 == 0 ? 1 : -1;
      stripe.reading.across_px = 3.0 * i;
      stripe.reading.width_px = 2;
      seen.stripes.push_back(stripe);
    }
    result.focus_mm = Known(17.5);
    result.offset = {Known(28.123), Known(50.456)};
    result.scale.px_per_mm = Known(41.5);
    result.height.px_per_height_mm = Known(35);
    result.scan_angle_rad = Known(0.7);
    result.crop = PixelRect{30, 10, 20, 20};
  }
  [[nodiscard]] SetupView View() const {
    SetupView view;
    view.seen = &seen;
    view.result = &result;
    view.mark = &mark;
    view.section = "[camera]\noffset_x = 28.123\n";
    view.facts = {{"printer", "<b>voron</b>"}};
    return view;
  }
};

TEST(SetupJson, NamesTheReasonWhereTheVerdictIsNotGood) {
  MadeUp made;
  made.result.scale.px_per_mm = Measured::Refused("the camera's mount is loose");
  const SetupView view = made.View();
  const auto json = JsonOfSetup(view);
  EXPECT_EQ(json["verdict"], "refused");
  EXPECT_EQ(json["reason"], "the camera's mount is loose");
  EXPECT_TRUE(json["values"]["px_per_mm"]["value"].is_null());
  EXPECT_EQ(json["values"]["focus_height_mm"]["value"], 17.5);
}

TEST(SetupJson, HasAnglesInDegreesAndEveryReading) {
  const MadeUp made;
  const auto json = JsonOfSetup(made.View());
  EXPECT_NEAR(json["values"]["laser_angle_deg"]["value"].get<double>(), 40.107, 1e-3);
  EXPECT_EQ(json["stripes"].size(), 12U);
  EXPECT_EQ(json["crop_px"]["width"], 20);
}

}  // namespace
}  // namespace trammel::report
