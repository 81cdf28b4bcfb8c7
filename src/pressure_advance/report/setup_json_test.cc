#include "pressure_advance/report/setup_json.h"

#include <gtest/gtest.h>

#include <string>

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

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
