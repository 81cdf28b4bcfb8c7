#include "report/pattern_preview.h"

#include <gtest/gtest.h>

#include "report/test_support.h"

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

TEST(PatternPreview, RequiresALine) { EXPECT_THROW((void)PatternPreview({}, {}), Bug); }

}  // namespace
}  // namespace trammel::report
