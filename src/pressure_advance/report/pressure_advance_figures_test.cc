#include "pressure_advance/report/pressure_advance_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "document/parsers_test_support.h"
#include "pressure_advance/report/made_up_test_support.h"
#include "pressure_advance/response/response.h"
#include "support/lag_line.h"

namespace trammel::report {
namespace {

using ::testing::HasSubstr;

namespace pa = pressure_advance;

constexpr std::uint64_t kSeed = 7;
const double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> Names(const std::vector<Figure>& figures) {
  std::vector<std::string> names;
  for (const Figure& figure : figures) {
    names.push_back(figure.name);
  }
  return names;
}

/// Small enough to draw many.
test::MadeUp Small(std::size_t lines = 10) {
  test::MadeUp made_up;
  made_up.lines = lines;
  made_up.frames = 40;
  made_up.rows = 24;
  return made_up;
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

TEST(PressureAdvanceFigures, AScanGivesEveryFigureButThePhoto) {
  const auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  const auto scan = test::MakeScanView(Small(), Random(kSeed));
  const auto figures = PressureAdvanceFigures({analysis, scan, {}});
  EXPECT_EQ(Names(figures),
            (std::vector<std::string>{"response", "profiles", "height_maps", "deviation"}));
  ExpectSound(figures);
}

TEST(PressureAdvanceFigures, APhotoGivesThoseThatNeedNoHeights) {
  test::MadeUp photo = Small(21);
  photo.highest_pressure_advance_s = 0.1;
  photo.photo = true;
  const auto analysis = test::MakeAnalysis(photo, Random(kSeed));
  const auto view = test::MakePhotoView(photo, Random(kSeed));
  const auto figures = PressureAdvanceFigures({analysis, {}, view});
  EXPECT_EQ(Names(figures), (std::vector<std::string>{"response", "profiles", "photo"}));
  ExpectSound(figures);
}

TEST(PressureAdvanceFigures, SurviveFewAndManyLines) {
  for (const std::size_t lines : {0U, 1U, 2U, 3U, 33U}) {
    SCOPED_TRACE(lines);
    const auto analysis = test::MakeAnalysis(Small(lines), Random(kSeed));
    const auto scan = test::MakeScanView(Small(lines), Random(kSeed));
    ExpectSound(PressureAdvanceFigures({analysis, scan, {}}));
  }
}

TEST(PressureAdvanceFigures, SurviveAnEmptyAnalysisAndAnEmptyView) {
  const pa::Analysis analysis;
  const pa::LaserScanView scan;
  const pa::PhotoView photo;
  EXPECT_TRUE(PressureAdvanceFigures({analysis, scan, photo}).empty());
}

TEST(PressureAdvanceFigures, SurviveGapsAllOver) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  auto scan = test::MakeScanView(Small(), Random(kSeed));
  for (pa::LineProfile& profile : analysis.profiles) {
    for (pa::ProfileSample& sample : profile.samples) {
      sample = {.position = sample.position, .width = {}, .height = {}, .area = {}, .gap = true};
    }
  }
  for (pa::HeightMap& map : scan.heights) {
    map.height_px.assign(map.height_px.size(), 0.0F);
    map.sigma_px.assign(map.sigma_px.size(), 0.0F);
  }
  ExpectSound(PressureAdvanceFigures({analysis, scan, {}}));
}

TEST(PressureAdvanceFigures, SurviveConstantValues) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  auto scan = test::MakeScanView(Small(), Random(kSeed));
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    analysis.lines[i].pressure_advance_s = 0.02;
    analysis.deviation.score_px[i] = 0;
    analysis.response.acceleration.excess_s[i] = 0.001;
    analysis.response.acceleration.fitted_s[i] = 0.001;
    for (pa::ProfileSample& sample : analysis.profiles[i].samples) {
      sample.area = {0.1, 0.001};
      sample.width = {0.4, 0.001};
    }
    for (float& height : scan.heights[i].height_px) {
      height = 3;
    }
  }
  ExpectSound(PressureAdvanceFigures({analysis, scan, {}}));
}

TEST(PressureAdvanceFigures, SurviveValuesThatAreNotFinite) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  auto scan = test::MakeScanView(Small(), Random(kSeed));
  analysis.lines[1].pressure_advance_s = kNan;
  analysis.response.acceleration.excess_s[3] = kNan;
  analysis.response.deceleration.sigma_s[4] = std::numeric_limits<double>::infinity();
  analysis.response.acceleration.window_begin = kNan;
  analysis.deviation.score_px[5] = kNan;
  analysis.deviation.cubic[1] = kNan;
  analysis.profiles[2].samples[7].area.value = kNan;
  analysis.profiles[2].samples[9].width.value = kNan;
  analysis.profiles[2].samples[8].position = kNan;
  analysis.motion.length_mm = kNan;
  scan.heights[0].height_px[17] = std::numeric_limits<float>::quiet_NaN();
  scan.heights[0].position_mm[3] = kNan;
  ExpectSound(PressureAdvanceFigures({analysis, scan, {}}));
}

TEST(PressureAdvanceFigures, SurviveCountsThatDoNotFitTogether) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  auto scan = test::MakeScanView(Small(), Random(kSeed));
  analysis.profiles.resize(3);
  analysis.deviation.score_px.resize(2);
  analysis.response.acceleration.sigma_s.resize(1);
  scan.heights[0].height_px.pop_back();
  scan.heights[1].frames = 1;
  scan.heights[2].position_mm.clear();
  scan.heights.resize(5);
  ExpectSound(PressureAdvanceFigures({analysis, scan, {}}));
}

TEST(PressureAdvanceFigures, MarkNoAnswerUnlessTheVerdictIsGood) {
  const auto good = test::MakeAnalysis({}, Random(kSeed));
  auto refused = good;
  refused.pressure_advance = Measured::Refused("x");
  const std::string marked = ResponseFigure({good, {}, {}})->canvas.ToSvg();
  const auto bare = ResponseFigure({refused, {}, {}});
  for (const char* mark : {"answer, by the shape", "where the fit crosses 0", " s alone"}) {
    EXPECT_NE(marked.find(mark), std::string::npos) << mark;
    EXPECT_EQ(bare->canvas.ToSvg().find(mark), std::string::npos) << mark;
    EXPECT_EQ(bare->seen.find("crosses zero"), std::string::npos);
  }
  // The marks and notes of an answer are strokes and letters: without them a drawing is shorter.
  EXPECT_LT(DeviationFigure({refused, {}, {}})->canvas.ToSvg().size() + 100,
            DeviationFigure({good, {}, {}})->canvas.ToSvg().size());
  // And it does not depend on what the parts say.
  auto other = refused;
  other.response.acceleration.pressure_advance = Measured::CannotTell("y");
  other.deviation.best_s = 0.0123;
  other.deviation.cubic_minimum_s.reset();
  EXPECT_EQ(ResponseFigure({refused, {}, {}})->canvas.ToSvg(),
            ResponseFigure({other, {}, {}})->canvas.ToSvg());
  EXPECT_EQ(DeviationFigure({refused, {}, {}})->canvas.ToSvg(),
            DeviationFigure({other, {}, {}})->canvas.ToSvg());
}

TEST(ResponseFigure, NamesWhatTheAnswerIsMadeOf) {
  auto analysis = test::MakeAnalysis({}, Random(kSeed));
  const auto says = [&](const char* words) {
    return ResponseFigure({analysis, {}, {}})->canvas.ToSvg().find(words) != std::string::npos;
  };
  ASSERT_TRUE(analysis.response.law && analysis.response.law->weight > 0);
  EXPECT_TRUE(says("answer, by the shape of the lines too"));
  analysis.response.law->weight = 0;
  EXPECT_TRUE(says("answer of both"));
  analysis.response.law.reset();
  EXPECT_TRUE(says("answer of both"));
}

TEST(HeightMapsFigure, IsInMillimetresWithWhatScaleAndAngleLeaveOpen) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  const auto scan = test::MakeScanView(Small(), Random(kSeed));
  const auto input = [&] { return AnalysisRun{analysis, scan, {}}; };
  const auto says = [&](const char* words) {
    return HeightMapsFigure(input())->canvas.ToSvg().find(words) != std::string::npos;
  };
  EXPECT_TRUE(says(">height (mm)<"));
  EXPECT_NE(HeightMapsFigure(input())->caption.find("2 % of all heights and 2.9 % of all areas"),
            std::string::npos);
  analysis.scale->area_share.reset();
  EXPECT_NE(HeightMapsFigure(input())->caption.find("was not said"), std::string::npos);
  analysis.scale.reset();
  EXPECT_TRUE(says(">height (px)<"));
  EXPECT_EQ(HeightMapsFigure(input())->caption.find("cale and laser"), std::string::npos);
}

TEST(LinesByPressureAdvance, SortsAndPicksEvenlyWithBothEnds) {
  pa::Analysis analysis;
  for (const double p : {0.03, 0.01, kNan, 0.02, 0.05, 0.04}) {
    analysis.lines.push_back({p, true, ""});
  }
  EXPECT_EQ(LinesByPressureAdvance(analysis, 9), (std::vector<std::size_t>{1, 3, 0, 5, 4}));
  EXPECT_EQ(LinesByPressureAdvance(analysis, 3), (std::vector<std::size_t>{1, 0, 4}));
}

TEST(SpeedAlongLine, ReachesTheFastSpeedAfterTheDistanceThatAccelerationTakes) {
  const pa::LineMotion motion{{{0.25, 5}, {0.5, 150}, {0.25, 5}}, 30.0, 3000.0};
  const auto speed = SpeedAlongLine(motion, true);
  ASSERT_FALSE(speed.empty());
  // (150^2 - 5^2) / (2 * 3000) mm; the curve has a point every 30 mm / 400.
  constexpr double kRampMm = 3.746;
  constexpr double kStepMm = 30.0 / 400;
  for (const DataPoint& point : speed) {
    const bool ramp_or_slow =
        point.x < 7.5 + kRampMm - kStepMm || point.x > 22.5 - kRampMm + kStepMm;
    EXPECT_EQ(point.y < 150, ramp_or_slow || point.x < 7.5 + kRampMm || point.x > 22.5 - kRampMm)
        << point.x;
    EXPECT_GE(point.y, 5 - 1e-9);
  }
  EXPECT_DOUBLE_EQ(speed.front().y, 5);
  EXPECT_DOUBLE_EQ(speed.back().y, 5);
}

TEST(SpeedAlongLine, IsASequenceOfStepsWithoutLengthAndEmptyWithoutSegments) {
  const pa::LineMotion motion{{{0.1, 10}, {0.6, 100}, {0.3, 10}}, {}, {}};
  std::set<double> speeds;
  for (const DataPoint& point : SpeedAlongLine(motion, false)) {
    speeds.insert(point.y);
  }
  EXPECT_EQ(speeds, (std::set<double>{10, 100}));
  EXPECT_TRUE(SpeedAlongLine(motion, true).empty());
  EXPECT_TRUE(SpeedAlongLine({}, false).empty());
}

namespace pa = pressure_advance;

constexpr double kLag_s = 0.03;
constexpr double kPitch_s = 0.006;  // of the tested values, from 0: 0.03 is the sixth
constexpr int kLines = 11;

/// Area over nominal area of a line, by position.
std::vector<double> Printed(double pressure_advance_s) {
  trammel::testing::LagLaw law;
  law.linear_s = kLag_s;
  return PrintLagLine({}, law, pressure_advance_s);
}

pa::Analysis AnalysisOfPrintedLines() {
  const trammel::testing::LagLine line;
  std::vector<pa::LineProfile> profiles;
  for (int i = 0; i < kLines; ++i) {
    pa::LineProfile profile;
    profile.pressure_advance_s = kPitch_s * i;
    const std::vector<double> area = Printed(profile.pressure_advance_s);
    for (std::size_t k = 0; k < area.size(); ++k) {
      pa::ProfileSample sample;
      sample.position = line.step_mm * static_cast<double>(k);
      if (sample.position < 4 || sample.position > line.length_mm - 4) continue;
      sample.area = {0.11 * area[k], 1e-5};
      profile.samples.push_back(sample);
    }
    profiles.push_back(profile);
  }
  pa::LineMotion motion;
  motion.segments = {{line.slow_before, line.slow_mm_s},
                     {1 - line.slow_before - line.slow_after, line.fast_mm_s},
                     {line.slow_after, line.slow_mm_s}};
  motion.length_mm = line.length_mm;
  motion.acceleration_mm_s2 = line.acceleration_mm_s2;
  return pa::Analyse(std::move(profiles), motion, {});
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
    const double zero = heights[5];  // of the line that was printed with the right value
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
