#include "pressure_advance/report/setup_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace trammel::report {
namespace {

namespace pa = pressure_advance;
using ::testing::HasSubstr;
using ::testing::Not;

Measured Known(double value) { return Measured::Good({value, 0.01, {value - 0.02, value + 0.02}}); }

struct MadeUp {
  pa::SetupObservations seen;
  pa::SetupResult result;
  pa::MarkPlan mark;
  Frame lit, laser;

  MadeUp() : lit(64, 48), laser(64, 48) {
    seen.picture = {64, 48};
    seen.height_mm = 17.5;
    for (int i = 0; i < 12; ++i) {
      pa::PlacedStripe stripe;
      stripe.head.z_mm = 15 + 0.5 * i;
      stripe.head.from_z = i % 2 == 0 ? 1 : -1;
      stripe.reading.across_px = 3.0 * i;
      stripe.reading.at_middle_px = 40;
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
    view.lit = &lit;
    view.laser = &laser;
    view.section = "[camera]\noffset_x = 28.123\n";
    view.facts = {{"printer", "<b>voron</b>"}};
    return view;
  }
};

TEST(SetupReport, TellsTheValuesWithTheirIntervalsAndTheLinesToWrite) {
  const MadeUp made;
  const SetupView view = made.View();
  const auto figure = SetupFigure(view);
  ASSERT_TRUE(figure);
  const std::string page = SetupReport(view, figure);
  EXPECT_THAT(page, HasSubstr("28.123 mm"));
  EXPECT_THAT(page, HasSubstr("95 %: 28.103 to 28.143 mm"));
  EXPECT_THAT(page, HasSubstr("offset_x = 28.123"));
  EXPECT_THAT(page, Not(HasSubstr("<b>voron</b>")));
}

TEST(SetupReport, NamesTheReasonInsteadOfLinesWhereTheVerdictIsNotGood) {
  MadeUp made;
  made.result.scale.px_per_mm = Measured::Refused("the camera's mount is loose");
  SetupView view = made.View();
  view.section.clear();
  const std::string page = SetupReport(view, SetupFigure(view));
  EXPECT_THAT(page, HasSubstr("the camera&#39;s mount is loose"));
  EXPECT_THAT(page, Not(HasSubstr("offset_x =")));
  const auto json = JsonOfSetup(view);
  EXPECT_EQ(json["verdict"], "refused");
  EXPECT_TRUE(json["values"]["px_per_mm"]["value"].is_null());
  EXPECT_EQ(json["values"]["focus_height_mm"]["value"], 17.5);
}

TEST(SetupReport, JsonHasAnglesInDegreesAndEveryReading) {
  const MadeUp made;
  const auto json = JsonOfSetup(made.View());
  EXPECT_NEAR(json["values"]["laser_angle_deg"]["value"].get<double>(), 40.107, 1e-3);
  EXPECT_EQ(json["stripes"].size(), 12U);
  EXPECT_EQ(json["crop_px"]["width"], 20);
}

TEST(SetupReport, APageIsMadeOfWhateverWasSeen) {
  MadeUp made;
  made.seen.stripes.clear();
  made.lit = made.laser = Frame();
  const SetupView view = made.View();
  EXPECT_FALSE(SetupFigure(view));
  EXPECT_THAT(SetupReport(view, {}), HasSubstr("</html>"));
}

}  // namespace
}  // namespace trammel::report
