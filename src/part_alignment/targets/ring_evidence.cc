#include "part_alignment/targets/ring_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/quieten.h"

namespace trammel::part_alignment {
namespace {

constexpr int kAround = 40;
// Radii of what is looked at in each direction.
constexpr double kWithin = 0.6;
constexpr double kGap = 1.5;
constexpr double kRing = 2.5;
constexpr double kQuiet = 3.45;

/// The picture in a disc's own plane, in soft grey.
class DiscPlane {
 public:
  DiscPlane(const PageView& picture, const DiscModel& disc)
      : picture_(picture), disc_(disc), det_(disc.wxx * disc.wyy - disc.wxy * disc.wxy) {}

  /// At so many radii in a direction; absent beyond the picture and in its border.
  [[nodiscard]] std::optional<int> At(double radius, const Offset& to) const {
    const double x = disc_.column_px + radius * (disc_.wyy * to.x - disc_.wxy * to.y) / det_ + 0.5;
    const double y = disc_.row_px + radius * (disc_.wxx * to.y - disc_.wxy * to.x) / det_ + 0.5;
    if (!(x >= 1 && y >= 1 && x < picture_.width - 1 && y < picture_.height - 1)) {
      return std::nullopt;
    }
    return SoftGrey(picture_.row(static_cast<int>(y)) + static_cast<int>(x), picture_.stride);
  }

 private:
  const PageView& picture_;
  const DiscModel& disc_;
  double det_;
};

/// What the directions tell.
struct Around {
  std::vector<double> ink;    ///< 0: the ring is as the gap, 1: as the disc
  std::vector<int> contrast;  ///< soft grey, between gap and disc
  int lightest = 0;
  int darkest = std::numeric_limits<int>::max();
};

/// Absent where the directions tell too little, or of something else.
/// @param least  contrast, in soft grey.
std::optional<Around> LookAround(const DiscPlane& plane, int sign, double least) {
  constexpr int kLeastTold = 18;
  constexpr double kWildest = 0.7;  // of ink, below 0 and above 1
  constexpr double kCrowded = 0.6;
  static const auto kDirections = AllAround<kAround>(0);
  Around around;
  int against = 0;  // in which the disc differs the other way
  int wild = 0;     // in which the ring is neither: another light, or another thing
  int crowded = 0;  // in which the quiet zone is not as the gap
  int left = kAround;
  for (const Offset& to : kDirections) {
    --left;
    const auto ring = plane.At(kRing, to);
    const auto gap = plane.At(kGap, to);
    const auto within = plane.At(kWithin, to);
    if (ring && gap && within) {
      const int contrast = sign * (*within - *gap);
      const double ink = static_cast<double>(sign * (*ring - *gap)) / contrast;
      if (contrast < -least) {
        ++against;
      } else if (contrast >= least) {
        around.lightest = std::max(around.lightest, *gap);
        around.darkest = std::min(around.darkest, *gap);
        if (ink < -kWildest || ink > 1 + kWildest) {
          ++wild;
        } else {
          const auto quiet = plane.At(kQuiet, to);
          crowded += quiet && std::abs(*quiet - *gap) > kCrowded * contrast ? 1 : 0;
          around.ink.push_back(ink);
          around.contrast.push_back(contrast);
        }
      }
    }
    const int most_told = static_cast<int>(around.ink.size()) + left;
    if (std::max({kLeastTold, 2 * against, wild, 2 * crowded}) > most_told) return std::nullopt;
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
  const auto told = static_cast<int>(around.ink.size());
  const int apart = told / 8;  // from the extremes
  std::vector<double> in_order = around.ink;
  std::sort(in_order.begin(), in_order.end());
  const double plain = in_order[static_cast<std::size_t>(apart)];
  const double inked = in_order[static_cast<std::size_t>(told - 1 - apart)];
  if (inked < kLeastInked || plain > kMostPlain || inked - plain < kLeastSpan) return 0;
  int clear = 0;
  int ink = 0;
  int changes = 0;
  int before = 0;  // 1 ink, -1 paper
  for (const double at : around.ink) {
    const double share = (at - plain) / (inked - plain);
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
  const double least = kSoftUnit * std::max(kLeastContrast, kSigmas * kQuietNoise * noise);
  const int sign = disc.contrast > 0 ? 1 : -1;
  const DiscPlane plane(picture, disc);
  if (!plane.At(0, {1, 0})) return std::nullopt;
  std::optional<Around> around = LookAround(plane, sign, least);
  if (!around) return std::nullopt;
  RingEvidence ring;
  ring.clear = ClearlyInPieces(*around);
  if (ring.clear == 0) return std::nullopt;
  const auto middle = around->contrast.begin() + std::ssize(around->contrast) / 2;
  std::nth_element(around->contrast.begin(), middle, around->contrast.end());
  ring.contrast = static_cast<double>(sign * *middle) / kSoftUnit;
  constexpr double kUneven = 0.25;
  constexpr double kRange = 6;  // sigmas between the extremes of 40 values, seldom more
  const double by_noise = kSoftUnit * kRange * kQuietNoise * noise;
  ring.uneven = around->lightest - around->darkest > kUneven * *middle + by_noise;
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
