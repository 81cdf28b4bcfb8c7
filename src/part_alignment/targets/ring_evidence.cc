#include "part_alignment/targets/ring_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/soft_grey.h"

namespace trammel::part_alignment {
namespace {

constexpr int kAround = 40;
// Radii of what is looked at in each direction.
constexpr double kWithin = 0.6;
constexpr double kGap = 1.5;
constexpr double kRing = 2.5;
constexpr double kQuiet = 3.45;

const std::array<Two, kAround> kDirections = AllAround<kAround>(0);

/// The picture in a disc's own plane.
class DiscPlane {
 public:
  DiscPlane(const PageView& picture, const DiscModel& disc)
      : soft_(picture),
        middle_{disc.column_px, disc.row_px},
        along_{disc.wyy, disc.wxx},
        across_{disc.wxy, disc.wxy},
        det_(disc.wxx * disc.wyy - disc.wxy * disc.wxy) {
    constexpr double kRounding_px = 1e-3;
    const Two reach = {kQuiet * std::hypot(disc.wyy, disc.wxy) / det_ + kRounding_px,
                       kQuiet * std::hypot(disc.wxx, disc.wxy) / det_ + kRounding_px};
    has_all_ = soft_.Has(middle_ - reach) && soft_.Has(middle_ + reach);
  }
  /// Takes the direction that what follows is about.
  void LookAlong(Two direction) {
    to_ = (along_ * direction - across_ * Two{direction[1], direction[0]}) / det_;
  }
  [[nodiscard]] bool Has(double radius) const {
    return has_all_ || soft_.Has(middle_ + radius * to_);
  }
  [[nodiscard]] int At(double radius) const { return soft_.At(middle_ + radius * to_); }

 private:
  SoftPicture soft_;
  Two middle_;
  Two along_;
  Two across_;
  double det_;
  Two to_{};
  bool has_all_ = false;  ///< out to the quiet zone
};

/// What the directions tell.
struct Around {
  std::array<double, kAround> ink{};    ///< 0: the ring is as the gap, 1: as the disc
  std::array<int, kAround> contrast{};  ///< soft grey, between gap and disc
  int told = 0;
  int against = 0;  ///< directions in which the disc differs the other way
  int wild = 0;     ///< in which the ring is neither: another light, or another thing
  int crowded = 0;  ///< in which the quiet zone is not as the gap
  int lightest = 0;
  int darkest = 1 << 30;
};

/// Absent where they tell too little, or of something else.
std::optional<Around> LookAround(DiscPlane& plane, int sign, double least) {
  constexpr int kLeastTold = 18;
  constexpr double kWildest = 0.7;  // of ink, below 0 and above 1
  constexpr double kCrowded = 0.6;
  Around around;
  for (int i = 0; i < kAround; ++i) {
    // As many as may tell in the end.
    const int most_told = around.told + kAround - i;
    if (std::max({kLeastTold, 2 * around.against, around.wild, 2 * around.crowded}) > most_told) {
      return std::nullopt;
    }
    plane.LookAlong(kDirections[i]);
    if (!plane.Has(kRing)) continue;
    const int gap = plane.At(kGap);
    const int contrast = sign * (plane.At(kWithin) - gap);
    if (contrast < least) {
      around.against += contrast < -least ? 1 : 0;
      continue;
    }
    around.lightest = std::max(around.lightest, gap);
    around.darkest = std::min(around.darkest, gap);
    const auto ink = [&](double radius) {
      return static_cast<double>(sign * (plane.At(radius) - gap)) / contrast;
    };
    const double of_ring = ink(kRing);
    if (of_ring < -kWildest || of_ring > 1 + kWildest) {
      ++around.wild;
      continue;
    }
    around.contrast[around.told] = contrast;
    around.ink[around.told++] = of_ring;
    around.crowded += plane.Has(kQuiet) && std::abs(ink(kQuiet)) > kCrowded ? 1 : 0;
  }
  const int told = around.told;
  if (told < kLeastTold || 2 * around.against > told || around.wild > told ||
      2 * around.crowded > told) {
    return std::nullopt;
  }
  return around;
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
  std::array<double, kAround> sorted = around.ink;
  const auto end = sorted.begin() + told;
  // What is told from counts needs no order.
  const auto not_inked =
      std::count_if(sorted.begin(), end, [](double ink) { return ink < kLeastInked; });
  const auto not_plain =
      std::count_if(sorted.begin(), end, [](double ink) { return ink > kMostPlain; });
  if (not_inked >= told - apart || not_plain >= told - apart) return 0;
  const auto low = sorted.begin() + apart;
  const auto high = end - 1 - apart;
  std::nth_element(sorted.begin(), low, end);
  std::nth_element(low + 1, high, end);
  const double plain = *low;
  const double inked = *high;
  if (inked - plain < kLeastSpan) return 0;
  int clear = 0;
  int ink = 0;
  int changes = 0;
  int before = 0;  // 1 ink, -1 paper
  for (int i = 0; i < told; ++i) {
    const double share = (around.ink[i] - plain) / (inked - plain);
    const int shade = share > 1 - kFrom ? 1 : share < kFrom ? -1 : 0;
    if (shade == 0) continue;
    ++clear;
    ink += shade > 0 ? 1 : 0;
    changes += before != 0 && shade != before ? 1 : 0;
    before = shade;
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
  constexpr double kMiddle = 0;
  if (!plane.Has(kMiddle)) return std::nullopt;
  // Most of what is no disc shows in a few directions.
  constexpr int kFew = 8;
  static const std::array<Two, kFew> kFewDirections = AllAround<kFew>(0);
  int few = 0;
  for (const Two& direction : kFewDirections) {
    plane.LookAlong(direction);
    few += plane.Has(kGap) && sign * (plane.At(kWithin) - plane.At(kGap)) >= least ? 1 : 0;
  }
  if (few < kFew / 2) return std::nullopt;
  std::optional<Around> around = LookAround(plane, sign, least);
  if (!around) return std::nullopt;
  RingEvidence ring;
  ring.clear = ClearlyInPieces(*around);
  if (ring.clear == 0) return std::nullopt;
  const auto median = around->contrast.begin() + around->told / 2;
  std::nth_element(around->contrast.begin(), median, around->contrast.begin() + around->told);
  ring.contrast = static_cast<double>(sign * *median) / kSoftUnit;
  constexpr double kUneven = 0.25;
  constexpr double kRange = 6;  // sigmas between the extremes of 40 values, seldom more
  const double by_noise = kSoftUnit * kRange * kSoftNoise * noise;
  ring.uneven = around->lightest - around->darkest > kUneven * *median + by_noise;
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
