#include "app/stated_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/fake_printer.h"

namespace trammel::app {
namespace {

using files::Config;
using machine::PrinterFacts;
using settings::BedShape;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Config Parsed(const char* text) {
  auto config = files::ParseConfig(text, "trammel.toml");
  EXPECT_TRUE(config) << config.error().message;
  return *config;
}

/// A printer that states what the default settings take for granted.
PrinterFacts Usual() {
  PrinterFacts facts;
  facts.kinematics = "corexy";
  facts.extruder = "extruder";
  facts.reach = {{-2, -2, -5}, {255, 255, 250}};
  facts.max_velocity_mm_s = 300;
  facts.max_accel_mm_s2 = 5000;
  facts.nozzle_diameter_mm = 0.4;
  facts.filament_diameter_mm = 1.75;
  facts.advance_motors = {"extruder"};
  return facts;
}

TEST(StatedSettings, FilamentAndNozzleComeFromThePrinterWhereNobodySetThem) {
  PrinterFacts facts = Usual();
  facts.filament_diameter_mm = 2.85;
  facts.nozzle_diameter_mm = 0.6;
  Config config = Parsed("");
  EXPECT_THAT(TakeStated(facts, StatedFor::kPattern, config),
              ElementsAre("filament of 2.85 mm", "nozzle of 0.6 mm", HasSubstr("0.742 mm wide")));
  EXPECT_EQ(config.pattern.filament_diameter_mm, 2.85);
  EXPECT_EQ(config.pattern.nozzle_diameter_mm, 0.6);
  EXPECT_NEAR(config.pattern.line_width_mm, 0.7425, 1e-9);
  Config set = Parsed("[filament]\nfilament_diameter = 1.75\n[printer]\nnozzle_diameter = 0.4\n");
  EXPECT_THAT(TakeStated(facts, StatedFor::kPattern, set), IsEmpty());
  Config option = Parsed("");
  ASSERT_TRUE(files::OverrideConfig("nozzle_diameter=0.4", option));
  EXPECT_THAT(TakeStated(facts, StatedFor::kPrinter, option), ElementsAre("filament of 2.85 mm"));
}

TEST(StatedSettings, ADeltasBedIsRoundAndInTheMiddle) {
  PrinterFacts facts = Usual();
  facts.kinematics = "delta";
  facts.reach = {{-120, -120, -5}, {120, 120, 300}, true};
  Config config = Parsed("");
  EXPECT_THAT(TakeStated(facts, StatedFor::kPattern, config),
              Contains(HasSubstr("bed_shape = \"ellipse\"")));
  EXPECT_EQ(config.pattern.bed_shape, BedShape::kEllipse);
  EXPECT_EQ(config.pattern.bed_origin_x_mm, -120);
  EXPECT_EQ(config.pattern.bed_size_y_mm, 240);
  EXPECT_TRUE(Validate(config.pattern));
  const auto park = settings::ParkPositionOf(config.pattern);
  EXPECT_TRUE(facts.reach.Contains(park.x_mm, park.y_mm));
  Config sized = Parsed(
      "[printer]\nbed_size_x = 200\nbed_size_y = 200\nbed_origin_x = -100\n"
      "bed_origin_y = -100\n");
  (void)TakeStated(facts, StatedFor::kPattern, sized);
  EXPECT_EQ(sized.pattern.bed_shape, BedShape::kEllipse);
  EXPECT_EQ(sized.pattern.bed_size_x_mm, 200);
  Config wrong = Parsed("[printer]\nbed_shape = \"rectangle\"\n");
  (void)TakeStated(facts, StatedFor::kPattern, wrong);
  EXPECT_EQ(wrong.pattern.bed_shape, BedShape::kRectangle);  // the comparison refuses it
}

TEST(StatedSettings, ABedThatIsOutOfReachIsTakenFromTheReach) {
  struct Case {
    double low_mm, high_mm, origin_mm, size_mm;
  };
  for (const Case& c : {Case{0, 120, 0, 120}, Case{-5, 235, 0, 235}, Case{-110, 110, -110, 220},
                        Case{10, 200, 10, 190}, Case{0, 350, 0, 250}}) {
    PrinterFacts facts = Usual();
    facts.reach = {{c.low_mm, c.low_mm, 0}, {c.high_mm, c.high_mm, 250}};
    Config config = Parsed("");
    (void)TakeStated(facts, StatedFor::kPattern, config);
    EXPECT_EQ(config.pattern.bed_origin_x_mm, c.origin_mm) << c.high_mm;
    EXPECT_EQ(config.pattern.bed_size_x_mm, c.size_mm) << c.high_mm;
  }
}

TEST(StatedSettings, APatternThatDoesNotFitThemIsRefusedByTheirNames) {
  procedure::testing::FakePrinter printer;
  printer.told["configfile"]["settings"]["extruder"]["nozzle_diameter"] = 1.8;
  Config config = Parsed("[pressure_advance_pattern]\nline_width = 0.45\n");
  const auto fitted = FitPattern({printer, {}, {}}, config);
  ASSERT_FALSE(fitted);
  EXPECT_EQ(fitted.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(fitted.error().message, HasSubstr("states of itself (nozzle of 1.8 mm): ["));
}

TEST(StatedSettings, EveryMotorOnTheFilamentIsSet) {
  PrinterFacts facts = Usual();
  facts.advance_motors = {"extruder", "extruder_stepper belted"};
  Config config = Parsed("");
  EXPECT_THAT(TakeStated(facts, StatedFor::kPattern, config),
              ElementsAre("pressure advance of extruder and extruder_stepper belted"));
  EXPECT_THAT(config.pattern.advance_motors, ElementsAre("extruder", "belted"));
}

}  // namespace
}  // namespace trammel::app
