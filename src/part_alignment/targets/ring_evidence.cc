#include "part_alignment/targets/ring_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/in_order.h"
#include "part_alignment/targets/soft_grey.h"

namespace trammel::part_alignment {
namespace {

constexpr int kAround = 40;
// Radii of what is looked at in each direction.
constexpr double kWithin = 0.6;
constexpr double kGap = 1.5;
constexpr double kRing = 2.5;
constexpr double kQuiet = 3.45;

constexpr int kFew = 8;
const std::array<FourPlaces, kFew / 4> kFewDirections = AroundByFour<kFew>(0);
const std::array<FourPlaces, kAround / 4> kDirections = AroundByFour<kAround>(0);

/// The picture in a disc's own plane.
class DiscPlane {
 public:
  DiscPlane(const PageView& picture, const DiscModel& disc)
      : soft_(picture), disc_(disc), det_(disc.wxx * disc.wyy - disc.wxy * disc.wxy) {
    constexpr double kRounding_px = 1e-3;
    const Two middle = {disc.column_px, disc.row_px};
    // Of what the disc's circle at that radius lies within, and somewhat more.
    const double beside = std::abs(disc.wxy);
    const Two reach = {kQuiet * (disc.wyy + beside) / det_ + kRounding_px,
                       kQuiet * (disc.wxx + beside) / det_ + kRounding_px};
    has_middle_ = soft_.Has(middle);
    has_all_ = soft_.HasWide(middle - reach) && soft_.HasWide(middle + reach);
  }
  [[nodiscard]] bool HasMiddle() const { return has_middle_; }
  [[nodiscard]] bool HasAll() const { return has_all_; }
  /// Takes the directions that what follows is about.
  [[gnu::always_inline]] inline void LookAlong(const FourPlaces& to) {
    to_.x = (disc_.wyy * to.x - disc_.wxy * to.y) / det_;
    to_.y = (disc_.wxx * to.y - disc_.wxy * to.x) / det_;
  }
  /// @tparam kAll  whether HasAll().
  template <bool kAll>
  [[nodiscard, gnu::always_inline]] inline FourInts Has(double radius) const {
    return kAll ? FourInts{-1, -1, -1, -1} : soft_.Has(PlacesAt(radius));
  }
  template <bool kAll>
  [[nodiscard, gnu::always_inline]] inline FourInts At(double radius) const {
    return kAll ? soft_.AtWide(PlacesAt(radius)) : soft_.At(PlacesAt(radius));
  }

 private:
  [[nodiscard, gnu::always_inline]] inline FourPlaces PlacesAt(double radius) const {
    return {disc_.column_px + radius * to_.x, disc_.row_px + radius * to_.y};
  }

  SoftPicture soft_;
  const DiscModel& disc_;
  double det_;
  FourPlaces to_{};
  bool has_middle_ = false;
  bool has_all_ = false;  ///< out to the quiet zone
};

/// What the directions tell.
struct Around {
  std::array<double, kAround> ink{};    ///< 0: the ring is as the gap, 1: as the disc
  std::array<int, kAround> contrast{};  ///< soft grey, between gap and disc
  int told = 0;
  int lightest = 0;
  int darkest = 1 << 30;
};

int Sum(FourInts of) { return of[0] + of[1] + of[2] + of[3]; }

/// Whether a few directions leave something to look at: most of what is no disc shows in them.
/// @param least  contrast, in soft grey.
template <bool kAll>
[[gnu::always_inline]] inline bool MayBeDisc(DiscPlane& plane, int sign, int least) {
  FourInts few{};
  for (const FourPlaces& directions : kFewDirections) {
    plane.LookAlong(directions);
    few -=
        plane.Has<kAll>(kGap) & (sign * (plane.At<kAll>(kWithin) - plane.At<kAll>(kGap)) >= least);
  }
  return Sum(few) >= kFew / 2;
}

/// Absent where the directions tell too little, or of something else.
/// @param least  contrast, in soft grey.
template <bool kAll>
[[gnu::always_inline]] inline std::optional<Around> LookFor(DiscPlane& plane, int sign,
                                                            double least) {
  constexpr int kLeastTold = 18;
  constexpr double kWildest = 0.7;  // of ink, below 0 and above 1
  constexpr double kCrowded = 0.6;
  const int least_contrast = static_cast<int>(std::ceil(least));
  const int most_against = -static_cast<int>(std::floor(least));
  if (!MayBeDisc<kAll>(plane, sign, least_contrast)) return std::nullopt;
  Around around;
  FourInts against{};  // in which the disc differs the other way
  FourInts wild{};     // in which the ring is neither: another light, or another thing
  FourInts crowded{};  // in which the quiet zone is not as the gap
  FourInts lightest = FourInts{} + around.lightest;
  FourInts darkest = FourInts{} + around.darkest;
  int left = kAround;
  for (const FourPlaces& directions : kDirections) {
    plane.LookAlong(directions);
    const FourInts has = plane.Has<kAll>(kRing);
    const FourInts gap = plane.At<kAll>(kGap);
    const FourInts contrast = sign * (plane.At<kAll>(kWithin) - gap);
    against -= has & (contrast < most_against);
    FourInts tells = has & (contrast >= least_contrast);
    lightest = (tells & (gap > lightest)) ? gap : lightest;
    darkest = (tells & (gap < darkest)) ? gap : darkest;
    const FourDoubles per_contrast = __builtin_convertvector(contrast, FourDoubles);
    const FourDoubles ink =
        __builtin_convertvector(sign * (plane.At<kAll>(kRing) - gap), FourDoubles) / per_contrast;
    const FourDoubles quiet =
        __builtin_convertvector(sign * (plane.At<kAll>(kQuiet) - gap), FourDoubles) / per_contrast;
    const FourInts is_wild =
        __builtin_convertvector((ink < -kWildest) | (ink > 1 + kWildest), FourInts);
    const FourInts is_crowded =
        __builtin_convertvector((quiet < -kCrowded) | (quiet > kCrowded), FourInts);
    wild -= tells & is_wild;
    tells &= ~is_wild;
    crowded -= tells & is_crowded & plane.Has<kAll>(kQuiet);
    for (int k = 0; k < 4; ++k) {
      around.contrast[around.told] = contrast[k];
      around.ink[around.told] = ink[k];
      around.told -= tells[k];
    }
    // As many as may tell in the end.
    left -= 4;
    const int most_told = around.told + left;
    if (std::max({kLeastTold, 2 * Sum(against), Sum(wild), 2 * Sum(crowded)}) > most_told) {
      return std::nullopt;
    }
  }
  for (int k = 0; k < 4; ++k) {
    around.lightest = std::max(around.lightest, lightest[k]);
    around.darkest = std::min(around.darkest, darkest[k]);
  }
  return around;
}

[[gnu::always_inline]] inline std::optional<Around> LookAround(DiscPlane& plane, int sign,
                                                               double least) {
  return plane.HasAll() ? LookFor<true>(plane, sign, least) : LookFor<false>(plane, sign, least);
}

#ifdef __x86_64__
/// The same to the bit.
[[gnu::target("avx2")]] std::optional<Around> LookAroundByAvx2(DiscPlane& plane, int sign,
                                                               double least) {
  return LookAround(plane, sign, least);
}
#endif

std::optional<Around> WhatIsAround(DiscPlane& plane, int sign, double least) {
#ifdef __x86_64__
  if (TakesAvx2()) return LookAroundByAvx2(plane, sign, least);
#endif
  return LookAround(plane, sign, least);
}

/// Directions in which the ring is clearly one of two shades; 0 where it is not in pieces.
int ClearlyInPieces(const Around& around) {
  constexpr double kLeastSpan = 0.3;  // between the shades
  constexpr double kLeastInked = 0.3;
  constexpr double kMostPlain = 0.5;
  constexpr double kFrom = 0.35;  // of the span: what is between is not clear
  constexpr int kLeastChanges = 3;
  constexpr int kMostChanges = 14;
  const int told = around.told;
  const int apart = told / 8;  // from the extremes
  // What is told from counts needs no order.
  int not_inked = 0;
  int not_plain = 0;
  for (int i = 0; i < told; ++i) {
    not_inked += around.ink[i] < kLeastInked ? 1 : 0;
    not_plain += around.ink[i] > kMostPlain ? 1 : 0;
  }
  if (not_inked >= told - apart || not_plain >= told - apart) return 0;
  // Both extremes in order, as the least of the shades and of their opposites, without a branch
  // that could not be guessed.
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::array<Two, kAround / 8 + 1> least;
  least.fill(Two{kNone, kNone});
  for (int i = 0; i < told; ++i) {
    Two next = {around.ink[i], -around.ink[i]};
    for (Two& place : least) {
      const Two lower = next < place ? next : place;
      next = next < place ? place : next;
      place = lower;
    }
  }
  const double plain = least[apart][0];
  const double inked = -least[apart][1];
  if (inked - plain < kLeastSpan) return 0;
  int clear = 0;
  int ink = 0;
  int changes = 0;
  int before = 0;  // 1 ink, -1 paper
  for (int i = 0; i < told; ++i) {
    const double share = (around.ink[i] - plain) / (inked - plain);
    const int shade = (share > 1 - kFrom ? 1 : 0) - (share < kFrom ? 1 : 0);
    clear += shade != 0 ? 1 : 0;
    ink += shade > 0 ? 1 : 0;
    changes += shade * before < 0 ? 1 : 0;
    before = shade != 0 ? shade : before;
  }
  const bool in_pieces = changes >= kLeastChanges && changes <= kMostChanges && ink >= told / 8 &&
                         clear - ink >= told / 8;
  return in_pieces && 8 * clear >= 5 * told ? clear : 0;
}

}  // namespace

std::optional<RingEvidence> FindRingEvidence(const PageView& picture, const DiscModel& disc,
                                             double noise) {
  constexpr double kLeastContrast = 1.5;  // grey levels: rounding makes less
  constexpr double kSigmas = 3 * std::numbers::sqrt2;
  const double least = kSoftUnit * std::max(kLeastContrast, kSigmas * kSoftNoise * noise);
  const int sign = disc.contrast > 0 ? 1 : -1;
  DiscPlane plane(picture, disc);
  // Then all that lies between a place in the picture and the middle is in it, too.
  if (!plane.HasMiddle()) return std::nullopt;
  std::optional<Around> around = WhatIsAround(plane, sign, least);
  if (!around) return std::nullopt;
  RingEvidence ring;
  ring.clear = ClearlyInPieces(*around);
  if (ring.clear == 0) return std::nullopt;
  const auto told = static_cast<std::size_t>(around->told);
  const int median = InOrder(around->contrast, told, told / 2);
  ring.contrast = static_cast<double>(sign * median) / kSoftUnit;
  constexpr double kUneven = 0.25;
  constexpr double kRange = 6;  // sigmas between the extremes of 40 values, seldom more
  const double by_noise = kSoftUnit * kRange * kSoftNoise * noise;
  ring.uneven = around->lightest - around->darkest > kUneven * median + by_noise;
  return ring;
}

void LeaveOutParts(std::vector<UnreadTarget>& unread) {
  constexpr double kSame = 1.2;  // radii
  constexpr double kWithin = 3.2;
  constexpr double kSmaller = 0.7;  // than the disc, what is seen within its ring
  std::stable_sort(unread.begin(), unread.end(), [](const UnreadTarget& a, const UnreadTarget& b) {
    return a.ring.clear > b.ring.clear;
  });
  std::size_t kept = 0;
  for (const UnreadTarget& one : unread) {
    const auto is_part_of = [&](const UnreadTarget& other) {
      const DiscModel& disc = other.disc;
      const double x = one.disc.column_px - disc.column_px;
      const double y = one.disc.row_px - disc.row_px;
      const double u = disc.wxx * x + disc.wxy * y;
      const double v = disc.wxy * x + disc.wyy * y;
      const double radii2 = u * u + v * v;
      return radii2 < kSame * kSame ||
             (radii2 < kWithin * kWithin && MeanRadius(one.disc) < kSmaller * MeanRadius(disc));
    };
    const auto end = unread.begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::none_of(unread.begin(), end, is_part_of)) unread[kept++] = one;
  }
  unread.resize(kept);
}

}  // namespace trammel::part_alignment
