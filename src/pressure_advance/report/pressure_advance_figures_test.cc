#include "pressure_advance/report/pressure_advance_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "document/parsers_test_support.h"
#include "pressure_advance/report/made_up_test_support.h"
#include "pressure_advance/response/lag_line_test_support.h"
#include "pressure_advance/response/response.h"
#include "support/lag_line.h"

namespace trammel::report {
namespace {

using ::testing::HasSubstr;

namespace pa = pressure_advance;

const double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> Names(const std::vector<Figure>& figures) {
  std::vector<std::string> names;
  for (const Figure& figure : figures) {
    names.push_back(figure.name);
  }
  return names;
}

/// Both formats of every figure are sound, on a phone too, and no coordinate is NaN.
void ExpectSound(const std::vector<Figure>& figures) {
  for (const Figure& figure : figures) {
    SCOPED_TRACE(figure.name);
    EXPECT_TRUE(test::DecodePng(figure.canvas.ToPng(1)));
    ASSERT_TRUE(figure.narrow);
    EXPECT_EQ(figure.narrow->width_px(), kNarrowWidthPx);
    for (const Canvas* canvas : {&figure.canvas, &*figure.narrow}) {
      const std::string svg = canvas->ToSvg();
      EXPECT_EQ(test::XmlProblem(svg), "");
      EXPECT_EQ(svg.find("\"nan"), std::string::npos);
      EXPECT_EQ(svg.find(" nan"), std::string::npos);
    }
    EXPECT_FALSE(figure.caption.empty());
  }
}

TEST(PressureAdvanceFigures, AScanGivesHeightMapsAndAPhotoItsPicture) {
  const auto scanned = PressureAdvanceFigures({test::MakeAnalysis({}), test::MakeScanView({}), {}});
  EXPECT_EQ(Names(scanned), (std::vector<std::string>{"response", "profiles", "height_maps"}));
  ExpectSound(scanned);
  const test::MadeUp photo{.lines = 21, .photo = true};
  const auto seen =
      PressureAdvanceFigures({test::MakeAnalysis(photo), {}, test::MakePhotoView(photo)});
  EXPECT_EQ(Names(seen), (std::vector<std::string>{"response", "profiles", "photo"}));
  ExpectSound(seen);
}

TEST(PressureAdvanceFigures, ARefusedPhotoIsShownWithItsOutline) {
  AnalysisRun run;
  run.refused = RefusedPhoto{Frame(40, 30), {{0.1, 0.1}, {0.9, 0.1}, {0.5, 1.2}}};
  const auto outlined = PressureAdvanceFigures(run);
  EXPECT_EQ(Names(outlined), (std::vector<std::string>{"photo"}));
  ExpectSound(outlined);
  EXPECT_NE(outlined.front().caption.find("outline"), std::string::npos);
  run.refused->outline.clear();
  const auto nothing = PressureAdvanceFigures(run);
  ExpectSound(nothing);
  EXPECT_NE(nothing.front().caption.find("No pattern was found"), std::string::npos);
  EXPECT_NE(nothing.front().canvas.ToSvg(), outlined.front().canvas.ToSvg());
}

TEST(PressureAdvanceFigures, SurviveFewAndManyLinesGapsConstantsAndNumbersThatAreNone) {
  EXPECT_TRUE(
      PressureAdvanceFigures({pa::Analysis{}, pa::LaserScanView{}, pa::PhotoView{}}).empty());
  using Spoil = std::function<void(pa::Analysis&, pa::LaserScanView&)>;
  const Spoil gaps = [](pa::Analysis& analysis, pa::LaserScanView& scan) {
    for (pa::LineProfile& profile : analysis.profiles) {
      for (pa::ProfileSample& sample : profile.samples) {
        sample = {.position = sample.position, .width = {}, .height = {}, .area = {}, .gap = true};
      }
    }
    for (pa::HeightMap& map : scan.heights) {
      map.height_px.assign(map.height_px.size(), 0.0F);
      map.sigma_px.assign(map.sigma_px.size(), 0.0F);
    }
  };
  const Spoil constant = [](pa::Analysis& analysis, pa::LaserScanView& scan) {
    for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
      analysis.lines[i].pressure_advance_s = 0.02;
      analysis.deviation.score_px[i] = 0;
      analysis.response.acceleration.surplus_s[i] = 0.001;
      analysis.response.acceleration.fitted_s[i] = 0.001;
      for (pa::ProfileSample& sample : analysis.profiles[i].samples) sample.area = {0.1, 0.001};
      for (float& height : scan.heights[i].height_px) height = 3;
    }
  };
  const Spoil not_finite = [](pa::Analysis& analysis, pa::LaserScanView& scan) {
    analysis.lines[1].pressure_advance_s = kNan;
    analysis.response.acceleration.surplus_s[3] = kNan;
    analysis.response.deceleration.sigma_s[4] = std::numeric_limits<double>::infinity();
    analysis.response.acceleration.window_begin = kNan;
    analysis.deviation.score_px[5] = analysis.deviation.cubic[1] = kNan;
    analysis.profiles[2].samples[7].area.value = kNan;
    analysis.profiles[2].samples[8].position = kNan;
    scan.heights[0].height_px[17] = std::numeric_limits<float>::quiet_NaN();
    scan.heights[0].position_mm[3] = kNan;
  };
  const Spoil other_counts = [](pa::Analysis& analysis, pa::LaserScanView& scan) {
    analysis.profiles.resize(3);
    analysis.deviation.score_px.resize(2);
    analysis.response.acceleration.sigma_s.resize(1);
    scan.heights[0].height_px.pop_back();
    scan.heights[1].frames = 1;
    scan.heights[2].position_mm.clear();
    scan.heights.resize(5);
  };
  const Spoil none = [](pa::Analysis&, pa::LaserScanView&) {};
  for (const auto& [lines, spoil] :
       {std::pair{0U, none}, std::pair{1U, none}, std::pair{3U, none}, std::pair{33U, none},
        std::pair{10U, gaps}, std::pair{10U, constant}, std::pair{10U, not_finite},
        std::pair{10U, other_counts}}) {
    SCOPED_TRACE(lines);
    auto analysis = test::MakeAnalysis({.lines = lines, .frames = 40});
    auto scan = test::MakeScanView({.lines = lines, .frames = 40});
    spoil(analysis, scan);
    ExpectSound(PressureAdvanceFigures({analysis, scan, {}}));
  }
}

TEST(PressureAdvanceFigures, MarkNoAnswerUnlessTheVerdictIsGood) {
  const auto good = test::MakeAnalysis({});
  auto refused = good;
  refused.pressure_advance = Measured::Refused("x");
  const std::string marked = ResponseFigure({good, {}, {}})->canvas.ToSvg();
  const auto bare = ResponseFigure({refused, {}, {}});
  for (const char* mark : {"answer, by the shape", "where the fit crosses 0", " s alone"}) {
    EXPECT_NE(marked.find(mark), std::string::npos) << mark;
    EXPECT_EQ(bare->canvas.ToSvg().find(mark), std::string::npos) << mark;
    EXPECT_EQ(bare->seen.find("crosses zero"), std::string::npos);
  }
  // And it does not depend on what the parts say.
  auto other = refused;
  other.response.acceleration.pressure_advance = Measured::CannotTell("y");
  EXPECT_EQ(ResponseFigure({refused, {}, {}})->canvas.ToSvg(),
            ResponseFigure({other, {}, {}})->canvas.ToSvg());
}

constexpr double kLag_s = 0.03;
constexpr double kPitch_s = 0.006;  // between tested values, from 0: 0.03 is the sixth
constexpr int kLines = 11;

/// Area over nominal area of a line, by position.
std::vector<double> Printed(double pressure_advance_s) {
  return trammel::testing::PrintLagLine({}, {.linear_s = kLag_s}, pressure_advance_s);
}

pa::Analysis AnalysisOfPrintedLines() {
  std::vector<pa::LineProfile> profiles;
  Random random(7);
  for (int i = 0; i < kLines; ++i) {
    profiles.push_back(pa::ReadLagLine({}, {.linear_s = kLag_s}, kPitch_s * i, 1e-4, random));
  }
  return pa::Analyse(std::move(profiles), pa::MotionOf({}), {});
}

/// Heights (px, downwards) of the dots of a panel, by rising pressure advance.
std::vector<double> DotHeights(const std::string& svg, const std::string& color) {
  std::vector<double> heights;
  for (std::size_t at = svg.find("<path d=\"M"); at != std::string::npos;
       at = svg.find("<path d=\"M", at + 1)) {
    const std::string path = svg.substr(at, svg.find("/>", at) - at);
    if (path.find("h0") == std::string::npos ||
        path.find("stroke=\"" + color + "\"") == std::string::npos) {
      continue;
    }
    for (std::size_t dot = path.find('M'); dot != std::string::npos;
         dot = path.find('M', dot + 1)) {
      heights.push_back(std::stod(path.substr(path.find(' ', dot) + 1)));
    }
  }
  return heights;
}

double MeanArea(const std::vector<double>& area, double from_mm, double to_mm) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const double position = trammel::testing::LagLine{}.step_mm * static_cast<double>(i);
    if (position < from_mm || position > to_mm) continue;
    sum += area[i];
    ++count;
  }
  return sum / count;
}

TEST(ResponseFigure, ALineOfTooLittlePressureAdvanceLiesAboveZeroAtBothSpeedChanges) {
  const pa::Analysis analysis = AnalysisOfPrintedLines();
  ASSERT_TRUE(analysis.pressure_advance.good()) << analysis.pressure_advance.reason();
  EXPECT_NEAR(analysis.pressure_advance.quantity().value, kLag_s, 0.001);
  const std::string svg = ResponseFigure({analysis, {}, {}})->canvas.ToSvg();
  for (const char* color : {"#0a5fa5", "#d9631e"}) {
    const std::vector<double> heights = DotHeights(svg, color);
    ASSERT_EQ(heights.size(), static_cast<std::size_t>(kLines)) << color;
    const double zero = heights[5];  // line printed with the right value
    EXPECT_LT(heights.front(), zero - 20) << "too low is up";
    EXPECT_GT(heights.back(), zero + 10) << "too high is down";
  }
}

TEST(ResponseFigure, SaysOfEachSpeedChangeWhatThePrintedLineShowsThere) {
  // The line starts to speed up at 7.5 mm and to slow down shortly before 22.5 mm.
  const std::vector<double> low = Printed(0);
  const std::vector<double> high = Printed(2 * kLag_s);
  EXPECT_LT(MeanArea(low, 8, 12), 0.9);
  EXPECT_GT(MeanArea(low, 22.5, 26), 1.1);
  EXPECT_GT(MeanArea(high, 8, 12), 1.1);
  EXPECT_LT(MeanArea(high, 22.5, 26), 0.9);
  const pa::Analysis analysis = AnalysisOfPrintedLines();
  const std::string svg = ResponseFigure({analysis, {}, {}})->canvas.ToSvg();
  const auto says = [&svg](const char* panel, const char* above, const char* below) {
    const std::size_t at = svg.find(std::string(">") + panel);
    const std::size_t meaning = svg.find("above 0: ", at);
    EXPECT_THAT(svg.substr(meaning, 90), HasSubstr(above));
    EXPECT_THAT(svg.substr(svg.find("below 0: ", at), 90), HasSubstr(below));
  };
  says("Speeding up", "too little filament on the line (PA too low)", "too much (PA too high)");
  says("Slowing down", "too much filament on the line (PA too low)", "too little (PA too high)");
  EXPECT_THAT(svg, HasSubstr(">PA too low by (ms)</text>"));
}

}  // namespace
}  // namespace trammel::report
