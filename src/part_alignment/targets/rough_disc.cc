#include "part_alignment/targets/rough_disc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/four.h"
#include "part_alignment/targets/grey_between.h"
#include "part_alignment/targets/in_order.h"

namespace trammel::part_alignment {
namespace {

struct Levels {
  int inside = 0;
  int outside = 0;
};

/// Rays from one place, four at a time.
struct FourRays {
  FourPlaces along;  ///< unit vectors
  FourDoubles from;  ///< whole px, where what is looked at begins
  FourDoubles most;  ///< px, where it ends: in the picture
};

/// Where rays' shade crosses the threshold.
struct FourEdges {
  FourDoubles at;     ///< distance along the ray; < 0: it does not cross
  FourDoubles slope;  ///< grey levels per px
};

/// Where shade crosses the threshold between the levels.
class EdgeFinder {
 public:
  EdgeFinder(const PageView& picture, double x, double y, const Levels& levels)
      : picture_(picture),
        x_(x),
        y_(y),
        twice_threshold_(levels.inside + levels.outside),
        dark_(levels.inside < levels.outside) {}

  [[nodiscard, gnu::always_inline]] inline FourEdges Crossings(const FourRays& rays) const {
    const FourInts steps = StepsInside(rays);
    const FourInts may_cross = (steps > 0) & (steps <= MostSteps(rays));
    // Between pixels, from a step or two before until a step after.
    const FourDoubles end = rays.from + __builtin_convertvector(steps, FourDoubles);
    const FourDoubles earliest = GreyAt(rays, end - 2);
    const FourDoubles before = GreyAt(rays, end - 1);
    const FourDoubles at_end = GreyAt(rays, end);
    const FourDoubles after = GreyAt(rays, end + 1);
    const FourLongs early = IsOutside(before);
    const FourLongs on_time = ~early & IsOutside(at_end);
    const FourLongs late = ~early & ~on_time;
    const FourLongs wide = __builtin_convertvector(may_cross, FourLongs);
    const FourDoubles previous = early ? earliest : on_time ? before : at_end;
    const FourDoubles grey = early ? before : on_time ? at_end : after;
    const FourDoubles place = early ? end - 1 : on_time ? end : end + 1;
    const FourLongs in_doubt = wide & late & ~(IsOutside(after) & (place <= rays.most));
    const FourLongs crosses =
        wide & ~in_doubt & ~(early & (IsOutside(earliest) | (end - 2 < rays.from)));
    const FourDoubles slope = grey - previous;
    FourEdges edges;
    edges.at = crosses ? place - (grey - 0.5 * twice_threshold_) / slope : FourDoubles{} - 1;
    edges.slope = crosses ? (slope < 0 ? -slope : slope) : FourDoubles{};
    for (int k = 0; k < 4; ++k) {
      if (in_doubt[k] != 0) FollowOn(rays, k, place[k] + 1, after[k], edges);
    }
    return edges;
  }

 private:
  [[nodiscard, gnu::always_inline]] static inline FourInts MostSteps(const FourRays& rays) {
    return __builtin_convertvector(rays.most, FourInts) -
           __builtin_convertvector(rays.from, FourInts);
  }

  [[nodiscard, gnu::always_inline]] inline FourLongs IsOutside(FourDoubles grey) const {
    const FourDoubles twice = 2 * grey;
    const FourDoubles threshold = FourDoubles{} + twice_threshold_;
    return dark_ ? twice >= threshold : twice < threshold;
  }

  /// Of places that are put within what is looked at.
  [[nodiscard, gnu::always_inline]] inline FourDoubles GreyAt(const FourRays& rays,
                                                              FourDoubles place) const {
    place = place > rays.from ? place : rays.from;
    place = place < rays.most ? place : rays.most;
    return Between(picture_, FourPlaces{x_ + place * rays.along.x, y_ + place * rays.along.y});
  }

  /// The whole steps from the begin of each ray whose nearest pixels stay inside; more than there
  /// are where all do.
  [[nodiscard, gnu::always_inline]] inline FourInts StepsInside(const FourRays& rays) const {
    // Places are counted in 65536ths of a pixel.
    constexpr double kOne = 65536;
    const FourInts most = MostSteps(rays);
    FourInts steps{};
    FourInts goes_on = most >= 0;
    const auto begin = [](FourDoubles place) __attribute__((always_inline)) {
      return __builtin_convertvector((place + 0.5) * kOne, FourInts);
    };
    FourInts column = begin(x_ + rays.from * rays.along.x) & goes_on;
    FourInts row = begin(y_ + rays.from * rays.along.y) & goes_on;
    const FourInts column_step = __builtin_convertvector(rays.along.x * kOne, FourInts);
    const FourInts row_step = __builtin_convertvector(rays.along.y * kOne, FourInts);
    while (Any(goes_on)) {
      const FourInts offset =
          (row >> 16) * static_cast<std::int32_t>(picture_.stride) + (column >> 16);
      FourInts grey;
      for (int k = 0; k < 4; ++k) grey[k] = picture_.data[offset[k]];
      const FourInts is_low = 2 * grey < twice_threshold_;
      goes_on &= dark_ ? is_low : ~is_low;
      steps -= goes_on;
      goes_on &= steps <= most;
      column += column_step & goes_on;
      row += row_step & goes_on;
    }
    return steps;
  }

  /// Looks for the edge of ray k from a place on, a step before which the shade is `previous`.
  void FollowOn(const FourRays& rays, int k, double place, double previous,
                FourEdges& edges) const {
    for (; place <= rays.most[k]; place += 1) {
      const double grey =
          Between(picture_, x_ + place * rays.along.x[k], y_ + place * rays.along.y[k]);
      if ((2 * grey < twice_threshold_) != dark_) {
        const double slope = grey - previous;
        edges.at[k] = place - (grey - 0.5 * twice_threshold_) / slope;
        edges.slope[k] = std::abs(slope);
        return;
      }
      previous = grey;
    }
  }

  const PageView& picture_;
  double x_;
  double y_;
  int twice_threshold_;
  bool dark_;
};

/// How far a ray goes until it leaves the picture.
double RoomAlong(const PageView& picture, double x, double y, double dx, double dy) {
  const auto along = [](double place, double step, int size) {
    constexpr double kStill = 1e-9;
    if (std::abs(step) < kStill) return std::numeric_limits<double>::infinity();
    return (step > 0 ? size - 1 - place : -place) / step;
  };
  return std::min(along(x, dx, picture.width), along(y, dy, picture.height));
}

/// Of the ellipse, from its middle.
Offset RimAt(const Middle& middle, Two direction) {
  return {middle.xx * direction[0] + middle.xy * direction[1],
          middle.xy * direction[0] + middle.yy * direction[1]};
}

/// Where rays from a middle cross half the contrast.
class RimFinder {
 public:
  RimFinder(const PageView& picture, const Middle& middle, const Levels& levels)
      : picture_(picture),
        middle_(middle),
        edges_(picture, middle.column_px, middle.row_px, levels) {
    const double most_x = kFarthest * std::hypot(middle.xx, middle.xy) + 2;
    const double most_y = kFarthest * std::hypot(middle.xy, middle.yy) + 2;
    within_ = middle.column_px >= most_x && middle.row_px >= most_y &&
              middle.column_px + most_x <= picture.width - 1 &&
              middle.row_px + most_y <= picture.height - 1;
  }

  /// Casts the rays of a half, 0 or 1; false as soon as too many have crossed nothing.
  bool Find(int half) {
#ifdef __x86_64__
    if (TakesAvx2()) return FindByAvx2(half);
#endif
    return FindAll(half);
  }

  [[nodiscard]] std::span<const Offset> points() const { return {points_.data(), count_}; }
  /// Of all edges, grey levels per px.
  [[nodiscard]] double slopes() const { return slopes_; }

 private:
  static constexpr double kNearest = 0.7;  // of the way to the rim
  static constexpr double kFarthest = 1.5;
  static constexpr std::size_t kHalf = 12;

#ifdef __x86_64__
  /// The same to the bit.
  [[gnu::target("avx2")]] bool FindByAvx2(int half) { return FindAll(half); }
#endif

  [[gnu::always_inline]] inline bool FindAll(int half) {
    constexpr int kMostMissing = 4;
    constexpr int kStride = 5;  // rays from all around first: what is no disc shows soon
    constexpr double kStep = 2 * std::numbers::pi / kHalf;
    static const std::array kDirections{AroundByFour<kHalf>(0.25 * kStep, kStride),
                                        AroundByFour<kHalf>(0.75 * kStep, kStride)};
    int rays = half * static_cast<int>(kHalf);
    for (const FourPlaces& directions : kDirections[half]) {
      const FourRays four = RaysAlong(directions);
      const FourEdges edges = edges_.Crossings(four);
      for (int k = 0; k < 4; ++k) {
        points_[count_] = {edges.at[k] * four.along.x[k], edges.at[k] * four.along.y[k]};
        count_ += edges.at[k] > 0 ? 1 : 0;
        slopes_ += edges.slope[k];
      }
      rays += 4;
      if (static_cast<int>(count_) < rays - kMostMissing) return false;
    }
    return true;
  }

  [[nodiscard, gnu::always_inline]] inline FourRays RaysAlong(const FourPlaces& directions) const {
    const FourPlaces rim{middle_.xx * directions.x + middle_.xy * directions.y,
                         middle_.xy * directions.x + middle_.yy * directions.y};
    const FourDoubles reach = Lengths(rim);
    FourRays rays;
    rays.along = {rim.x / reach, rim.y / reach};
    rays.most = kFarthest * reach + 2;
    rays.from =
        __builtin_convertvector(__builtin_convertvector(kNearest * reach, FourInts), FourDoubles);
    if (!within_) {
      for (int k = 0; k < 4; ++k) {
        rays.most[k] = std::min(rays.most[k], RoomAlong(picture_, middle_.column_px, middle_.row_px,
                                                        rays.along.x[k], rays.along.y[k]));
      }
    }
    return rays;
  }

  const PageView& picture_;
  const Middle& middle_;
  EdgeFinder edges_;
  bool within_ = false;  ///< whether no ray can leave the picture
  std::array<Offset, 2 * kHalf> points_;
  std::size_t count_ = 0;
  double slopes_ = 0;
};

constexpr int kGapPlaces = 12;

/// The levels within the middle, and in the gap. The row that found the disc may have crossed it
/// close to its rim, and the chords may be a pixel too long. Absent close to the picture's border.
std::optional<Levels> LevelsAbout(const PageView& picture, const Middle& middle, bool dark) {
  constexpr double kBeyond = 1.35;  // of the chords: short of the ring even where they are too long
  std::array<std::uint8_t, kGapPlaces> outside{};
  std::size_t count = 0;
  static const auto kDirections = AllAround<kGapPlaces>(0.5 * std::numbers::pi / kGapPlaces);
  for (const Two& direction : kDirections) {
    const Offset rim = RimAt(middle, direction);
    const double x = middle.column_px + kBeyond * rim.x + 0.5;
    const double y = middle.row_px + kBeyond * rim.y + 0.5;
    if (!(x >= 0 && y >= 0 && x < picture.width && y < picture.height)) continue;
    outside[count++] = picture.row(static_cast<int>(y))[static_cast<int>(x)];
  }
  if (count < kGapPlaces / 2) return std::nullopt;
  // Blur of disc and ring draws all of them towards the ink: a quarter of the way from the other
  // end.
  const int chosen = InOrder(outside, count, dark ? count - 1 - count / 4 : count / 4);
  const auto x = static_cast<int>(middle.column_px + 0.5);
  const auto y = static_cast<int>(middle.row_px + 0.5);
  int sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += picture.row(y + dy)[x + dx];
  }
  return Levels{(sum + 4) / 9, chosen};
}

}  // namespace

std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle, bool dark,
                                   double min_contrast) {
  const std::optional<Levels> levels = LevelsAbout(picture, middle, dark);
  if (!levels || (levels->inside < levels->outside) != dark) return std::nullopt;
  if (std::abs(levels->inside - levels->outside) < min_contrast) return std::nullopt;
  const double x = middle.column_px;
  const double y = middle.row_px;
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
  disc->column_px += x;
  disc->row_px += y;
  disc->background = levels->outside;
  disc->contrast = levels->inside - levels->outside;
  constexpr double kSteepest = 0.3989;  // of the normal integral
  const double blur_px = kSteepest * std::abs(disc->contrast) *
                         static_cast<double>(rim.points().size()) / rim.slopes();
  disc->blur_px = std::clamp(blur_px, 0.4, std::max(0.4, 0.3 * MeanRadius(*disc)));
  return disc;
}

}  // namespace trammel::part_alignment
