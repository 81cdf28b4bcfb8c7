#include "part_alignment/targets/disc_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/grey_between.h"

namespace trammel::part_alignment {
namespace {

struct Levels {
  int inside = 0;
  int outside = 0;
};

/// Middle and half length of the chord through (x, y); half < 0 where it has no end.
struct Chord {
  double shift = 0;  ///< of the middle from the start, in steps
  double half = -1;
};

/// Chords within what has a run's shade.
class ChordWalker {
 public:
  /// @param most  steps to either side.
  ChordWalker(const PageView& picture, const Run& run, int most)
      : picture_(picture),
        threshold_(static_cast<std::uint8_t>((run.inside + run.outside) / 2)),
        dark_(run.inside < run.outside),
        most_(most) {}

  [[nodiscard]] Chord Through(double x, double y, int dx, int dy) const {
    const int column = static_cast<int>(x + 0.5);
    const int line = static_cast<int>(y + 0.5);
    const std::uint8_t* p = picture_.row(line) + column;
    const std::ptrdiff_t stride = dy * picture_.stride + dx;
    const auto inside = [&](int sign) {
      const int room = std::min({most_ + 1, Room(column, sign * dx, picture_.width),
                                 Room(line, sign * dy, picture_.height)});
      return dark_ ? Inside<true>(p, sign * stride, room) : Inside<false>(p, sign * stride, room);
    };
    const int ahead = inside(1);
    if (ahead < 0) return {};
    const int behind = inside(-1);
    if (behind < 0) return {};
    return {0.5 * (ahead - behind), 0.5 * (ahead + behind + 1)};
  }

  /// Whether the chord down through (x, y) is of 2 pixels or less: most that noise begins.
  [[nodiscard]] bool IsShortDown(double x, double y) const {
    const int line = static_cast<int>(y + 0.5);
    if (line < 2 || line >= picture_.height - 2) return false;  // not known
    const std::uint8_t* p = picture_.row(line) + static_cast<int>(x + 0.5);
    const auto inside = [&](int steps) {
      return ((p[steps * picture_.stride] < threshold_) == dark_) ? 1U : 0U;
    };
    // Branches on single pixels would be guessed wrong half of the time.
    const unsigned above = inside(-1);
    const unsigned below = inside(1);
    return ((above & below) | (above & inside(-2)) | (below & inside(2))) == 0;
  }

 private:
  /// Steps until the picture ends.
  static int Room(int place, int step, int size) {
    if (step == 0) return std::numeric_limits<int>::max();
    return step > 0 ? size - 1 - place : place;
  }

  /// The number of whole steps that stay inside, or -1 where none of `room` leaves it.
  template <bool kDark>
  int Inside(const std::uint8_t* p, std::ptrdiff_t stride, int room) const {
    const std::uint8_t threshold = threshold_;
    for (int steps = 0; steps < room; ++steps) {
      p += stride;
      if ((*p < threshold) != kDark) return steps;
    }
    return -1;
  }

  const PageView& picture_;
  std::uint8_t threshold_;
  bool dark_;
  int most_;
};

/// Where a ray's shade crosses the threshold.
struct Edge {
  double at = -1;    ///< distance along the ray; < 0: it does not cross
  double slope = 0;  ///< grey levels per px
};

/// @param from, most  of the distance; the ray must not leave the picture before `most`.
Edge Crossing(const PageView& picture, double x, double y, double dx, double dy,
              const Levels& levels, double from, double most) {
  const int twice_threshold = levels.inside + levels.outside;
  const bool dark = levels.inside < levels.outside;
  const auto is_outside = [&](double grey) { return (2 * grey < twice_threshold) != dark; };
  // By nearest pixels, whose places are counted in 65536ths.
  constexpr double kOne = 65536;
  auto column = static_cast<std::int64_t>((x + from * dx + 0.5) * kOne);
  auto row = static_cast<std::int64_t>((y + from * dy + 0.5) * kOne);
  const auto column_step = static_cast<std::int64_t>(dx * kOne);
  const auto row_step = static_cast<std::int64_t>(dy * kOne);
  double at = from;
  while (at <= most &&
         ((2 * picture.row(static_cast<int>(row >> 16))[column >> 16] < twice_threshold) == dark)) {
    column += column_step;
    row += row_step;
    at += 1;
  }
  if (at == from || at > most) return {};
  // Between pixels, from a step before.
  const auto grey_at = [&](double place) {
    return Between(picture, x + place * dx, y + place * dy);
  };
  at -= 1;
  double previous = grey_at(at);
  if (is_outside(previous)) {
    at -= 1;
    if (at < from) return {};
    previous = grey_at(at);
    if (is_outside(previous)) return {};
  }
  for (at += 1; at <= most; at += 1) {
    const double grey = grey_at(at);
    if (is_outside(grey)) {
      const double slope = grey - previous;
      return {at - (grey - 0.5 * twice_threshold) / slope, std::abs(slope)};
    }
    previous = grey;
  }
  return {};
}

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
Offset RimAt(const Middle& middle, const Directions& direction) {
  return {middle.xx * direction.x() + middle.xy * direction.y(),
          middle.xy * direction.x() + middle.yy * direction.y()};
}

/// The levels within the middle, and in the gap. The row that found the disc may have crossed it
/// close to its rim, and the chords may be a pixel too long. Absent close to the picture's border.
std::optional<Levels> LevelsAbout(const PageView& picture, const Middle& middle, bool dark) {
  constexpr int kAround = 12;
  constexpr double kBeyond = 1.35;  // of the chords: short of the ring even where they are too long
  std::array<int, kAround> outside{};
  std::size_t count = 0;
  Directions direction(0.5 * std::numbers::pi / kAround, 2 * std::numbers::pi / kAround);
  for (int i = 0; i < kAround; ++i, direction.Next()) {
    const Offset rim = RimAt(middle, direction);
    const double x = middle.column_px + kBeyond * rim.x + 0.5;
    const double y = middle.row_px + kBeyond * rim.y + 0.5;
    if (!(x >= 0 && y >= 0 && x < picture.width && y < picture.height)) continue;
    outside[count++] = picture.row(static_cast<int>(y))[static_cast<int>(x)];
  }
  if (count < kAround / 2) return std::nullopt;
  // Blur of disc and ring draws all of them towards the ink: a quarter of the way from the other
  // end.
  const auto chosen = outside.begin() + static_cast<int>(dark ? count - 1 - count / 4 : count / 4);
  std::nth_element(outside.begin(), chosen, outside.begin() + static_cast<int>(count));
  const auto x = static_cast<int>(middle.column_px + 0.5);
  const auto y = static_cast<int>(middle.row_px + 0.5);
  int sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += picture.row(y + dy)[x + dx];
  }
  return Levels{(sum + 4) / 9, *chosen};
}

/// Half chords through an ellipse's middle, px.
struct HalfChords {
  double across = 0;
  double down = 0;
  double falling = 0;  ///< towards the lower right
  double rising = 0;
};

/// The ellipse with these half chords, as Middle has it; false where they are of none.
bool EllipseOfChords(const HalfChords& half, Middle& middle) {
  // On its rim a x² + 2 b x y + c y² = 1: four chords for three numbers.
  const auto form = [](double chord) { return 1 / (chord * chord); };
  const double a = form(half.across);
  const double c = form(half.down);
  const double falling = form(half.falling);
  const double rising = form(half.rising);
  const double shortest = std::min({half.across, half.down, half.falling, half.rising});
  const double unlike = 1.35 + 2 / shortest;  // chords are counted in whole steps
  if (falling + rising > unlike * (a + c) || a + c > unlike * (falling + rising)) return false;
  const double b = 0.5 * (falling - rising);
  const double mean = 0.5 * (a + c);
  const double spread = std::hypot(0.5 * (a - c), b);
  constexpr double kLeastRatio = 0.29;  // of the axes: the cosine of 73 degrees
  const double least = std::max(0.0, kLeastRatio - 0.5 / shortest);
  if (mean - spread < least * least * (mean + spread)) return false;
  // The inverse of the form's square root.
  const double root = std::sqrt((mean - spread) * (mean + spread));
  const double norm = root * std::sqrt(2 * (mean + root));
  middle.xx = (c + root) / norm;
  middle.xy = -b / norm;
  middle.yy = (a + root) / norm;
  return true;
}

}  // namespace

std::optional<Middle> WalkToMiddle(const PageView& picture, const Run& run, double min_radius_px,
                                   double max_radius_px) {
  const int most = static_cast<int>(2 * max_radius_px) + 2;
  const double least_half = 0.5 * min_radius_px;  // as of a disc tilted by 75 degrees
  // Two rounds are enough for a disc from the front; chords of an ellipse that lies askew halve the
  // way that is left in each.
  constexpr int kMostRounds = 10;
  constexpr double kThere_px = 1;
  Middle middle;
  middle.column_px = 0.5 * (run.first + run.last);
  middle.row_px = run.row;
  HalfChords half;
  const ChordWalker walker(picture, run, most);
  constexpr double kShort_px = 1.5;  // a half of
  if (least_half >= kShort_px && walker.IsShortDown(middle.column_px, middle.row_px)) {
    return std::nullopt;
  }
  double before_px = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const Chord down = walker.Through(middle.column_px, middle.row_px, 0, 1);
    if (down.half < least_half) return std::nullopt;
    middle.row_px = static_cast<int>(middle.row_px + 0.5) + down.shift;
    const Chord across = walker.Through(middle.column_px, middle.row_px, 1, 0);
    if (across.half < least_half) return std::nullopt;
    middle.column_px = static_cast<int>(middle.column_px + 0.5) + across.shift;
    half.down = down.half;
    half.across = across.half;
    const bool there = std::abs(down.shift) <= kThere_px && std::abs(across.shift) <= kThere_px;
    if (round > 0 && there) break;
    // In an ellipse each round leaves less of the way.
    const double way_px = std::abs(down.shift) + std::abs(across.shift);
    if (round > 1 && way_px > before_px) return std::nullopt;
    before_px = way_px;
  }
  // No parallelogram of half chords through an ellipse's middle is smaller than that of its axes.
  constexpr double kChordError_px = 0.6;
  const double least = min_radius_px - kChordError_px;
  if (half.across * half.down < least * least) return std::nullopt;
  for (const int dy : {1, -1}) {
    const Chord chord = walker.Through(middle.column_px, middle.row_px, 1, dy);
    if (chord.half < 0 || std::abs(chord.shift) > 0.2 * chord.half + 1.5) return std::nullopt;
    (dy > 0 ? half.falling : half.rising) = std::numbers::sqrt2 * chord.half;
  }
  if (!EllipseOfChords(half, middle)) return std::nullopt;
  return middle;
}

std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle, bool dark,
                                   double min_contrast) {
  const std::optional<Levels> levels = LevelsAbout(picture, middle, dark);
  if (!levels || (levels->inside < levels->outside) != dark) return std::nullopt;
  if (std::abs(levels->inside - levels->outside) < min_contrast) return std::nullopt;
  constexpr double kNearest = 0.7;  // of the way to the rim
  constexpr double kFarthest = 1.5;
  constexpr int kHalf = 12;
  constexpr int kMostMissing = 4;
  constexpr int kStride = 5;  // rays from all around first: what is no disc shows soon
  const double x = middle.column_px;
  const double y = middle.row_px;
  const double most_x = kFarthest * std::hypot(middle.xx, middle.xy) + 2;
  const double most_y = kFarthest * std::hypot(middle.xy, middle.yy) + 2;
  const bool within = x >= most_x && y >= most_y && x + most_x <= picture.width - 1 &&
                      y + most_y <= picture.height - 1;
  std::array<Offset, 2 * kHalf> points;
  std::size_t count = 0;
  double slopes = 0;
  std::optional<DiscModel> disc;
  // Half of the rays tell most of what is no disc.
  for (const int half : {1, 2}) {
    constexpr double kStep = 2 * std::numbers::pi / kHalf;
    Directions direction((half == 1 ? 0.25 : 0.75) * kStep, kStride * kStep);
    for (int i = 0; i < kHalf; ++i, direction.Next()) {
      const Offset rim = RimAt(middle, direction);
      const double reach = std::hypot(rim.x, rim.y);
      const double dx = rim.x / reach;
      const double dy = rim.y / reach;
      const double most = kFarthest * reach + 2;
      const double end = within ? most : std::min(most, RoomAlong(picture, x, y, dx, dy));
      const Edge edge = Crossing(picture, x, y, dx, dy, *levels, std::floor(kNearest * reach), end);
      if (edge.at > 0) points[count++] = {edge.at * dx, edge.at * dy};
      slopes += edge.slope;
      const int rays = (half - 1) * kHalf + i + 1;
      if (static_cast<int>(count) < rays - kMostMissing) return std::nullopt;
    }
    const std::span<const Offset> found(points.data(), count);
    disc = EllipseThrough(found, std::hypot(middle.xx, middle.yy));
    if (!disc) return std::nullopt;
    if (DistanceFrom(*disc, found) > 0.25 + 0.03 * MeanRadius(*disc)) {
      return std::nullopt;
    }
  }
  disc->column_px += x;
  disc->row_px += y;
  disc->background = levels->outside;
  disc->contrast = levels->inside - levels->outside;
  constexpr double kSteepest = 0.3989;  // of the normal integral
  const double blur_px = kSteepest * std::abs(disc->contrast) * static_cast<double>(count) / slopes;
  disc->blur_px = std::clamp(blur_px, 0.4, std::max(0.4, 0.3 * MeanRadius(*disc)));
  return disc;
}

}  // namespace trammel::part_alignment
