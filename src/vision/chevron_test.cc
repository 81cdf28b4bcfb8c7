// Nested chevrons: finding and counting them under perspective, on plates with grain.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "base/random.h"
#include "vision/chevron_finder.h"

namespace trammel::vision {
namespace {

struct Drawing {
  const char* name;
  int count = 12;
  double turn_rad = 0;
  double tilt = 0;  // perspective: change of scale over 30 spacings
  bool mirrored = false;
  bool darker = false;
  double grain = 6;
};

// Plane to picture: 40 px a spacing, the pattern's middle in the picture's.
Homography CameraOf(const Drawing& drawing, int width, int height) {
  const double c = std::cos(drawing.turn_rad), s = std::sin(drawing.turn_rad);
  const double middle = (drawing.count - 1) / 2.0 - 2, k = 40, sign = drawing.mirrored ? -1 : 1;
  const double t = drawing.tilt / 30;
  const double x0 = width / 2.0, y0 = height / 2.0;
  // (x, y) -> centre + k R (x - middle, sign y) / (1 + t (x - middle)).
  return {{k * c + x0 * t, -k * s * sign, -k * c * middle + x0 * (1 - t * middle), k * s + y0 * t,
           k * c * sign, -k * s * middle + y0 * (1 - t * middle), t, 0, 1 - t * middle}};
}

cv::Mat Draw(const Drawing& drawing, int width, int height) {
  const Homography camera = CameraOf(drawing, width, height);
  const cv::Matx33d back = cv::Matx33d(camera.m.data()).inv();
  Random random(7);
  cv::Mat picture(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const cv::Vec3d at = back * cv::Vec3d(x, y, 1);
      const double px = at[0] / at[2], py = at[1] / at[2];
      const double place = px + std::abs(py);
      const double whole = std::clamp(std::round(place), 0.0, drawing.count - 1.0);
      const bool frame =
          std::abs(std::abs(py) - 5.8) < 0.3 && px > -6.5 && px < drawing.count + 0.5;
      const bool band = std::abs(place - whole) < 0.24 && std::abs(py) < 5.8;
      const double level =
          ((band || frame) != drawing.darker ? 190 : 80) + drawing.grain * random.Normal();
      const auto value = cv::saturate_cast<std::uint8_t>(level);
      picture.at<cv::Vec3b>(y, x) = {value, value, cv::saturate_cast<std::uint8_t>(0.8 * level)};
    }
  }
  cv::GaussianBlur(picture, picture, {}, 1);
  return picture;
}

constexpr double kDegree = std::numbers::pi / 180;
const Drawing kDrawings[] = {{.name = "straight"},
                             {.name = "17", .count = 17},
                             {.name = "turned", .turn_rad = 25 * kDegree},
                             {.name = "upside down", .turn_rad = 172 * kDegree},
                             {.name = "perspective", .tilt = 0.2},
                             {.name = "mirrored", .mirrored = true},
                             {.name = "dark filament", .darker = true},
                             {.name = "grain", .grain = 25}};

// @param most  distance from where they lie, px of 40 a spacing
void ExpectFoundWhereTheyLie(const Drawing& drawing, const std::optional<FoundChevrons>& found,
                             double most) {
  SCOPED_TRACE(drawing.name);
  ASSERT_TRUE(found.has_value());
  // Spaces beyond the pattern may count as well; the reader tells them by their colour.
  EXPECT_GE(found->count, drawing.count - 1);
  EXPECT_LE(found->count, drawing.count + 1);
  const Homography camera = CameraOf(drawing, 1100, 900);
  const PointPx wanted = camera({5, 0});
  double nearest = 1e9;
  for (double k = -1; k < found->count + 1; k += 0.5) {
    nearest = std::min(nearest, Distance_px(found->photo_from_plane({k, 0}), wanted));
  }
  EXPECT_LT(nearest, most);
}

BgrView ViewOf(const cv::Mat& picture) {
  return {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)};
}

TEST(ChevronFinder, FindsAllChevronsWhereTheyLie) {
  for (const Drawing& drawing : kDrawings) {
    const cv::Mat picture = Draw(drawing, 1100, 900);
    ExpectFoundWhereTheyLie(drawing, FindChevrons(ViewOf(picture), FindCombs(ViewOf(picture))), 2);
  }
}

// As where a shadow hides the others from the search for combs.
TEST(ChevronFinder, FindsThemByTheArmsOfOneSide) {
  const auto direction = [](const FoundComb& comb) {
    return std::atan2(comb.corners[1].y - comb.corners[0].y, comb.corners[1].x - comb.corners[0].x);
  };
  for (const Drawing& drawing : kDrawings) {
    const cv::Mat picture = Draw(drawing, 1100, 900);
    std::vector<FoundComb> combs = FindCombs(ViewOf(picture));
    const double arms = drawing.turn_rad + 45 * kDegree;
    std::erase_if(combs, [&](const FoundComb& comb) {
      return std::abs(std::sin(direction(comb) - arms)) > 0.2;
    });
    ExpectFoundWhereTheyLie(drawing, FindChevrons(ViewOf(picture), combs), 4);
  }
}

TEST(ChevronFinder, SeesNoneInParallelLinesOrGrain) {
  cv::Mat lines(600, 800, CV_8UC3, cv::Scalar::all(80));
  for (int y = 40; y < 560; y += 40) {
    cv::line(lines, {60, y}, {740, y}, cv::Scalar::all(190), 10);
  }
  cv::Mat grain(600, 800, CV_8UC3);
  cv::randu(grain, 0, 255);
  for (const cv::Mat& picture : {lines, grain}) {
    EXPECT_FALSE(FindChevrons(ViewOf(picture), FindCombs(ViewOf(picture))).has_value());
  }
}

}  // namespace
}  // namespace trammel::vision
