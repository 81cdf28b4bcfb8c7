#include "pressure_advance/report/pressure_advance_figures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "document/parsers_test_support.h"
#include "document/surface.h"
#include "pressure_advance/report/figure_common.h"
#include "pressure_advance/report/made_up_test_support.h"
#include "pressure_advance/report/speed_profile.h"

namespace trammel::report {
namespace {

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
  const auto figures = PressureAdvanceFigures({&analysis, &scan, nullptr});
  EXPECT_EQ(Names(figures),
            (std::vector<std::string>{"response", "profiles", "law", "height_maps", "line_and_map",
                                      "surfaces", "frame_steps", "deviation"}));
  ExpectSound(figures);
}

TEST(PressureAdvanceFigures, AFrameStandsDirectlyAboveItsSectionWithBarsOf95Percent) {
  const auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  auto scan = test::MakeScanView(Small(), Random(kSeed));
  ASSERT_TRUE(scan.steps);
  const auto figure_of = [&](int rows) {
    pressure_advance::FrameSteps& steps = *scan.steps;
    for (Frame* frame : {&steps.crop, &steps.masked, &steps.blurred}) {
      *frame = Frame(frame->width, rows);
    }
    const auto count = static_cast<std::size_t>(rows);
    steps.paper_centre_px.resize(count);
    steps.centre_px.resize(count);
    steps.centre_sigma_px.resize(count);
    return FrameStepsFigure({&analysis, &scan, nullptr});
  };
  const int width = scan.steps->crop.width;
  const auto tall = figure_of(2 * width);
  const auto wide = figure_of(width / 2);
  ASSERT_TRUE(tall && wide);
  EXPECT_NE(tall->canvas.ToSvg().find("95 %"), std::string::npos);
  EXPECT_LT(wide->canvas.height_px(), tall->canvas.height_px() - 50);
}

TEST(PressureAdvanceFigures, APhotoGivesThoseThatNeedNoHeights) {
  test::MadeUp photo = Small(21);
  photo.highest_pressure_advance_s = 0.1;
  photo.photo = true;
  const auto analysis = test::MakeAnalysis(photo, Random(kSeed));
  const auto view = test::MakePhotoView(photo, Random(kSeed));
  const auto figures = PressureAdvanceFigures({&analysis, nullptr, &view});
  EXPECT_EQ(Names(figures), (std::vector<std::string>{"response", "profiles", "photo"}));
  ExpectSound(figures);
}

TEST(PressureAdvanceFigures, EqualInputGivesEqualBytes) {
  const auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  const auto scan = test::MakeScanView(Small(), Random(kSeed));
  const auto first = PressureAdvanceFigures({&analysis, &scan, nullptr});
  const auto second = PressureAdvanceFigures({&analysis, &scan, nullptr});
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].canvas.ToSvg(), second[i].canvas.ToSvg()) << first[i].name;
    EXPECT_EQ(first[i].canvas.ToPng(1), second[i].canvas.ToPng(1)) << first[i].name;
  }
}

TEST(PressureAdvanceFigures, SurviveFewAndManyLines) {
  for (const std::size_t lines : {0U, 1U, 2U, 3U, 33U}) {
    SCOPED_TRACE(lines);
    const auto analysis = test::MakeAnalysis(Small(lines), Random(kSeed));
    const auto scan = test::MakeScanView(Small(lines), Random(kSeed));
    ExpectSound(PressureAdvanceFigures({&analysis, &scan, nullptr}));
  }
}

TEST(PressureAdvanceFigures, SurviveAnEmptyAnalysisAndAnEmptyView) {
  const pa::Analysis analysis;
  const pa::LaserScanView scan;
  const PhotoView photo;
  EXPECT_TRUE(PressureAdvanceFigures({&analysis, &scan, &photo}).empty());
  EXPECT_THROW((void)PressureAdvanceFigures({}), Bug);
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
  scan.steps->centre_sigma_px.assign(scan.steps->centre_sigma_px.size(), 0.0F);
  ExpectSound(PressureAdvanceFigures({&analysis, &scan, nullptr}));
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
  ExpectSound(PressureAdvanceFigures({&analysis, &scan, nullptr}));
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
  analysis.response.law->laid_area[0][5] = kNan;
  analysis.response.law->crossings_s.interval95.hi = kNan;
  scan.heights[0].height_px[17] = std::numeric_limits<float>::quiet_NaN();
  scan.heights[0].position_mm[3] = kNan;
  scan.steps->centre_px[4] = std::numeric_limits<float>::quiet_NaN();
  ExpectSound(PressureAdvanceFigures({&analysis, &scan, nullptr}));
}

TEST(PressureAdvanceFigures, SurviveCountsThatDoNotFitTogether) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  auto scan = test::MakeScanView(Small(), Random(kSeed));
  analysis.profiles.resize(3);
  analysis.deviation.score_px.resize(2);
  analysis.response.acceleration.sigma_s.resize(1);
  analysis.response.law->laid_area.resize(2);
  analysis.response.law->laid_area[0].resize(5);
  scan.heights[0].height_px.pop_back();
  scan.heights[1].frames = 1;
  scan.heights[2].position_mm.clear();
  scan.heights.resize(5);
  scan.steps->centre_px.pop_back();
  const auto figures = PressureAdvanceFigures({&analysis, &scan, nullptr});
  ExpectSound(figures);
  for (const Figure& figure : figures) {
    EXPECT_NE(figure.name, "frame_steps");
  }
}

TEST(PressureAdvanceFigures, MarkNoAnswerUnlessTheVerdictIsGood) {
  const auto good = test::MakeAnalysis({}, Random(kSeed));
  auto refused = good;
  refused.pressure_advance = Measured::Refused("x");
  const std::string marked = ResponseFigure({&good, nullptr, nullptr})->canvas.ToSvg();
  const auto bare = ResponseFigure({&refused, nullptr, nullptr});
  for (const char* mark : {"answer of both", "where the fit crosses 0", " s alone"}) {
    EXPECT_NE(marked.find(mark), std::string::npos) << mark;
    EXPECT_EQ(bare->canvas.ToSvg().find(mark), std::string::npos) << mark;
    EXPECT_EQ(bare->seen.find("crosses zero"), std::string::npos);
  }
  // The marks and notes of an answer are strokes and letters: without them a drawing is shorter.
  EXPECT_LT(DeviationFigure({&refused, nullptr, nullptr})->canvas.ToSvg().size() + 100,
            DeviationFigure({&good, nullptr, nullptr})->canvas.ToSvg().size());
  // And it does not depend on what the parts say.
  auto other = refused;
  other.response.acceleration.pressure_advance = Measured::CannotTell("y");
  other.deviation.best_s = 0.0123;
  other.deviation.cubic_minimum_s.reset();
  EXPECT_EQ(ResponseFigure({&refused, nullptr, nullptr})->canvas.ToSvg(),
            ResponseFigure({&other, nullptr, nullptr})->canvas.ToSvg());
  EXPECT_EQ(DeviationFigure({&refused, nullptr, nullptr})->canvas.ToSvg(),
            DeviationFigure({&other, nullptr, nullptr})->canvas.ToSvg());
}

TEST(HeightMapsFigure, IsInMillimetresWithWhatScaleAndAngleLeaveOpen) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  const auto scan = test::MakeScanView(Small(), Random(kSeed));
  const ReportInput input{&analysis, &scan, nullptr};
  const auto says = [&](const char* words) {
    for (const auto& make : {HeightMapsFigure, LineAndMapFigure, SurfacesFigure}) {
      if (make(input)->canvas.ToSvg().find(words) == std::string::npos) return false;
    }
    return true;
  };
  EXPECT_TRUE(says(">height (mm)<"));
  EXPECT_NE(HeightMapsFigure(input)->caption.find("2 % of all heights and 2.9 % of all areas"),
            std::string::npos);
  analysis.scale->area_share.reset();
  EXPECT_NE(HeightMapsFigure(input)->caption.find("was not said"), std::string::npos);
  analysis.scale.reset();
  EXPECT_TRUE(says(">height (px)<"));
  EXPECT_EQ(HeightMapsFigure(input)->caption.find("cale and laser"), std::string::npos);
}

TEST(LawFigure, SaysWhatEachOfTheTwoSaysAndOfEachLineHowFarOffItIs) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  for (const bool good : {true, false}) {
    if (!good) analysis.pressure_advance = Measured::CannotTell("x");
    const auto figure = LawFigure({&analysis, nullptr, nullptr});
    ASSERT_TRUE(figure);
    for (const Canvas* canvas : {&figure->canvas, &*figure->narrow}) {
      const std::string svg = canvas->ToSvg();
      for (const char* said : {"Answer: 0.0362 s", "Shape of the lines, counts 75 %: 0.0359 s",
                               "Changes of speed, count 25 %: 0.0371 s",
                               "PA 0.000 s: 36.2 ms too little", "PA 0.060 s: 23.8 ms too much"}) {
        EXPECT_EQ(svg.find(said) != std::string::npos, good) << said;
      }
      EXPECT_NE(svg.find(">PA 0.060 s"), std::string::npos);
      EXPECT_NE(svg.find(">slows down<"), std::string::npos);
      EXPECT_NE(svg.find(">area (mm²)<"), std::string::npos);
    }
    EXPECT_EQ(figure->seen.find("0.0371") != std::string::npos, good);
  }
  analysis.response.law.reset();
  EXPECT_FALSE(LawFigure({&analysis, nullptr, nullptr}));
}

TEST(LawFigure, KeepsAReadingFarFromTheLawInSight) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  const auto svg = [&analysis] { return LawFigure({&analysis, nullptr, nullptr})->canvas.ToSvg(); };
  const auto zero_to_tick = [](const std::string& drawn) {
    return drawn.substr(drawn.find("read less law"), 4000);
  };
  const std::string before = svg();
  analysis.profiles[0].samples[20].area.value += 0.05;
  const std::string after = svg();
  // It takes a mark of its own, and no scale from the others.
  EXPECT_NE(zero_to_tick(before), zero_to_tick(after));
  for (const char* tick : {">0.01<", ">-0.01<", ">0.02<", ">-0.02<"}) {
    EXPECT_EQ(before.find(tick) == std::string::npos, after.find(tick) == std::string::npos)
        << tick;
  }
}

TEST(LawFigure, DrawsTheLawThroughTheReadings) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  // Where the first line's curve begins, px downwards.
  const auto begin = [&analysis] {
    const std::string svg = LawFigure({&analysis, nullptr, nullptr})->canvas.ToSvg();
    const std::size_t line = svg.find(">PA 0.000 s");
    std::size_t path = svg.find("<path d=\"M", line);
    for (; path != std::string::npos; path = svg.find("<path d=\"M", path + 1)) {
      const std::string drawn = svg.substr(path, svg.find("/>", path) - path);
      if (drawn.find("stroke=\"#d9631e\" stroke-width=\"2\"") == std::string::npos) continue;
      return std::stod(drawn.substr(drawn.find(' ', drawn.find('M'))));
    }
    return kNan;
  };
  const double full = begin();
  for (auto& areas : analysis.response.law->laid_area) {
    for (double& area : areas) area /= 2;
  }
  EXPECT_GT(begin(), full + 10);
}

TEST(LinesByPressureAdvance, SortsAndPicksEvenlyWithBothEnds) {
  pa::Analysis analysis;
  for (const double p : {0.03, 0.01, kNan, 0.02, 0.05, 0.04}) {
    analysis.lines.push_back({p, true, ""});
  }
  EXPECT_EQ(LinesByPressureAdvance(analysis, 9), (std::vector<std::size_t>{1, 3, 0, 5, 4}));
  EXPECT_EQ(LinesByPressureAdvance(analysis, 3), (std::vector<std::size_t>{1, 0, 4}));
}

TEST(TellingLines, AreTheLowestTheNearestToTheAnswerAndTheHighest) {
  auto analysis = test::MakeAnalysis(Small(), Random(kSeed));
  EXPECT_EQ(TellingLines(analysis), (std::vector<std::size_t>{0, 5, 9}));
  analysis.lines.resize(2);
  EXPECT_EQ(TellingLines(analysis), (std::vector<std::size_t>{0, 1}));
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

TEST(Smoothed, TakesTheMedianSoThatOneSpikeLeavesNoTrace) {
  Grid grid{9, 9, std::vector<double>(81, 2.0)};
  grid.values[40] = 500;
  grid.values[0] = kNan;
  const Grid smooth = Smoothed(grid, 3, 3);
  ASSERT_EQ(smooth.values.size(), 9U);
  for (const double value : smooth.values) {
    EXPECT_EQ(value, 2.0);
  }
  EXPECT_TRUE(std::isnan(Smoothed({1, 1, {kNan}}, 5, 5).values[0]));
}

}  // namespace
}  // namespace trammel::report
