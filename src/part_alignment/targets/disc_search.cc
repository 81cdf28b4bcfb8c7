#include "part_alignment/targets/disc_search.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>

#include "part_alignment/targets/four.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace trammel::part_alignment {
namespace {

/// Middle and half length of the chord through (x, y); half < 0 where it has no end.
struct Chord {
  double shift = 0;  ///< of the middle from the start, in steps
  double half = -1;
};

/// Chords within what has a run's shade.
class ChordWalker {
 public:
  /// @param outside  what is beside the run, grey level.
  /// @param most     steps to either side.
  ChordWalker(const PageView& picture, const Run& run, int outside, int most)
      : picture_(picture),
        threshold_(static_cast<std::uint8_t>((run.inside + outside) / 2)),
        dark_(run.inside < outside),
        most_(most) {}

  template <int kDx, int kDy>
  [[nodiscard, gnu::always_inline]] inline Chord Through(double x, double y) const {
    const int column = static_cast<int>(x + 0.5);
    const int line = static_cast<int>(y + 0.5);
    const std::uint8_t* p = picture_.row(line) + column;
    const std::ptrdiff_t stride = kDy * picture_.stride + kDx;
    const int room_ahead =
        std::min({most_ + 1, Room<kDx>(column, picture_.width), Room<kDy>(line, picture_.height)});
    const int room_behind = std::min(
        {most_ + 1, Room<-kDx>(column, picture_.width), Room<-kDy>(line, picture_.height)});
    const int ahead = kDy == 0 ? InsideRow<1>(p, room_ahead) : Inside(p, stride, room_ahead);
    if (ahead < 0) return {};
    const int behind = kDy == 0 ? InsideRow<-1>(p, room_behind) : Inside(p, -stride, room_behind);
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
  template <int kStep>
  static int Room(int place, int size) {
    if (kStep == 0) return std::numeric_limits<int>::max();
    return kStep > 0 ? size - 1 - place : place;
  }

  /// As Inside, along a row.
  template <int kStep>
  [[gnu::always_inline]] inline int InsideRow(const std::uint8_t* p, int room) const {
    int steps = 0;
#ifdef __SSE2__
    constexpr int kAtOnce = 16;
    constexpr unsigned kAll = 0xffff;
    const __m128i threshold = _mm_set1_epi8(static_cast<char>(threshold_));
    for (; steps + kAtOnce <= room; steps += kAtOnce, p += kStep * kAtOnce) {
      const std::uint8_t* first = kStep > 0 ? p + 1 : p - kAtOnce;
      const __m128i pixels = _mm_loadu_si128(reinterpret_cast<const __m128i*>(first));
      const __m128i bright = _mm_cmpeq_epi8(_mm_max_epu8(pixels, threshold), pixels);
      const unsigned mask = static_cast<unsigned>(_mm_movemask_epi8(bright));
      const unsigned left = dark_ ? mask : mask ^ kAll;
      if (left != 0) {
        return steps + (kStep > 0 ? std::countr_zero(left) : std::countl_zero(left) - kAtOnce);
      }
    }
#endif
    const int rest = Inside(p, kStep, room - steps);
    return rest < 0 ? rest : steps + rest;
  }

  /// The number of whole steps that stay inside, or -1 where none of `room` leaves it.
  [[gnu::always_inline]] inline int Inside(const std::uint8_t* p, std::ptrdiff_t stride,
                                           int room) const {
    const std::uint8_t threshold = threshold_;
    constexpr int kAtOnce = 8;
    // Which of both shades is left cannot be guessed.
    const std::uint64_t none_left = dark_ ? 0 : ~std::uint64_t{0};
    typedef std::uint8_t EightBytes __attribute__((vector_size(8)));
    int steps = 0;
    for (; steps + kAtOnce <= room; steps += kAtOnce, p += kAtOnce * stride) {
      EightBytes pixels{};
      for (int i = 0; i < kAtOnce; ++i) pixels[i] = p[(i + 1) * stride];
      const auto bright = pixels >= threshold;
      std::uint64_t mask = 0;
      std::memcpy(&mask, &bright, sizeof(mask));
      mask ^= none_left;
      if (mask != 0) return steps + std::countr_zero(mask) / 8;
    }
    for (; steps < room; ++steps) {
      p += stride;
      if ((*p < threshold) != dark_) return steps;
    }
    return -1;
  }

  const PageView& picture_;
  std::uint8_t threshold_;
  bool dark_;
  int most_;
};

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

/// @param narrow  set where what has the run's shade is too narrow at its middle: with a threshold
///                closer to that shade it would be, too.
[[gnu::always_inline]] inline std::optional<Middle> WalkBy(const PageView& picture, const Run& run,
                                                           int outside, double min_radius_px,
                                                           double max_radius_px, bool& narrow) {
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
  const ChordWalker walker(picture, run, outside, most);
  constexpr double kShort_px = 1.5;  // a half of
  if (least_half >= kShort_px && walker.IsShortDown(middle.column_px, middle.row_px)) {
    narrow = true;
    return std::nullopt;
  }
  double before_px = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const Chord down = walker.Through<0, 1>(middle.column_px, middle.row_px);
    if (down.half < least_half) return std::nullopt;
    middle.row_px = static_cast<int>(middle.row_px + 0.5) + down.shift;
    const Chord across = walker.Through<1, 0>(middle.column_px, middle.row_px);
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
  const auto is_askew = [](const Chord& chord) {
    return chord.half < 0 || std::abs(chord.shift) > 0.2 * chord.half + 1.5;
  };
  const Chord falling = walker.Through<1, 1>(middle.column_px, middle.row_px);
  if (is_askew(falling)) return std::nullopt;
  const Chord rising = walker.Through<1, -1>(middle.column_px, middle.row_px);
  if (is_askew(rising)) return std::nullopt;
  half.falling = std::numbers::sqrt2 * falling.half;
  half.rising = std::numbers::sqrt2 * rising.half;
  if (!EllipseOfChords(half, middle)) return std::nullopt;
  return middle;
}

/// With the threshold between the shades of disc and surroundings; where a shadow's edge is near,
/// of the shaded ones.
[[gnu::always_inline]] inline std::optional<Middle> Walk(const PageView& picture, const Run& run,
                                                         double min_radius_px,
                                                         double max_radius_px) {
  constexpr double kUnlike = 0.8;
  bool narrow = false;
  const auto walked = WalkBy(picture, run, run.outside, min_radius_px, max_radius_px, narrow);
  if (walked || narrow ||
      std::abs(run.nearer - run.inside) > kUnlike * std::abs(run.outside - run.inside)) {
    return walked;
  }
  return WalkBy(picture, run, run.nearer, min_radius_px, max_radius_px, narrow);
}

#ifdef __x86_64__
/// The same.
[[gnu::target("avx2")]] std::optional<Middle> WalkByAvx2(const PageView& picture, const Run& run,
                                                         double min_radius_px,
                                                         double max_radius_px) {
  return Walk(picture, run, min_radius_px, max_radius_px);
}
#endif

}  // namespace

std::optional<Middle> WalkToMiddle(const PageView& picture, const Run& run, double min_radius_px,
                                   double max_radius_px) {
#ifdef __x86_64__
  if (TakesAvx2()) return WalkByAvx2(picture, run, min_radius_px, max_radius_px);
#endif
  return Walk(picture, run, min_radius_px, max_radius_px);
}

}  // namespace trammel::part_alignment
