#include "part_alignment/targets/blob_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/quieten.h"

namespace trammel::part_alignment {
namespace {

constexpr int kWindow_px = 15;  ///< averaging window: shows the gap about a small disc

/// Range of radii for the search, px of the searched picture.
struct Radii {
  double least = 0;
  double most = 0;
};

double RadiusOf(const Middle& of) { return std::sqrt(of.xx * of.yy - of.xy * of.xy); }

/// Returns the ellipse with the moments of an outline's area; absent if that is no ellipse.
std::optional<Middle> EllipseOf(const std::vector<cv::Point>& outline, const Radii& radii) {
  constexpr double kPi = std::numbers::pi;
  constexpr double kMinRatio = 0.25;  // ratio of the axes
  constexpr double kMinFilled = 0.9;  // area by that of the ellipse of the same moments
  const double area = cv::contourArea(outline);
  if (area < 0.5 * kPi * radii.least * radii.least * kMinRatio ||
      area > kPi * radii.most * radii.most) {
    return std::nullopt;
  }
  const cv::Moments moments = cv::moments(outline);
  const double a = moments.mu20 / moments.m00;
  const double b = moments.mu11 / moments.m00;
  const double c = moments.mu02 / moments.m00;
  const double det = a * c - b * b;
  if (!(det > 0)) return std::nullopt;
  const double root = std::sqrt(det);
  if (area < kMinFilled * 4 * kPi * root) return std::nullopt;
  const double mean = 0.5 * (a + c);
  const double spread = std::hypot(0.5 * (a - c), b);
  if (mean - spread < kMinRatio * kMinRatio * (mean + spread)) return std::nullopt;
  // An ellipse's variance along an axis is a quarter of the axis' square. The outline runs through
  // the middles of its pixels, half a pixel within.
  const double norm = 0.5 * std::sqrt(a + c + 2 * root);
  const double wider = 1 + 0.5 / (2 * std::sqrt(root));
  Middle middle;
  middle.column_px = moments.m10 / moments.m00;
  middle.row_px = moments.m01 / moments.m00;
  middle.xx = wider * (a + root) / norm;
  middle.xy = wider * b / norm;
  middle.yy = wider * (c + root) / norm;
  const double radius = RadiusOf(middle);
  if (radius < radii.least || radius > radii.most) return std::nullopt;
  return middle;
}

/// @param least_step  grey levels of difference from the mean around.
void AddBlobs(const cv::Mat& picture, const Radii& radii, double min_step,
              std::vector<Blob>& blobs) {
  cv::Mat around;
  cv::boxFilter(picture, around, CV_8U, {kWindow_px, kWindow_px}, {-1, -1}, true,
                cv::BORDER_REPLICATE);
  cv::Mat differs;
  for (const bool dark : {true, false}) {
    cv::subtract(dark ? around : picture, dark ? picture : around, differs);
    cv::threshold(differs, differs, min_step, 255, cv::THRESH_BINARY);
    std::vector<std::vector<cv::Point>> outlines;
    std::vector<cv::Vec4i> levels;
    cv::findContours(differs, outlines, levels, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE);
    for (std::size_t i = 0; i < outlines.size(); ++i) {
      constexpr int kParent = 3;
      if (levels[i][kParent] >= 0 || outlines[i].size() < 4) continue;  // hole or noise
      if (const auto middle = EllipseOf(outlines[i], radii)) blobs.push_back({*middle, dark});
    }
  }
}

struct Levels {
  int inside = 0;
  int outside = 0;
};

/// Returns the vector from the ellipse's middle to its rim.
Offset RimAt(const Middle& middle, const Offset& direction) {
  return {middle.xx * direction.x + middle.xy * direction.y,
          middle.xy * direction.x + middle.yy * direction.y};
}

/// Returns the distance along a ray to the picture's edge.
double RoomAlong(const PageView& picture, const Middle& middle, const Offset& along) {
  const auto room = [](double place, double step, int size) {
    constexpr double kStill = 1e-9;
    if (std::abs(step) < kStill) return std::numeric_limits<double>::infinity();
    return (step > 0 ? size - 1 - place : -place) / step;
  };
  return std::min(room(middle.column_px, along.x, picture.width),
                  room(middle.row_px, along.y, picture.height));
}

/// Finds where rays from a middle cross half the contrast.
class RimFinder {
 public:
  RimFinder(const PageView& picture, const Middle& middle, const Levels& levels)
      : picture_(picture),
        middle_(middle),
        threshold_(0.5 * (levels.inside + levels.outside)),
        dark_(levels.inside < levels.outside) {}

  /// Casts the rays of a half, 0 or 1; false as soon as too many have crossed nothing.
  bool Find(int half) {
    constexpr int kMaxMissing = 4;
    constexpr int kStride = 5;  // rays from all around first: what is no disc shows soon
    constexpr double kStep = 2 * std::numbers::pi / kHalf;
    static const std::array kDirections{AllAround<kHalf>(0.25 * kStep, kStride),
                                        AllAround<kHalf>(0.75 * kStep, kStride)};
    int rays = half * kHalf;
    for (const Offset& direction : kDirections[static_cast<std::size_t>(half)]) {
      Cast(direction);
      if (static_cast<int>(points_.size()) < ++rays - kMaxMissing) return false;
    }
    return true;
  }

  [[nodiscard]] const std::vector<Offset>& points() const { return points_; }
  /// Sum over all edges, grey levels per px.
  [[nodiscard]] double slopes() const { return slopes_; }

 private:
  static constexpr int kHalf = 12;

  void Cast(const Offset& direction) {
    constexpr double kNearest = 0.7;  // share of the way to the rim
    constexpr double kFarthest = 1.5;
    const Offset rim = RimAt(middle_, direction);
    const double reach = std::hypot(rim.x, rim.y);
    const Offset along{rim.x / reach, rim.y / reach};
    const double most = std::min(kFarthest * reach + 2, RoomAlong(picture_, middle_, along));
    double place = std::floor(kNearest * reach);
    if (place > most) return;
    double previous = GreyAt(along, place);
    if (IsOutside(previous)) return;
    for (place += 1; place <= most; place += 1) {
      const double grey = GreyAt(along, place);
      if (IsOutside(grey)) {
        const double slope = grey - previous;
        const double at = place - (grey - threshold_) / slope;
        points_.push_back({at * along.x, at * along.y});
        slopes_ += std::abs(slope);
        return;
      }
      previous = grey;
    }
  }

  [[nodiscard]] double GreyAt(const Offset& along, double place) const {
    return Between(picture_, middle_.column_px + place * along.x, middle_.row_px + place * along.y);
  }
  [[nodiscard]] bool IsOutside(double grey) const { return (grey < threshold_) != dark_; }

  const PageView& picture_;
  const Middle& middle_;
  double threshold_;
  bool dark_;
  std::vector<Offset> points_;
  double slopes_ = 0;
};

/// Measures the levels within the middle, and in the gap. The outline that found the disc may be
/// outside of its edge. Absent close to the picture's border.
std::optional<Levels> LevelsAbout(const PageView& picture, const Middle& middle, bool dark) {
  constexpr int kGapPlaces = 12;
  constexpr double kBeyond = 1.35;  // of the ellipse: within the ring even if it is too large
  static const auto kDirections = AllAround<kGapPlaces>(0.5 * std::numbers::pi / kGapPlaces);
  std::array<std::uint8_t, kGapPlaces> outside{};
  std::ptrdiff_t count = 0;
  for (const Offset& direction : kDirections) {
    const Offset rim = RimAt(middle, direction);
    const double x = middle.column_px + kBeyond * rim.x + 0.5;
    const double y = middle.row_px + kBeyond * rim.y + 0.5;
    if (!(x >= 0 && y >= 0 && x < picture.width && y < picture.height)) continue;
    outside[static_cast<std::size_t>(count++)] =
        picture.row(static_cast<int>(y))[static_cast<int>(x)];
  }
  const auto x = static_cast<int>(middle.column_px + 0.5);
  const auto y = static_cast<int>(middle.row_px + 0.5);
  if (count < kGapPlaces / 2 || x < 1 || y < 1 || x > picture.width - 2 || y > picture.height - 2) {
    return std::nullopt;
  }
  // Blur of disc and ring shifts all of them towards the ink: take a quarter of the way from the
  // other end.
  const auto chosen = outside.begin() + (dark ? count - 1 - count / 4 : count / 4);
  std::nth_element(outside.begin(), chosen, outside.begin() + count);
  int sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += picture.row(y + dy)[x + dx];
  }
  return Levels{(sum + 4) / 9, *chosen};
}

/// True if nearly all within the ellipse has the disc's shade: a closed ring is no disc.
bool IsFilled(const PageView& picture, const Middle& middle, const Levels& levels) {
  constexpr int kPlaces = 12;
  constexpr double kWithin = 0.55;
  constexpr int kMaxOutside = 2;
  static const auto kDirections = AllAround<kPlaces>(0);
  const bool dark = levels.inside < levels.outside;
  int outside = 0;
  for (const Offset& direction : kDirections) {
    const Offset rim = RimAt(middle, direction);
    const double x = middle.column_px + kWithin * rim.x + 0.5;
    const double y = middle.row_px + kWithin * rim.y + 0.5;
    if (!(x >= 0 && y >= 0 && x < picture.width && y < picture.height)) continue;
    const int grey = picture.row(static_cast<int>(y))[static_cast<int>(x)];
    outside += (2 * grey < levels.inside + levels.outside) != dark ? 1 : 0;
  }
  return outside <= kMaxOutside;
}

}  // namespace

std::vector<Blob> FindBlobs(const PageView& picture, const BlobRules& rules) {
  constexpr double kMinStep = 2;  // grey levels
  constexpr double kSigmas = 3.2;
  constexpr double kBlurred = 0.273;  // noise remaining after 5 x 5 binomial smoothing
  constexpr double kFoot_px = 2;      // how far beyond its edge a small disc's outline may lie
  // OpenCV's pictures have no constant pixels; it reads this one.
  cv::Mat soft(picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.data),
               static_cast<std::size_t>(picture.stride));
  double noise = kQuietNoise * rules.noise;
  if (rules.noise > kNoisy) {
    cv::Mat softer;
    cv::GaussianBlur(soft, softer, {3, 3}, 0);
    soft = softer;
    noise = kBlurred * rules.noise;
  }
  const double step = std::max(kMinStep, std::ceil(kSigmas * noise));
  const double most = 1.1 * rules.max_radius_px + kFoot_px;
  constexpr double kSpan = 2.8;  // range of radii per scale; the next scale's are twice as large
  Radii radii{rules.min_radius_px - 0.5, kSpan * rules.min_radius_px};
  std::vector<Blob> blobs;
  for (double scale = 1; radii.least * scale < most; scale *= 2) {
    const std::size_t before = blobs.size();
    AddBlobs(soft, {radii.least, std::min(radii.most, most / scale)}, step, blobs);
    for (std::size_t i = before; i < blobs.size(); ++i) {
      Middle& of = blobs[i].middle;
      of.column_px = scale * (of.column_px + 0.5) - 0.5;
      of.row_px = scale * (of.row_px + 0.5) - 0.5;
      of.xx *= scale;
      of.xy *= scale;
      of.yy *= scale;
    }
    if (std::min(soft.cols, soft.rows) < 2 * kWindow_px) break;
    const cv::Size size(soft.cols / 2, soft.rows / 2);
    cv::Mat half;
    cv::resize(soft({0, 0, 2 * size.width, 2 * size.height}), half, size, 0, 0, cv::INTER_AREA);
    soft = half;
    radii.least = rules.min_radius_px;
  }
  std::stable_sort(blobs.begin(), blobs.end(), [](const Blob& a, const Blob& b) {
    return RadiusOf(a.middle) > RadiusOf(b.middle);
  });
  return blobs;
}

std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle, bool dark,
                                   double min_contrast) {
  const std::optional<Levels> levels = LevelsAbout(picture, middle, dark);
  if (!levels || (levels->inside < levels->outside) != dark) return std::nullopt;
  if (std::abs(levels->inside - levels->outside) < min_contrast) return std::nullopt;
  if (!IsFilled(picture, middle, *levels)) return std::nullopt;
  RimFinder rim(picture, middle, *levels);
  std::optional<DiscModel> disc;
  // Half of the rays suffice to reject most false discs.
  for (const int half : {0, 1}) {
    if (!rim.Find(half)) return std::nullopt;
    disc = EllipseThrough(rim.points(), std::hypot(middle.xx, middle.yy));
    if (!disc) return std::nullopt;
    if (DistanceFrom(*disc, rim.points()) > 0.25 + 0.03 * MeanRadius(*disc)) {
      return std::nullopt;
    }
  }
  disc->column_px += middle.column_px;
  disc->row_px += middle.row_px;
  disc->background = levels->outside;
  disc->contrast = levels->inside - levels->outside;
  constexpr double kSteepest = 0.3989;  // slope of the normal integral
  const double blur_px = kSteepest * std::abs(disc->contrast) *
                         static_cast<double>(rim.points().size()) / rim.slopes();
  disc->blur_px = std::clamp(blur_px, 0.4, std::max(0.4, 0.3 * MeanRadius(*disc)));
  return disc;
}

}  // namespace trammel::part_alignment
