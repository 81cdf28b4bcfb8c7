// What the response figure says of lines whose error is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pressure_advance/report/pressure_advance_figures.h"
#include "pressure_advance/response/analyse.h"
#include "support/lag_line.h"

namespace trammel::report {
namespace {

using ::testing::HasSubstr;
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
