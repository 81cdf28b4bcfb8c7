#include "vision/bead_width.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::vision {
namespace {

constexpr int kWidth_px = 400;
constexpr double kPitch_px = 24;
constexpr double kBead_px = 8;
constexpr double kPlate = 40;
constexpr double kFilament = 120;

// Level rungs as bright bars, blurred as a lens does; the first one is broken in its middle.
struct Drawn {
  GrayImage contrast;
  LinePattern line_pattern;
};

Curve Constant(double value) { return {.c0 = value}; }

Drawn Draw(const std::vector<double>& bead_px, double blur_px, double noise, bool broken,
           Random& random) {
  Drawn drawn;
  const int height = static_cast<int>(kPitch_px * (static_cast<double>(bead_px.size()) + 1));
  drawn.contrast = GrayImage(kWidth_px, height);
  for (std::size_t i = 0; i < bead_px.size(); ++i) {
    // Off the grid, so that rounding to rows would show.
    drawn.line_pattern.rungs.push_back(Constant(kPitch_px * (static_cast<double>(i) + 1) + 0.37));
  }
  drawn.line_pattern.steps.assign(bead_px.size() - 1, 1);
  drawn.line_pattern.pitch_px = kPitch_px;
  drawn.line_pattern.bead_px = kBead_px;
  drawn.line_pattern.left_inner = Constant(20);
  drawn.line_pattern.right_inner = Constant(kWidth_px - 20);
  const auto step = [&](double d) { return 0.5 * (1 + std::erf(d / (blur_px * std::sqrt(2.0)))); };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < kWidth_px; ++x) {
      double cover = 0;
      for (std::size_t i = 0; i < bead_px.size(); ++i) {
        if (broken && i == 0 && x > 180 && x < 220) continue;
        const double off = std::abs(y - drawn.line_pattern.rungs[i].c0);
        cover += step(bead_px[i] / 2 - off) - step(-bead_px[i] / 2 - off);
      }
      drawn.contrast.row(y)[x] =
          static_cast<float>(kPlate + (kFilament - kPlate) * cover + noise * random.Normal());
    }
  }
  return drawn;
}

std::vector<double> WidthsOf(const std::vector<BeadReading>& line) {
  std::vector<double> widths;
  for (const BeadReading& reading : line) widths.push_back(reading.width_px);
  return widths;
}

TEST(BeadWidth, IsTheDrawnOneWhateverTheBlur) {
  // The filament's level is read over the core of a bead, where 2 px of blur on 8 px still reach
  // 1 - erf(1.4) = 4.6 % of the contrast; 0.2 px more are left for levels and pixels.
  const auto tolerance_px = [](double blur_px, double width_px) {
    return 0.2 + width_px * (1 - std::erf(width_px / (2 * blur_px * std::sqrt(2.0))));
  };
  Random random(1);
  for (const double blur_px : {0.7, 1.2, 2.0}) {
    const Drawn drawn = Draw({8, 8, 8, 8, 8}, blur_px, 0, false, random);
    const BeadWidths widths = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
    ASSERT_EQ(widths.lines.size(), 5u);
    for (const auto& line : widths.lines) {
      ASSERT_EQ(line.size(), 200u);
      EXPECT_NEAR(Median(WidthsOf(line)), 8, tolerance_px(blur_px, 8)) << "blur " << blur_px;
    }
  }
}

TEST(BeadWidth, TellsALineThatIsTenPercentWider) {
  Random random(2);
  const Drawn drawn = Draw({8, 8, 8.8, 8, 8}, 1.2, 0, false, random);
  const BeadWidths widths = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
  const double usual = Median(WidthsOf(widths.lines[1]));
  const double wider = Median(WidthsOf(widths.lines[2]));
  constexpr double kTolerance_px = 0.1;  // an eighth of the difference
  EXPECT_NEAR(wider - usual, 0.8, kTolerance_px);
}

TEST(BeadWidth, IsNoneWhereTheFilamentBroke) {
  Random random(3);
  const Drawn drawn = Draw({8, 8, 8, 8, 8}, 1.0, 0, true, random);
  const BeadWidths widths = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
  constexpr double kNothing_px = 0.2;  // as above: residual of levels and pixels
  for (const BeadReading& reading : widths.lines[0]) {
    if (reading.x_px > 185 && reading.x_px < 215) {
      EXPECT_NEAR(reading.width_px, 0, kNothing_px) << reading.x_px;
    }
  }
}

TEST(BeadWidth, StatesTheScatterThatNoiseMakes) {
  Random random(4);
  const Drawn drawn = Draw({8, 8, 8, 8, 8}, 1.2, 6, false, random);
  const BeadWidths widths = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
  std::vector<double> pulls;
  for (const auto& line : widths.lines) {
    const double typical = Median(WidthsOf(line));
    for (const BeadReading& reading : line) {
      ASSERT_GT(reading.sigma_px, 0);
      pulls.push_back((reading.width_px - typical) / reading.sigma_px);
    }
  }
  // 1000 pulls give their scale to 1 / sqrt(2000) = 2 %; the sigma is of the plate's grain, seen
  // to a few per cent, and a cell's ends share pixels with its neighbours': a third either way.
  const double scale = RobustStandardDeviation(pulls);
  EXPECT_GT(scale, 0.67) << "seed 4";
  EXPECT_LT(scale, 1.5) << "seed 4";
}

TEST(BeadWidth, MeasuresNothingInGlare) {
  Random random(5);
  Drawn drawn = Draw({8, 8, 8, 8, 8}, 1.2, 3, false, random);
  for (float& value : drawn.contrast.value) value = static_cast<float>(kPlate + random.Normal());
  const BeadWidths widths = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
  for (const auto& line : widths.lines) {
    for (const BeadReading& reading : line) EXPECT_EQ(reading.sigma_px, 0);
  }
}

// Beyond the photo's border there is whatever the picture was filled up with.
TEST(BeadWidth, MeasuresNothingBeyondThePhoto) {
  Random random(6);
  const std::vector<double> bead_px(5, kBead_px);
  Drawn drawn = Draw(bead_px, 1.2, 3, false, random);
  const BeadWidths whole = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
  constexpr int kBorder_px = 250;
  drawn.line_pattern.seen.assign(bead_px.size(), {0, kBorder_px});
  for (int y = 0; y < drawn.contrast.height; ++y) {
    for (int x = kBorder_px + 1; x < kWidth_px; ++x) drawn.contrast.row(y)[x] = 1e6F;
  }
  const BeadWidths cut = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
  for (std::size_t line = 0; line < cut.lines.size(); ++line) {
    for (std::size_t place = 0; place < cut.lines[line].size(); ++place) {
      const BeadReading& reading = cut.lines[line][place];
      EXPECT_EQ(reading.seen, reading.x_px <= kBorder_px);
      if (!reading.seen) {
        EXPECT_EQ(reading.sigma_px, 0);
      } else if (reading.x_px < kBorder_px - 5) {
        EXPECT_NEAR(reading.width_px, whole.lines[line][place].width_px, 0.05 * kBead_px);
      }
    }
  }
}

// Given a lamp whose light a textured plate reflects on one side.
TEST(BeadWidth, ReadsLinesThatAreDarkerThanThePlateOnOneSide) {
  Random random(5);
  const std::vector<double> bead_px(7, kBead_px);
  Drawn drawn = Draw(bead_px, 1, 2, false, random);
  for (int y = 0; y < drawn.contrast.height; ++y) {
    for (int x = kWidth_px / 2; x < kWidth_px; ++x) {
      float& value = drawn.contrast.row(y)[x];
      value = static_cast<float>(2 * kPlate) - value;
    }
  }
  const BeadWidths widths = MeasureBeadWidths(drawn.contrast, drawn.line_pattern);
  constexpr double kNear_px = 40;  // from the change, within the levels' zones
  for (const std::vector<BeadReading>& line : widths.lines) {
    std::vector<double> left, right;
    for (const BeadReading& reading : line) {
      if (std::abs(reading.x_px - kWidth_px / 2.0) < kNear_px) continue;
      ASSERT_GT(reading.sigma_px, 0) << reading.x_px;
      (reading.x_px < kWidth_px / 2.0 ? left : right).push_back(reading.width_px);
    }
    EXPECT_NEAR(Mean(left), Mean(right), 0.1);
  }
}

}  // namespace
}  // namespace trammel::vision
