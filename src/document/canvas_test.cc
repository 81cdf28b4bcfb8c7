#include "document/canvas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "document/answer_head.h"
#include "document/parsers_test_support.h"
#include "document/svg_writer.h"

namespace trammel::report {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

Canvas Drawing() {
  Canvas canvas(200, 100);
  Frame picture(3, 2);
  picture.bgr.assign(picture.bgr.size(), 90);
  canvas.Clip({5, 5, 150, 80});
  canvas.Image(picture.view(), {10, 10, 60, 40});
  canvas.Unclip();
  const PointPx line[] = {{10, 90}, {kNan, 3}, {100, 20}, {150, 60}};
  canvas.Polyline(line, {.dash_px = {4, 2}});
  canvas.Polygon(line, kSky);
  canvas.Circle({150, 50}, 8, kBlue, Stroke{});
  canvas.Circle({kNan, 50}, 8, kBlue);
  canvas.Text({20, 80}, "K* ± 0.7 ms", {.bold = true, .angle_rad = 0.1});
  return canvas;
}

TEST(Canvas, PngAndSvgOfOneDrawingDecodeAtTheirSizes) {
  const Canvas canvas = Drawing();
  const auto size = test::DecodePng(canvas.ToPng(2));
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 400);
  EXPECT_EQ(size->height, 200);
  const std::string svg = canvas.ToSvg();
  EXPECT_EQ(test::XmlProblem(svg), "");
  EXPECT_NE(svg.find("<svg"), std::string::npos);
  EXPECT_NE(svg.find("width=\"200px\""), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(Canvas, EqualDrawingsGiveEqualBytes) {
  const Canvas first = Drawing();
  const Canvas second = Drawing();
  EXPECT_EQ(first.ToPng(), second.ToPng());
  EXPECT_EQ(first.ToSvg(), second.ToSvg());
  EXPECT_EQ(first.ToSvg(), first.ToSvg());
}

TEST(SvgPath, PlacesAreThoseOfTheLineToATenthWithoutDrift) {
  SvgPath path;
  path.MoveTo({10, 20.26});
  path.LineTo({10.04, 19.76});  // rounds to where x began
  path.LineTo({9.5, 30});
  path.LineTo({9.9, 30.4});
  path.Close();
  path.MoveTo({-1, 0});
  path.MoveTo({2, -3});
  EXPECT_EQ(path.text(), "M10 20.3l0-.5-.5 10.2 .4 .4zM-1 0M2-3");
  SvgPath dots;
  dots.Dot({1, 2});
  dots.Dot({1.5, 2});
  EXPECT_EQ(dots.text(), "M1 2h0M1.5 2h0");
  SvgPath steps;
  steps.MoveTo({0, 0});
  for (int i = 1; i <= 1000; ++i) steps.LineTo({0.04 * i, 0});
  steps.LineTo({40, 1});
  EXPECT_EQ(steps.text().substr(steps.text().size() - 4), " 0 1");
}

TEST(Canvas, HostileTextLeavesTheCanvasUsable) {
  Canvas canvas(100, 50);
  canvas.Text({5, 20}, "\xff\xfe<script>\x01", {});
  canvas.FillRect({50, 10, 20, 20}, kVermilion);
  EXPECT_TRUE(test::DecodePng(canvas.ToPng()));
  EXPECT_EQ(test::XmlProblem(canvas.ToSvg()), "");
}

TEST(Canvas, RejectsASizeItCannotHold) {
  EXPECT_THROW(Canvas(0, 10), Bug);
  EXPECT_THROW(Canvas(10, 1e6), Bug);
  EXPECT_THROW(Canvas(kNan, 10), Bug);
}

TEST(SvgIds, NumbersIdsAnewWithTheirReferences) {
  const std::string cairo =
      "<g id=\"surface42\"/><g id=\"glyph0-1\"/><use xlink:href=\"#glyph0-1\"/>"
      "<g clip-path=\"url(#clip9)\"/><g id=\"clip9\"/>";
  const std::string expected =
      "<g id=\"surface1\"/><g id=\"glyph2\"/><use xlink:href=\"#glyph2\"/>"
      "<g clip-path=\"url(#clip3)\"/><g id=\"clip3\"/>";
  EXPECT_EQ(RenumberSvgIds(cairo), expected);
  EXPECT_EQ(RenumberSvgIds("<g id=\"plain\"/>"), "<g id=\"plain\"/>");
}

TEST(MapColor, LightnessRisesEvenlySoThatAGreyCopySaysTheSame) {
  constexpr int kSteps = 64;
  constexpr double kFirst = 14;
  constexpr double kLast = 90;
  constexpr double kTolerance = 0.6;  // lightness of 100; rounding in the published sRGB matrix
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps;
    EXPECT_NEAR(Lightness(MapColor(t)), kFirst + (kLast - kFirst) * t, kTolerance) << t;
  }
  EXPECT_EQ(MapColor(kNan).red, MapColor(0).red);
  EXPECT_EQ(MapColor(7).green, MapColor(1).green);
}

TEST(Palette, ColoursDifferInGreyByAtLeastTwelve) {
  constexpr double kMin = 12;  // lightness of 100: about the step between two greys of a legend
  EXPECT_GT(Lightness(kVermilion) - Lightness(kBlue), kMin);
  EXPECT_GT(Lightness(kSky) - Lightness(kVermilion), kMin);
}

TEST(Canvas, StacksDrawingsIntoOnePictureAsWideAsTheWidest) {
  const Canvas upper(40, 10);
  const Canvas lower(60, 20);
  const Canvas* const drawings[] = {&upper, &lower};
  const auto picture = test::DecodePng(Canvas::StackedPng(drawings, 2));
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->width, 120);
  EXPECT_EQ(picture->height, 60);
}

TEST(AnswerHead, IsTallerForALongReasonAndNeverWiderThanAsked) {
  constexpr double kWidth_px = 340;
  const AnswerHead good{.title = "Pressure advance",
                        .verdict = Verdict::kGood,
                        .value = "0.0201 s",
                        .interval = "95 %: 0.0154 to 0.0249 s",
                        .facts = {"PLA", "2026-11-28"}};
  AnswerHead bad{.title = "Pressure advance", .verdict = Verdict::kCannotTell};
  for (int i = 0; i < 60; ++i) bad.reason += "many words ";
  const Canvas value = DrawAnswerHead(good, kWidth_px);
  const Canvas reason = DrawAnswerHead(bad, kWidth_px);
  EXPECT_EQ(value.width_px(), kWidth_px);
  EXPECT_GT(reason.height_px(), value.height_px());
  bad.reason = std::string(500, 'x');  // one word that is wider than the picture
  EXPECT_LT(DrawAnswerHead(bad, kWidth_px).height_px(), value.height_px());
}

}  // namespace
}  // namespace trammel::report
