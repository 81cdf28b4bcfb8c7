#include "part_alignment/targets/rough_disc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/grey_between.h"

namespace trammel::part_alignment {
namespace {

struct Levels {
  int inside = 0;
  int outside = 0;
};

/// Of the ellipse, from its middle.
Offset RimAt(const Middle& middle, const Offset& direction) {
  return {middle.xx * direction.x + middle.xy * direction.y,
          middle.xy * direction.x + middle.yy * direction.y};
}

/// How far a ray goes until it leaves the picture.
double RoomAlong(const PageView& picture, const Middle& middle, const Offset& along) {
  const auto room = [](double place, double step, int size) {
    constexpr double kStill = 1e-9;
    if (std::abs(step) < kStill) return std::numeric_limits<double>::infinity();
    return (step > 0 ? size - 1 - place : -place) / step;
  };
  return std::min(room(middle.column_px, along.x, picture.width),
                  room(middle.row_px, along.y, picture.height));
}

/// Where rays from a middle cross half the contrast.
class RimFinder {
 public:
  RimFinder(const PageView& picture, const Middle& middle, const Levels& levels)
      : picture_(picture),
        middle_(middle),
        threshold_(0.5 * (levels.inside + levels.outside)),
        dark_(levels.inside < levels.outside) {}

  /// Casts the rays of a half, 0 or 1; false as soon as too many have crossed nothing.
  bool Find(int half) {
    constexpr int kMostMissing = 4;
    constexpr int kStride = 5;  // rays from all around first: what is no disc shows soon
    constexpr double kStep = 2 * std::numbers::pi / kHalf;
    static const std::array kDirections{AllAround<kHalf>(0.25 * kStep, kStride),
                                        AllAround<kHalf>(0.75 * kStep, kStride)};
    int rays = half * kHalf;
    for (const Offset& direction : kDirections[static_cast<std::size_t>(half)]) {
      Cast(direction);
      if (static_cast<int>(points_.size()) < ++rays - kMostMissing) return false;
    }
    return true;
  }

  [[nodiscard]] const std::vector<Offset>& points() const { return points_; }
  /// Of all edges, grey levels per px.
  [[nodiscard]] double slopes() const { return slopes_; }

 private:
  static constexpr int kHalf = 12;

  void Cast(const Offset& direction) {
    constexpr double kNearest = 0.7;  // of the way to the rim
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

/// The levels within the middle, and in the gap. The outline that found the disc may lie outside of
/// its edge. Absent close to the picture's border.
std::optional<Levels> LevelsAbout(const PageView& picture, const Middle& middle, bool dark) {
  constexpr int kGapPlaces = 12;
  constexpr double kBeyond = 1.35;  // of the ellipse: short of the ring even where it is too large
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
  // Blur of disc and ring draws all of them towards the ink: a quarter of the way from the other
  // end.
  const auto chosen = outside.begin() + (dark ? count - 1 - count / 4 : count / 4);
  std::nth_element(outside.begin(), chosen, outside.begin() + count);
  int sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += picture.row(y + dy)[x + dx];
  }
  return Levels{(sum + 4) / 9, *chosen};
}

/// Whether nearly all within the ellipse has the disc's shade: a closed ring is no disc.
bool IsFilled(const PageView& picture, const Middle& middle, const Levels& levels) {
  constexpr int kPlaces = 12;
  constexpr double kWithin = 0.55;
  constexpr int kMostOutside = 2;
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
  return outside <= kMostOutside;
}

}  // namespace

std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle, bool dark,
                                   double min_contrast) {
  const std::optional<Levels> levels = LevelsAbout(picture, middle, dark);
  if (!levels || (levels->inside < levels->outside) != dark) return std::nullopt;
  if (std::abs(levels->inside - levels->outside) < min_contrast) return std::nullopt;
  if (!IsFilled(picture, middle, *levels)) return std::nullopt;
  RimFinder rim(picture, middle, *levels);
  std::optional<DiscModel> disc;
  // Half of the rays tell most of what is no disc.
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
  constexpr double kSteepest = 0.3989;  // of the normal integral
  const double blur_px = kSteepest * std::abs(disc->contrast) *
                         static_cast<double>(rim.points().size()) / rim.slopes();
  disc->blur_px = std::clamp(blur_px, 0.4, std::max(0.4, 0.3 * MeanRadius(*disc)));
  return disc;
}

}  // namespace trammel::part_alignment
