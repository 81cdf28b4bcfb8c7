// Combs of strokes: the pencil of their lines, finding them in a picture, tracing them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "base/random.h"
#include "vision/comb_finder.h"
#include "vision/comb_pattern.h"
#include "vision/comb_strokes.h"

namespace trammel::vision {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(LinePencil, NamesPlacesOfLinesThatACameraSees) {
  Random random(1);
  for (int round = 0; round < 100; ++round) {
    // A tilted plane: equal steps become unequal, parallel lines converge.
    Homography camera;
    camera.m = {random.Uniform(60, 90),      random.Uniform(-8, 8),       random.Uniform(-50, 50),
                random.Uniform(-8, 8),       random.Uniform(60, 90),      random.Uniform(-50, 50),
                random.Uniform(-8e-3, 8e-3), random.Uniform(-8e-3, 8e-3), 1};
    std::vector<PencilPoint> points;
    for (int place = 0; place < 8; ++place) {
      for (const double along : {0.0, 3.0, 9.0}) {
        points.push_back({camera({along, double(place)}), double(place)});
      }
    }
    const auto pencil = FitPencil(points);
    ASSERT_TRUE(pencil.has_value()) << round;
    constexpr double kRounding = 1e-6;
    for (const double place : {-2.0, 3.5, 10.0}) {
      const PointPx point = camera({4.5, place});
      EXPECT_NEAR(pencil->PlaceOf(point), place, kRounding) << round;
      EXPECT_NEAR(pencil->Y_px(place, point.x), point.y, 1e-4) << round;
    }
  }
}

TEST(LinePencil, NeedsThreeLines) {
  std::vector<PencilPoint> points;
  for (const double x : {0.0, 50.0, 100.0}) {
    points.push_back({{x, 10}, 0});
    points.push_back({{x, 30}, 1});
  }
  EXPECT_FALSE(FitPencil(points).has_value());
}

// Strokes of filament on a noisy plate, with a bar across their ends if asked for.
struct DrawnComb {
  int lines = 9;
  double pitch_px = 40, bead_px = 16, length_px = 420;
  double turn_rad = 0;
  bool darker = false, bars = true;
  int width_px = 700, height_px = 600;
};

cv::Mat Draw(const DrawnComb& comb, Random& random) {
  cv::Mat picture(comb.height_px, comb.width_px, CV_8UC3);
  const double c = std::cos(comb.turn_rad), s = std::sin(comb.turn_rad);
  const double high = (comb.lines - 1) * comb.pitch_px;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const double dx = x - comb.width_px / 2.0, dy = y - comb.height_px / 2.0;
      const double u = c * dx + s * dy, v = -s * dx + c * dy + high / 2;
      const double place = std::clamp(std::round(v / comb.pitch_px), 0.0, comb.lines - 1.0);
      const bool on_line = std::abs(v - place * comb.pitch_px) < comb.bead_px / 2 &&
                           std::abs(u) < comb.length_px / 2;
      const double out = std::abs(u) - comb.length_px / 2;
      const bool on_bar = comb.bars && out >= 0 && out < 1.2 * comb.bead_px &&
                          std::abs(v - high / 2) < high / 2 + 1.5 * comb.pitch_px;
      const double filament = on_line || on_bar ? 80 : 0;
      const double level = 110 + (comb.darker ? -filament : filament) + random.Normal() * 6;
      const auto value = cv::saturate_cast<std::uint8_t>(level);
      picture.at<cv::Vec3b>(y, x) = {value, value, value};
    }
  }
  cv::GaussianBlur(picture, picture, {}, 1.0);
  return picture;
}

BgrView View(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
}

TEST(CombFinder, FindsStrokesHoweverTheyAreTurned) {
  Random random(2);
  for (const bool darker : {false, true}) {
    for (int degrees = -90; degrees < 90; degrees += 13) {
      DrawnComb drawn;
      drawn.turn_rad = degrees * kDegree;
      drawn.darker = darker;
      drawn.bars = degrees % 2 == 0;
      const cv::Mat picture = Draw(drawn, random);
      const std::vector<FoundComb> found = FindCombs(View(picture));
      ASSERT_FALSE(found.empty()) << degrees;
      // Strokes and the spaces between them are equally spaced; either may be the longer in all.
      const bool is_there = std::any_of(found.begin(), found.end(), [&](const FoundComb& comb) {
        const Quad& q = comb.corners;
        double direction = std::atan2(q[1].y - q[0].y, q[1].x - q[0].x) - drawn.turn_rad;
        direction -= std::numbers::pi * std::round(direction / std::numbers::pi);
        return comb.places == drawn.lines && std::abs(direction) < 2 * kDegree;
      });
      EXPECT_TRUE(is_there) << degrees << " " << darker;
    }
  }
}

// Level strokes straight from above, contrast as the eye mixes it.
struct DrawnPattern {
  GrayImage contrast, seen;
  CombPlaces places;
};

DrawnPattern DrawPattern(bool inverted, int hidden_right_px) {
  DrawnPattern drawn;
  constexpr int kWidth = 500, kHeight = 420, kLeft = 80, kRight = 420, kBar = 18, kLines = 8;
  constexpr double kPitch = 40, kBead = 16, kFirst = 70;
  drawn.contrast = GrayImage(kWidth, kHeight);
  drawn.seen = GrayImage(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double place = std::round((y - kFirst) / kPitch);
      const bool on_line = std::abs(y - kFirst - place * kPitch) < kBead / 2 && place >= 0 &&
                           place < kLines && x > kLeft && x < kRight;
      const bool on_bar =
          ((x > kLeft - kBar && x <= kLeft) || (x >= kRight && x < kRight + kBar)) && y > 10 &&
          y < kHeight - 10;
      const bool on = on_line || on_bar;
      drawn.contrast.row(y)[x] = on != inverted ? 100 : 0;
      drawn.seen.row(y)[x] = x < kWidth - hidden_right_px ? 1 : 0;
    }
  }
  // In the inverted pattern the spaces have the contrast.
  drawn.places = {inverted ? kFirst + kPitch / 2 : kFirst, kPitch, inverted ? kLines - 1 : kLines};
  return drawn;
}

TEST(CombPattern, TracesLinesBetweenTheirRails) {
  const DrawnPattern drawn = DrawPattern(false, 0);
  const LinePattern pattern = TraceComb(drawn.contrast, drawn.seen, drawn.places);
  ASSERT_EQ(pattern.problem, "");
  EXPECT_EQ(pattern.rungs.size(), 8U);
  EXPECT_TRUE(pattern.left_seen && pattern.right_seen);
  EXPECT_NEAR(pattern.left_inner(200), 80.5, 1);
  EXPECT_NEAR(pattern.right_inner(200), 419.5, 1);
}

TEST(CombPattern, SaysWhichRailThePhotoDoesNotShow) {
  const DrawnPattern drawn = DrawPattern(false, 110);
  const LinePattern pattern = TraceComb(drawn.contrast, drawn.seen, drawn.places);
  ASSERT_EQ(pattern.problem, "");
  EXPECT_EQ(pattern.rungs.size(), 8U);
  EXPECT_TRUE(pattern.left_seen);
  EXPECT_FALSE(pattern.right_seen);
  for (const Columns& seen : pattern.seen) EXPECT_EQ(seen.to_px, 389);
  EXPECT_NEAR(pattern.right_inner(200), 389, 1);
}

TEST(CombPattern, TakesNoSpaceForALine) {
  const DrawnPattern drawn = DrawPattern(true, 0);
  const LinePattern pattern = TraceComb(drawn.contrast, drawn.seen, drawn.places);
  EXPECT_NE(pattern.problem, "");
}

// Lines of another tool, which no frame contains, on a plate of 0 with filament of 100.
struct DrawnLines {
  int bar_px = 0;        // thickness of a bar at the left ends
  int box_px = 0;        // length of a filled box at the right ends
  int broken_lines = 0;  // from the first on, at a quarter of their length
  bool stripe = false;   // across the picture, in the place before the first line
  int width_px = 600;
};

constexpr int kLinesLeft = 90, kLinesRight = 500, kDrawnLines = 9;
constexpr double kLinesPitch = 36, kLinesFirst = 90;

LinePattern Trace(const DrawnLines& lines) {
  GrayImage contrast(lines.width_px, 460), seen(lines.width_px, 460);
  std::fill(seen.value.begin(), seen.value.end(), 1.0F);
  for (int y = 0; y < contrast.height; ++y) {
    const double place = std::round((y - kLinesFirst) / kLinesPitch);
    const bool on_row = std::abs(y - kLinesFirst - place * kLinesPitch) < 5;
    const bool beside = place >= 0 && place < kDrawnLines;
    for (int x = 0; x < contrast.width; ++x) {
      const bool broken = place < lines.broken_lines && x > 180 && x < 230;
      const bool line = on_row && beside && x >= kLinesLeft && x < kLinesRight && !broken;
      const bool bar = beside && x >= kLinesLeft - lines.bar_px && x < kLinesLeft;
      const bool box = beside && x >= kLinesRight && x < kLinesRight + lines.box_px;
      const bool stripe = lines.stripe && on_row && place == -1;
      contrast.row(y)[x] = line || bar || box || stripe ? 100 : 0;
    }
  }
  return TraceComb(contrast, seen, {kLinesFirst, kLinesPitch, kDrawnLines}, false);
}

TEST(CombEnds, AreWhereLinesStopWhateverFollows) {
  for (const int bar_px : {0, 9, 18}) {
    for (const int box_px : {0, 80}) {
      for (const int broken_lines : {0, 4}) {
        const LinePattern pattern = Trace({bar_px, box_px, broken_lines});
        ASSERT_EQ(pattern.problem, "") << bar_px << " " << box_px << " " << broken_lines;
        EXPECT_EQ(pattern.rungs.size(), 9U);
        EXPECT_NEAR(pattern.left_inner(230), kLinesLeft - 0.5, 1);
        EXPECT_NEAR(pattern.right_inner(230), kLinesRight - 0.5, 1);
        EXPECT_EQ(pattern.ended, 1);
      }
    }
  }
}

TEST(CombEnds, TellAStripeFromALine) {
  DrawnLines drawn;
  drawn.stripe = true;
  const LinePattern pattern = Trace(drawn);
  ASSERT_EQ(pattern.problem, "");
  EXPECT_EQ(pattern.rungs.size(), 9U);
  EXPECT_NEAR(pattern.rungs.front()(300), kLinesFirst, 1);
}

TEST(CombEnds, AreNotInventedBeyondTheView) {
  DrawnLines drawn;
  drawn.width_px = 450;
  EXPECT_NE(Trace(drawn).problem, "");
}

}  // namespace
}  // namespace trammel::vision
