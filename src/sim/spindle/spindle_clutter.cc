#include "sim/spindle/spindle_clutter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "sim/print/texture.h"

namespace trammel::sim {
namespace {

constexpr int kShift = 4;  // drawing in sixteenths of a pixel

cv::Point Fine(double x, double y) {
  return {static_cast<int>(std::lround(x * (1 << kShift))),
          static_cast<int>(std::lround(y * (1 << kShift)))};
}

double Angle(Random& random) { return random.Uniform(0, 2 * std::numbers::pi); }

// OpenCV's drawing functions antialias only 8-bit pictures.
cv::Scalar GreyNear(double surface, double least, double most, Random& random) {
  return {std::clamp(surface * random.Uniform(least, most), 0.0, 255.0)};
}

void DrawEdges(int count, double surface, Random& random, cv::Mat& grey) {
  const double far = 2.0 * (grey.cols + grey.rows);
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(0, grey.cols);
    const double y = random.Uniform(0, grey.rows);
    const double angle = Angle(random);
    const double c = std::cos(angle) * far;
    const double s = std::sin(angle) * far;
    const std::vector<cv::Point> half = {Fine(x + c, y + s), Fine(x - c, y - s),
                                         Fine(x - c - s, y - s + c), Fine(x + c - s, y + s + c)};
    cv::fillConvexPoly(grey, half, GreyNear(surface, 0.5, 1.4, random), cv::LINE_AA, kShift);
  }
}

void DrawHoles(int count, double surface, Random& random, cv::Mat& grey) {
  for (int i = 0; i < count; ++i) {
    const cv::Point middle = Fine(random.Uniform(0, grey.cols), random.Uniform(0, grey.rows));
    const double radius = random.Uniform(6, 90);
    const double flat = random.Uniform(0.6, 1);
    const double turn = random.Uniform(0, 360);
    const int rings = 1 + static_cast<int>(random.Below(4));
    for (int ring = rings; ring > 0; --ring) {
      const double r = radius * ring / rings;
      const double begin = random.Uniform(0, 360);
      const double length = random.Uniform() < 0.3 ? random.Uniform(60, 300) : 360;
      cv::ellipse(grey, middle, cv::Size(Fine(r, r * flat)), turn, begin, begin + length,
                  GreyNear(surface, 0.1, 2.2, random), cv::FILLED, cv::LINE_AA, kShift);
    }
  }
}

void DrawText(int count, double surface, Random& random, cv::Mat& grey) {
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-./oO0Q8B";
  for (int i = 0; i < count; ++i) {
    std::string word;
    const std::uint64_t length = 3 + random.Below(9);
    for (std::uint64_t j = 0; j < length; ++j) word += kLetters[random.Below(45)];
    const cv::Point at(static_cast<int>(random.Uniform(0, grey.cols)),
                       static_cast<int>(random.Uniform(0, grey.rows)));
    cv::putText(grey, word, at, cv::FONT_HERSHEY_SIMPLEX, random.Uniform(0.5, 4),
                GreyNear(surface, 0.1, 2.2, random), 1 + static_cast<int>(random.Below(6)),
                cv::LINE_AA);
  }
}

void DrawScratches(int count, double surface, Random& random, cv::Mat& grey) {
  for (int i = 0; i < count; ++i) {
    double x = random.Uniform(0, grey.cols);
    double y = random.Uniform(0, grey.rows);
    double angle = Angle(random);
    const cv::Scalar colour = GreyNear(surface, 0.4, 2.0, random);
    const int width = 1 + static_cast<int>(random.Below(3));
    const int pieces = 4 + static_cast<int>(random.Below(12));
    for (int piece = 0; piece < pieces; ++piece) {
      const double length = random.Uniform(10, 80);
      const double to_x = x + length * std::cos(angle);
      const double to_y = y + length * std::sin(angle);
      cv::line(grey, Fine(x, y), Fine(to_x, to_y), colour, width, cv::LINE_AA, kShift);
      x = to_x;
      y = to_y;
      angle += random.Normal(0, 0.15);
    }
  }
}

void DrawChips(int count, double surface, Random& random, cv::Mat& grey) {
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(0, grey.cols);
    const double y = random.Uniform(0, grey.rows);
    const double size = random.Uniform(3, 40);
    std::vector<cv::Point> outline;
    const int corners = 3 + static_cast<int>(random.Below(6));
    for (int corner = 0; corner < corners; ++corner) {
      const double angle = 2 * std::numbers::pi * corner / corners;
      const double r = size * random.Uniform(0.3, 1);
      outline.push_back(Fine(x + r * std::cos(angle), y + r * std::sin(angle)));
    }
    cv::fillPoly(grey, std::vector<std::vector<cv::Point>>{outline},
                 GreyNear(surface, 0.2, 2.7, random), cv::LINE_AA, kShift);
  }
}

// Adds fine grain and coarse stains, both of this standard deviation.
void AddGrain(double grain, Random& random, cv::Mat& grey) {
  const Tile fine = SmoothNoise(512, 1.2, random);
  const Tile coarse = SmoothNoise(128, 3, random);
  const auto strength = static_cast<float>(grain);
  for (int y = 0; y < grey.rows; ++y) {
    auto* row = grey.ptr<float>(y);
    for (int x = 0; x < grey.cols; ++x) {
      row[x] *= std::max(0.0F, 1 + strength * (fine.At(x, y) + coarse.At(x >> 4, y >> 4)));
    }
  }
}

}  // namespace

cv::Mat SurfaceOf(const SpindlePicture& picture, Random& random) {
  const SpindleClutter& clutter = picture.clutter;
  const double surface = picture.light.surface;
  cv::Mat drawn(picture.lens.height_px, picture.lens.width_px, CV_8U, cv::Scalar(surface));
  DrawEdges(clutter.edges, surface, random, drawn);
  DrawHoles(clutter.holes, surface, random, drawn);
  DrawText(clutter.words, surface, random, drawn);
  if (!clutter.over_targets) {
    DrawScratches(clutter.scratches, surface, random, drawn);
    DrawChips(clutter.chips, surface, random, drawn);
  }
  cv::Mat grey;
  drawn.convertTo(grey, CV_32F);
  if (clutter.grain > 0) AddGrain(clutter.grain, random, grey);
  return grey;
}

void Litter(const SpindleClutter& clutter, double surface_grey, Random& random, cv::Mat& grey) {
  if (!clutter.over_targets) return;
  // Draws on a separate layer: its coverage, and its brightness there.
  cv::Mat cover(grey.size(), CV_8U, cv::Scalar(0));
  cv::Mat bright(grey.size(), CV_8U, cv::Scalar(surface_grey));
  Random again = random;
  DrawScratches(clutter.scratches, surface_grey, random, bright);
  DrawChips(clutter.chips, surface_grey, random, bright);
  // Draws the same outlines in white: the colour consumes one random number in either case.
  DrawScratches(clutter.scratches, 1e9, again, cover);
  DrawChips(clutter.chips, 1e9, again, cover);
  for (int y = 0; y < grey.rows; ++y) {
    auto* row = grey.ptr<float>(y);
    const auto* covered = cover.ptr<std::uint8_t>(y);
    const auto* value = bright.ptr<std::uint8_t>(y);
    for (int x = 0; x < grey.cols; ++x) {
      const float share = static_cast<float>(covered[x]) / 255.0F;
      row[x] += share * (static_cast<float>(value[x]) - row[x]);
    }
  }
}

}  // namespace trammel::sim
