#include "pressure_advance/report/pattern_preview.h"

#include <gtest/gtest.h>

#include "document/bed_plot.h"
#include "document/parsers_test_support.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

TEST(PatternPreview, DrawsThePapersPattern) {
  const pa::PatternConfig config;
  const Canvas canvas = PatternPreview(pa::LayOut(config), config);
  EXPECT_TRUE(test::DecodePng(canvas.ToPng(1)));
  const std::string svg = canvas.ToSvg();
  EXPECT_EQ(test::XmlProblem(svg), "");
  EXPECT_EQ(svg, PatternPreview(pa::LayOut(config), config).ToSvg());
}

TEST(PatternPreview, DrawsManyPatternsOnARoundBed) {
  pa::PatternConfig config;
  config.bed_shape = settings::BedShape::kEllipse;
  config.columns = 3;
  config.rows = 3;
  config.alternate_directions = true;
  EXPECT_EQ(test::XmlProblem(PatternPreview(pa::LayOut(config), config).ToSvg()), "");
}

TEST(PatternPreview, DrawsThePatternThatIsFarWiderThanHighAndOneSpeed) {
  pa::PatternConfig config;
  config.line_count = 2;
  config.line_length_mm = 200;
  config.segments = {{1.0, 33}};
  config.frame_loops = 0;
  EXPECT_EQ(test::XmlProblem(PatternPreview(pa::LayOut(config), config).ToSvg()), "");
}

TEST(SpelledOut, WritesDegreesAndMaterialsAsAPictureCan) {
  EXPECT_EQ(SpelledOut("pla: nozzle 215, bed 60 degC"), "PLA: nozzle 215, bed 60 °C");
  EXPECT_EQ(SpelledOut("petg: nozzle 235, bed 70 (set) degC"), "PETG: nozzle 235, bed 70 (set) °C");
  EXPECT_EQ(SpelledOut("nozzle 210 (set), bed 60 degC (pla)"), "nozzle 210 (set), bed 60 °C (PLA)");
  EXPECT_EQ(SpelledOut("nozzles T0 215, T1 220, bed 60 degC"), "nozzles T0 215, T1 220, bed 60 °C");
}

TEST(PatternPreview, SaysWhatIsHeatedInAPicturesLetters) {
  pa::PatternConfig config;
  config.material = "petg";
  const std::string svg = PatternPreview(pa::LayOut(config), config).ToSvg();
  EXPECT_NE(svg.find("Heated to PETG: nozzle 235, bed 85 °C"), std::string::npos);
  EXPECT_EQ(svg.find("degC"), std::string::npos);
}

TEST(PatternPreview, RequiresALine) { EXPECT_THROW((void)PatternPreview({}, {}), Bug); }

}  // namespace
}  // namespace trammel::report
