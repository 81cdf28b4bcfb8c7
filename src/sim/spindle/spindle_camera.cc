#include "sim/spindle/spindle_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "sim/spindle/spindle_clutter.h"

namespace trammel::sim {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

double HalfSquare(double t) { return t > 0 ? 0.5 * t * t : 0; }

/// Computes the part of a square of `side` px inside a straight edge: where the distance is
/// positive. It is `inside_mm` at the middle and grows along (x, y) of the target's plane.
double Left(double inside_mm, double x, double y, double side,
            const std::array<std::array<double, 2>, 2>& by_pixel) {
  const double right = x * by_pixel[0][0] + y * by_pixel[1][0];  // mm per px
  const double down = x * by_pixel[0][1] + y * by_pixel[1][1];
  const double steepness = std::hypot(right, down);
  if (!(steepness > 0)) return inside_mm > 0 ? 1 : 0;
  const double distance = inside_mm / steepness;
  if (distance >= 0.71 * side) return 1;
  if (distance <= -0.71 * side) return 0;
  // Projected onto the edge's normal the square is a trapezoid: the convolution of two boxes.
  const double a = std::max(std::abs(right) / steepness * side, 1e-6 * side);
  const double b = std::max(std::abs(down) / steepness * side, 1e-6 * side);
  const double half_sum = 0.5 * (a + b);
  const double half_gap = 0.5 * (a - b);
  const double left = HalfSquare(distance + half_sum) - HalfSquare(distance + half_gap) -
                      HalfSquare(distance - half_gap) + HalfSquare(distance - half_sum);
  return std::clamp(left / (a * b), 0.0, 1.0);
}

struct Square {
  double x = 0;
  double y = 0;
  double radius = 0;
  double side_px = 1;
  const PixelOnTarget* pixel = nullptr;

  [[nodiscard]] double Within(double radius_mm) const {
    if (!(radius > 0)) return 1;
    return Left(radius_mm - radius, -x / radius, -y / radius, side_px, pixel->by_pixel);
  }
  /// Computes the part left of the ray from the middle at this angle.
  [[nodiscard]] double LeftOfRay(double angle_rad) const {
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    return Left(c * y - s * x, -s, c, side_px, pixel->by_pixel);
  }
};

// Returns the white part of the ring's segments, as if the ring had neither inner nor outer edge.
double WhiteSegments(const RingPattern& pattern, const Square& square) {
  const double sense = pattern.clockwise ? -1 : 1;
  const double angle = sense * std::atan2(square.y, square.x) - pattern.first_rad;
  const double width = kTurn / pattern.bits;
  const double at = (angle - kTurn * std::floor(angle / kTurn)) / width;
  const int here = std::min(static_cast<int>(at), pattern.bits - 1);
  const bool begins = at - here < 0.5;  // nearer to the segment's beginning than to its end
  const int next = (here + (begins ? pattern.bits - 1 : 1)) % pattern.bits;
  const auto bit = [&](int i) { return (pattern.word >> i & 1U) != 0; };
  if (bit(here) == bit(next)) return bit(here) ? 1 : 0;
  const double edge = sense * (pattern.first_rad + width * (here + (begins ? 0 : 1)));
  const double left = square.LeftOfRay(edge);
  const double inside = begins == !pattern.clockwise ? left : 1 - left;
  return bit(here) ? inside : 1 - inside;
}

double Hidden(const std::vector<HiddenWedge>& wedges, const Square& square) {
  double free = 1;
  for (const HiddenWedge& wedge : wedges) {
    const double inside = square.LeftOfRay(wedge.from_rad) *
                          (1 - square.LeftOfRay(wedge.from_rad + wedge.extent_rad)) *
                          (1 - square.Within(wedge.beyond_mm));
    free *= 1 - inside;
  }
  return 1 - free;
}

TargetCover CoverOfSquare(const RingPattern& pattern, const std::vector<HiddenWedge>& hidden,
                          const Square& square) {
  TargetCover cover;
  cover.target = square.Within(pattern.ground_radius_mm);
  cover.white = square.Within(pattern.dot_radius_mm);
  if (pattern.bits > 0) {
    const double ring = square.Within(pattern.ring_outer_mm) - square.Within(pattern.ring_inner_mm);
    if (ring > 0) cover.white += ring * WhiteSegments(pattern, square);
  }
  cover.hidden = hidden.empty() ? 0 : Hidden(hidden, square);
  return cover;
}

bool NearAnEdge(const RingPattern& pattern, bool hidden, double radius, double reach_mm) {
  if (hidden && radius < pattern.ground_radius_mm + reach_mm) return true;
  const auto near = [&](double edge) { return std::abs(radius - edge) < reach_mm; };
  if (near(pattern.dot_radius_mm) || near(pattern.ground_radius_mm)) return true;
  return pattern.bits > 0 && radius > pattern.ring_inner_mm - reach_mm &&
         radius < pattern.ring_outer_mm + reach_mm;
}

}  // namespace

TargetCover CoverOf(const RingPattern& pattern, const std::vector<HiddenWedge>& hidden,
                    const PixelOnTarget& pixel) {
  constexpr int kSplit = 4;
  const auto& by = pixel.by_pixel;
  Square square = {pixel.at_mm[0], pixel.at_mm[1], std::hypot(pixel.at_mm[0], pixel.at_mm[1]), 1,
                   &pixel};
  const double reach_mm = 0.5 * (std::hypot(by[0][0], by[1][0]) + std::hypot(by[0][1], by[1][1]));
  if (!NearAnEdge(pattern, !hidden.empty(), square.radius, reach_mm)) {
    return CoverOfSquare(pattern, hidden, square);
  }
  TargetCover sum;
  square.side_px = 1.0 / kSplit;
  for (int i = 0; i < kSplit; ++i) {
    const double down = (i + 0.5) / kSplit - 0.5;
    for (int j = 0; j < kSplit; ++j) {
      const double right = (j + 0.5) / kSplit - 0.5;
      square.x = pixel.at_mm[0] + by[0][0] * right + by[0][1] * down;
      square.y = pixel.at_mm[1] + by[1][0] * right + by[1][1] * down;
      square.radius = std::hypot(square.x, square.y);
      const TargetCover part = CoverOfSquare(pattern, hidden, square);
      sum.target += part.target;
      sum.white += part.white;
      sum.hidden += part.hidden;
    }
  }
  constexpr double kShare = 1.0 / (kSplit * kSplit);
  return {sum.target * kShare, sum.white * kShare, sum.hidden * kShare};
}

namespace {

struct Box {
  int left = 0;
  int top = 0;
  int right = 0;  ///< one beyond
  int bottom = 0;
};

/// Maps positions of the picture to the plane of one target.
class TargetPlane {
 public:
  TargetPlane(const SpindleLens& lens, const Place& camera_from_target)
      : lens_(lens),
        optics_(camera_from_target.In({0, 0, 0})),
        target_from_camera_(Back(camera_from_target.turn)) {}

  [[nodiscard]] bool FromTheFront() const { return optics_[2] > 0; }
  [[nodiscard]] std::array<double, 2> At(double column, double row) const {
    const auto direction = DirectionOf(lens_, {column, row});
    const Triple along = target_from_camera_ * Triple{direction[0], direction[1], 1};
    const double t = -optics_[2] / along[2];
    return {optics_[0] + t * along[0], optics_[1] + t * along[1]};
  }

 private:
  SpindleLens lens_;
  Triple optics_;
  Turn target_from_camera_;
};

// Returns the part of the picture covered by a target, from points of its outline; empty out of
// view.
Box BoxOf(const SpindleLens& lens, const PlacedTarget& target) {
  constexpr int kPoints = 32;
  constexpr double kRoom_px = 3;
  double left = 1e9;
  double right = -1e9;
  double top = 1e9;
  double bottom = -1e9;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    // A polygon of 32 corners is inside the outline by 0.5 %: 2 % more covers it.
    const double r = 1.02 * target.pattern.ground_radius_mm;
    const auto seen =
        SeenAt(lens, target.camera_from_target.Out({r * std::cos(angle), r * std::sin(angle), 0}));
    if (!seen) return {};
    left = std::min(left, (*seen)[0]);
    right = std::max(right, (*seen)[0]);
    top = std::min(top, (*seen)[1]);
    bottom = std::max(bottom, (*seen)[1]);
  }
  const auto whole = [](double value, int size) {
    return static_cast<int>(std::clamp(std::floor(value), 0.0, static_cast<double>(size)));
  };
  return {whole(left - kRoom_px, lens.width_px), whole(top - kRoom_px, lens.height_px),
          whole(right + kRoom_px + 1, lens.width_px), whole(bottom + kRoom_px + 1, lens.height_px)};
}

void DrawTarget(const SpindleLens& lens, const SpindleLight& light, const PlacedTarget& target,
                cv::Mat& grey) {
  const TargetPlane plane(lens, target.camera_from_target);
  if (!plane.FromTheFront()) return;
  const Box box = BoxOf(lens, target);
  const double reach_mm = 1.1 * target.pattern.ground_radius_mm;
  for (int y = box.top; y < box.bottom; ++y) {
    auto* row = grey.ptr<float>(y);
    auto left = plane.At(box.left - 1, y);
    auto here = plane.At(box.left, y);
    for (int x = box.left; x < box.right; ++x) {
      const auto right = plane.At(x + 1, y);
      if (std::hypot(here[0], here[1]) < reach_mm) {
        const auto above = plane.At(x, y - 0.5);
        const auto below = plane.At(x, y + 0.5);
        PixelOnTarget pixel;
        pixel.at_mm = here;
        for (std::size_t i = 0; i < 2; ++i) {
          pixel.by_pixel[i] = {0.5 * (right[i] - left[i]), below[i] - above[i]};
        }
        const TargetCover cover = CoverOf(target.pattern, target.hidden, pixel);
        const double bare = light.dark + (light.white - light.dark) * cover.white;
        const double seen = bare + (light.hidden - bare) * cover.hidden;
        row[x] += static_cast<float>(cover.target * (seen - static_cast<double>(row[x])));
      }
      left = std::exchange(here, right);
    }
  }
}

void Shade(const SpindleLight& light, cv::Mat& grey) {
  if (light.vignetting == 0 && light.gradient == 0) return;
  const double middle_x = 0.5 * (grey.cols - 1);
  const double middle_y = 0.5 * (grey.rows - 1);
  const double corner2 = middle_x * middle_x + middle_y * middle_y;
  const double by_x = light.gradient * std::cos(light.gradient_rad) / grey.cols;
  const double by_y = light.gradient * std::sin(light.gradient_rad) / grey.cols;
  for (int y = 0; y < grey.rows; ++y) {
    auto* row = grey.ptr<float>(y);
    const double dy = y - middle_y;
    for (int x = 0; x < grey.cols; ++x) {
      const double dx = x - middle_x;
      const double loss = light.vignetting * (dx * dx + dy * dy) / corner2;
      row[x] *= static_cast<float>((1 - loss) * std::max(0.0, 1 + by_x * dx + by_y * dy));
    }
  }
}

// Returns the kernel of a straight motion of `length` px: uniform, with tent weights for the
// neighbouring pixels.
cv::Mat MotionKernel(double length_px, double angle_rad) {
  const int half = static_cast<int>(std::ceil(0.5 * length_px)) + 1;
  cv::Mat kernel(2 * half + 1, 2 * half + 1, CV_32F, cv::Scalar(0));
  const int steps = std::max(1, static_cast<int>(std::ceil(8 * length_px)));
  for (int i = 0; i < steps; ++i) {
    const double along = length_px * ((i + 0.5) / steps - 0.5);
    const double x = half + along * std::cos(angle_rad);
    const double y = half + along * std::sin(angle_rad);
    const int x0 = static_cast<int>(std::floor(x));
    const int y0 = static_cast<int>(std::floor(y));
    for (int k = 0; k < 4; ++k) {
      const int px = x0 + k % 2;
      const int py = y0 + k / 2;
      const double weight = (1 - std::abs(x - px)) * (1 - std::abs(y - py));
      kernel.at<float>(py, px) += static_cast<float>(weight / steps);
    }
  }
  return kernel;
}

void Smear(const SpindleCameraTraits& optics, cv::Mat& grey) {
  if (optics.blur_px > 0) {
    const int taps = 2 * static_cast<int>(std::ceil(4 * optics.blur_px)) + 1;
    cv::GaussianBlur(grey, grey, {taps, taps}, optics.blur_px, optics.blur_px,
                     cv::BORDER_REPLICATE);
  }
  if (optics.motion_px > 0) {
    cv::filter2D(grey, grey, CV_32F, MotionKernel(optics.motion_px, optics.motion_rad), {-1, -1}, 0,
                 cv::BORDER_REPLICATE);
  }
}

Page Expose(const SpindleCameraTraits& optics, const cv::Mat& grey, Random& random) {
  Page page;
  page.width = grey.cols;
  page.height = grey.rows;
  page.samples.resize(static_cast<std::size_t>(grey.cols) * static_cast<std::size_t>(grey.rows));
  const bool noisy = optics.read_noise > 0 || optics.shot_noise > 0;
  const double read2 = optics.read_noise * optics.read_noise;
  for (int y = 0; y < grey.rows; ++y) {
    const auto* row = grey.ptr<float>(y);
    std::uint8_t* out = page.row(y);
    for (int x = 0; x < grey.cols; ++x) {
      double value = row[x];
      if (noisy) {
        value += std::sqrt(read2 + optics.shot_noise * std::max(0.0, value)) * random.Normal();
      }
      out[x] = static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
    }
  }
  return page;
}

}  // namespace

SpindleLight RetroLight() {
  SpindleLight light;
  light.white = 215;
  light.dark = 6;
  light.surface = 10;
  light.hidden = 8;
  return light;
}

SpindleClutter ShopClutter() {
  SpindleClutter clutter;
  clutter.grain = 0.05;
  clutter.edges = 4;
  clutter.scratches = 60;
  clutter.chips = 60;
  clutter.holes = 25;
  clutter.words = 12;
  return clutter;
}

Result<Page> TakePicture(const SpindlePicture& picture, const Random& random) {
  Random surface = random.Fork(1);
  Random litter = random.Fork(2);
  Random noise = random.Fork(3);
  cv::Mat grey = SurfaceOf(picture, surface);
  for (const PlacedTarget& target : picture.targets) {
    DrawTarget(picture.lens, picture.light, target, grey);
  }
  Litter(picture.clutter, picture.light.surface, litter, grey);
  Shade(picture.light, grey);
  Smear(picture.optics, grey);
  return Expose(picture.optics, grey, noise);
}

}  // namespace trammel::sim
