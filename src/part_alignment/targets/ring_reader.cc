#include "part_alignment/targets/ring_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/quieten.h"
#include "part_alignment/targets/target.h"

namespace trammel::part_alignment {
namespace {

constexpr int kAround = 40;
// Sampled radii in each direction.
constexpr double kWithin = 0.6;
constexpr double kGap = 1.5;
constexpr double kRing = 2.5;
constexpr double kQuiet = 3.45;

/// The picture in a disc's own plane, in soft grey.
class DiscPlane {
 public:
  DiscPlane(const PageView& picture, const DiscModel& disc)
      : picture_(picture), disc_(disc), det_(disc.wxx * disc.wyy - disc.wxy * disc.wxy) {}

  /// Returns the shade at this radius in a direction; absent beyond the picture and in its border.
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

/// Shades of a ring by direction.
struct Around {
  std::vector<double> ink;    ///< 0: the ring is as the gap, 1: as the disc
  std::vector<int> contrast;  ///< soft grey, between gap and disc
  int lightest = 0;
  int darkest = std::numeric_limits<int>::max();
};

/// Samples around the disc; absent if the directions have too little information, or show something
/// else.
/// @param least  contrast, in soft grey.
std::optional<Around> LookAround(const DiscPlane& plane, int sign, double least) {
  constexpr int kMinTold = 18;
  constexpr double kWildest = 0.7;  // ink below 0 or above 1
  constexpr double kCrowded = 0.6;
  static const auto kDirections = AllAround<kAround>(0);
  Around around;
  int against = 0;  // directions with opposite contrast of the disc
  int wild = 0;     // directions with neither shade: other light or object
  int crowded = 0;  // directions: quiet zone differs from the gap
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
    const int max_told = static_cast<int>(around.ink.size()) + left;
    if (std::max({kMinTold, 2 * against, wild, 2 * crowded}) > max_told) return std::nullopt;
  }
  return around;
}

/// Counts directions in which the ring is clearly one of two shades; 0 if it is not in pieces.
int ClearlyInPieces(const Around& around) {
  constexpr double kMinSpan = 0.3;  // between the shades
  constexpr double kMinInked = 0.3;
  constexpr double kMaxPlain = 0.5;
  constexpr double kFrom = 0.35;  // of the span: shades in between are unclear
  constexpr int kMinChanges = 3;
  constexpr int kMaxChanges = 14;
  const auto told = static_cast<int>(around.ink.size());
  const int apart = told / 8;  // number cut at the extremes
  std::vector<double> in_order = around.ink;
  std::sort(in_order.begin(), in_order.end());
  const double plain = in_order[static_cast<std::size_t>(apart)];
  const double inked = in_order[static_cast<std::size_t>(told - 1 - apart)];
  if (inked < kMinInked || plain > kMaxPlain || inked - plain < kMinSpan) return 0;
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
  const bool in_pieces = changes >= kMinChanges && changes <= kMaxChanges && ink >= told / 8 &&
                         clear - ink >= told / 8;
  return in_pieces && 8 * clear >= 5 * told ? clear : 0;
}

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kPerSegment = 8;  ///< samples
constexpr int kMaxSamples = 20 * kPerSegment;
using Samples = std::array<double, kMaxSamples>;
constexpr int kAgain = kPerSegment;  ///< samples from the circle's begin that follow its end

// Units: contrast; 0 is the surroundings, 1 the disc's shade.
constexpr double kPlain = 0.35;         ///< gap and quiet zone stay below
constexpr double kMaxScratched = 0.12;  ///< share of the quiet zone, beyond a whole ring
constexpr double kMinSpan = 0.35;       ///< between segments without and with ink
constexpr double kMaxLow = 0.3;         ///< segments without ink
constexpr double kMinHigh = 0.5;        ///< segments with ink

// Units of the ring: span between its two shades.
constexpr double kSure = 0.12;      ///< a segment's least distance from the middle
constexpr double kSameShade = 0.3;  ///< segments of one value differ by less
constexpr double kMisfit = 0.45;    ///< deviation of half a segment from its bits
constexpr double kMaxBelow = 0.6;   ///< ring sample below the surroundings
constexpr int kMinInked = 3;        ///< segments of a ring, and as many without ink
constexpr double kBlank = 0.3;      ///< upper limit of all samples if there is no ring

/// Samples along circles of the target, each in units of the contrast.
struct Circles {
  int count = 0;
  std::array<double, kMaxSamples> gap;
  std::array<double, kMaxSamples + kAgain> ring;  ///< the first kAgain repeat after the last
  std::array<double, kMaxSamples> quiet;
};

/// Map from the plane of W (p - c) to the picture.
struct Mapping {
  double cx, cy, xx, xy, yy;
  explicit Mapping(const DiscModel& d) : cx(d.column_px), cy(d.row_px) {
    const double det = d.wxx * d.wyy - d.wxy * d.wxy;
    xx = d.wyy / det;
    xy = -d.wxy / det;
    yy = d.wxx / det;
  }
};

bool Inside(const PageView& picture, const Mapping& map, double radius) {
  const double half_x = radius * std::hypot(map.xx, map.xy);
  const double half_y = radius * std::hypot(map.xy, map.yy);
  return map.cx - half_x >= 0 && map.cx + half_x <= picture.width - 1 && map.cy - half_y >= 0 &&
         map.cy + half_y <= picture.height - 1;
}

constexpr double kGapRadius = 1.5;
constexpr std::array<double, 3> kRingRadii{2.4, 2.5, 2.6};
constexpr double kQuietSample = 3.45;

/// Samples the picture on circles of the target, between pixels.
class CircleSampler {
 public:
  CircleSampler(const PageView& picture, const Mapping& map, int count) : picture_(picture) {
    for (int i = 0; i < count; ++i) {
      const double angle = kTurn * i / count;
      const double u = std::cos(angle);
      const double v = std::sin(angle);
      spokes_[static_cast<std::size_t>(i)] = {map.xx * u + map.xy * v, map.xy * u + map.yy * v};
    }
    middle_ = {map.cx, map.cy};
    count_ = static_cast<std::size_t>(count);
  }

  void SampleAt(double radius, Samples& greys) const {
    for (std::size_t i = 0; i < count_; ++i) {
      greys[i] =
          Between(picture_, middle_.x + radius * spokes_[i].x, middle_.y + radius * spokes_[i].y);
    }
  }

 private:
  const PageView& picture_;
  Offset middle_;
  std::array<Offset, kMaxSamples> spokes_;  ///< at radius 1
  std::size_t count_ = 0;
};

/// Samples gap or quiet zone; returns the share that is not plain, or 1 if it is above `most`.
double SamplePlain(const CircleSampler& sampler, const DiscModel& disc, double radius, double most,
                   int count, Samples& values) {
  sampler.SampleAt(radius, values);
  int disturbed = 0;
  for (int i = 0; i < count; ++i) {
    values[i] = (values[i] - disc.background) / disc.contrast;
    disturbed += std::abs(values[i]) > kPlain ? 1 : 0;
  }
  return disturbed > static_cast<int>(most * count) ? 1 : static_cast<double>(disturbed) / count;
}

/// Samples the ring, scaled between its surroundings and the disc's ink.
void SampleRing(const CircleSampler& sampler, const DiscModel& disc, Circles& circles) {
  std::array<Samples, kRingRadii.size()> greys;
  for (std::size_t k = 0; k < greys.size(); ++k) sampler.SampleAt(kRingRadii[k], greys[k]);
  for (int i = 0; i < circles.count; ++i) {
    // Light that changes across the target changes gap and quiet zone alike; a scratch does not.
    const double gap = circles.gap[i];
    const double quiet = circles.quiet[i];
    const double nearby = std::abs(quiet - gap) > kPlain ? gap : 0.5 * (gap + quiet);
    const double grey = (greys[0][i] + greys[1][i] + greys[2][i]) / kRingRadii.size();
    const double ring = (grey - disc.background) / disc.contrast;
    constexpr double kMinLocal = 0.3;
    // No contrast here: the surroundings are not plain.
    circles.ring[i] = 1 - nearby > kMinLocal ? (ring - nearby) / (1 - nearby) : -1;
  }
  std::copy_n(circles.ring.begin(), kAgain, circles.ring.begin() + circles.count);
}

/// Mean shades of the lighter and of the darker segments.
struct Shades {
  double low = 0;
  double high = 0;
};

Shades TwoShades(const std::vector<double>& shades) {
  const auto [least, most] = std::minmax_element(shades.begin(), shades.end());
  const double between = 0.5 * (*least + *most);
  std::array<double, 2> sum{};
  std::array<int, 2> count{};
  for (const double shade : shades) {
    const std::size_t side = shade > between ? 1 : 0;
    sum[side] += shade;
    ++count[side];
  }
  return {sum[0] / std::max(count[0], 1), sum[1] / std::max(count[1], 1)};
}

/// Finds the start of the segments, in samples from the first, in [0, kPerSegment).
double Phase(const Circles& circles) {
  const int n = circles.count;
  // Squared, so that true edges outweigh noise.
  std::array<double, kPerSegment> squares{};
  double before = circles.ring[n - 1];
  for (int i = 0; i < n; ++i) {
    const double change = circles.ring[i + 1] - before;  // the first follows the last
    squares[i % kPerSegment] += change * change;
    before = circles.ring[i];
  }
  static const auto kDirections = [] {
    std::array<std::complex<double>, kPerSegment> all;
    for (int i = 0; i < kPerSegment; ++i) all[i] = std::polar(1.0, kTurn * i / kPerSegment);
    return all;
  }();
  std::complex<double> sum = 0;
  for (int i = 0; i < kPerSegment; ++i) sum += squares[i] * kDirections[i];
  const double phase = std::arg(sum) / kTurn * kPerSegment;
  return phase < 0 ? phase + kPerSegment : phase;
}

/// Computes the mean of the ring over half a segment from position `from` >= 0; sample i is at
/// position i.
double MeanOverHalf(const Circles& circles, double from) {
  constexpr int kLength = kPerSegment / 2;
  from += 0.5;  // half a sample's width
  const int below = static_cast<int>(from);
  const double share = from - below;
  const double* ring = circles.ring.data() + below % circles.count;
  double sum = ring[0] * (1 - share) + ring[kLength] * share;
  for (int i = 1; i < kLength; ++i) sum += ring[i];
  return sum / kLength;
}

/// True if each of the two shades is uniform, and every half segment matches its neighbours.
bool IsConsistent(const Circles& circles, const std::vector<double>& shades, std::uint32_t word,
                  double phase) {
  const int bits = static_cast<int>(shades.size());
  std::array<std::vector<double>, 2> by_value;
  for (int k = 0; k < bits; ++k) by_value[word >> k & 1U].push_back(shades[k]);
  for (auto& values : by_value) {
    if (values.empty()) continue;
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    const double median = values[values.size() / 2];
    for (const double value : values) {
      if (std::abs(value - median) > kSameShade) return false;
    }
  }
  constexpr int kHalf = kPerSegment / 2;
  for (int k = 0; k < bits; ++k) {
    const double own = word >> k & 1U;
    const double next = word >> ((k + 1) % bits) & 1U;
    const double begin = phase + k * kPerSegment;
    const double inner = MeanOverHalf(circles, begin + 0.5 * kHalf);
    const double across = MeanOverHalf(circles, begin + 1.5 * kHalf);
    if (std::abs(inner - own) > kMisfit) return false;
    if (std::abs(across - 0.5 * (own + next)) > 0.6 * kMisfit) return false;
  }
  return true;
}

}  // namespace

std::optional<RingEvidence> FindRingEvidence(const PageView& picture, const DiscModel& disc,
                                             double noise) {
  constexpr double kMinContrast = 1.5;  // grey levels: rounding makes less
  constexpr double kSigmas = 3 * std::numbers::sqrt2;
  const double least = kSoftUnit * std::max(kMinContrast, kSigmas * kQuietNoise * noise);
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

RingReading ReadRing(const PageView& picture, const DiscModel& disc, int bits) {
  RingReading reading;
  const Mapping map(disc);
  if (!Inside(picture, map, kQuietSample)) {
    reading.state = RingState::kCutOff;
    return reading;
  }
  Circles circles;
  circles.count = bits * kPerSegment;
  // More than a third of the gap or most of the quiet zone in disorder: not a target.
  constexpr double kMaxGap = 0.35;
  constexpr double kMaxQuiet = 0.5;
  const CircleSampler sampler(picture, map, circles.count);
  const double gap = SamplePlain(sampler, disc, kGapRadius, kMaxGap, circles.count, circles.gap);
  if (gap > kMaxGap) return reading;
  const double quiet =
      SamplePlain(sampler, disc, kQuietSample, kMaxQuiet, circles.count, circles.quiet);
  if (quiet > kMaxQuiet) return reading;
  SampleRing(sampler, disc, circles);
  double low = circles.ring[0];
  double high = circles.ring[0];
  for (int i = 1; i < circles.count; ++i) {
    low = std::min(low, circles.ring[i]);
    high = std::max(high, circles.ring[i]);
  }
  if (gap == 0 && quiet == 0 && high < kBlank && low > -kBlank) {
    reading.state = RingState::kNone;
    return reading;
  }
  if (gap == 0 && quiet == 0 && low > kMinHigh && high - low < kMinSpan) {
    // A closed ring: ink all around, a word in no book.
    reading.state = RingState::kClear;
    reading.word = (1U << bits) - 1;
    return reading;
  }
  const double phase = Phase(circles);
  std::vector<double> shades(static_cast<std::size_t>(bits));
  for (int k = 0; k < bits; ++k) {
    // The middle half of the segment, without its edges.
    shades[k] = MeanOverHalf(circles, phase + k * kPerSegment + 0.25 * kPerSegment);
  }
  const Shades two = TwoShades(shades);
  int sure = 0;
  int inked = 0;
  if (two.high - two.low > kMinSpan) {
    for (int i = 0; i < circles.count + kAgain; ++i) {
      circles.ring[i] = (circles.ring[i] - two.low) / (two.high - two.low);
    }
    low = (low - two.low) / (two.high - two.low);
    for (int k = 0; k < bits; ++k) {
      shades[k] = (shades[k] - two.low) / (two.high - two.low);
      sure += std::abs(shades[k] - 0.5) > kSure ? 1 : 0;
      if (shades[k] > 0.5) {
        reading.word |= 1U << k;
        ++inked;
      }
    }
  }
  reading.start_rad = kTurn * phase / circles.count;
  const bool plain_about =
      gap == 0 && quiet <= kMaxScratched && two.low < kMaxLow && two.high > kMinHigh;
  if (plain_about && sure == bits && IsConsistent(circles, shades, reading.word, phase)) {
    reading.state = RingState::kClear;
  } else if (2 * sure > bits && inked >= kMinInked && bits - inked >= kMinInked &&
             low > -kMaxBelow) {
    reading.state = RingState::kUnclear;
  }
  return reading;
}

RingShade ShadeOf(const RingReading& reading, int bits) {
  RingShade shade;
  const double per_step = static_cast<double>(bits) / RingShade::kAngles;  // segments, below 1
  const auto inked = [&](double segment) {
    const int k = static_cast<int>(segment) % bits;
    return static_cast<double>(reading.word >> k & 1U);
  };
  for (int i = 0; i < RingShade::kAngles; ++i) {
    // The mean over the step's width, so that a segment's edge may be between steps too.
    const double begin = (i - 0.5) * per_step - reading.start_rad / kTurn * bits + bits;
    const double end = begin + per_step;
    const double before = std::min(1.0, (std::floor(end) - begin) / per_step);
    shade.cover[i] = static_cast<float>(
        before > 0 ? before * inked(begin) + (1 - before) * inked(end) : inked(begin));
  }
  return shade;
}

}  // namespace trammel::part_alignment
