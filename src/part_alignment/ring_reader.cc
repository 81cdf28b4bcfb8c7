#include "part_alignment/ring_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "part_alignment/disc_search.h"
#include "part_alignment/target_layout.h"

namespace trammel::part_alignment {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kPerSegment = 8;  ///< samples
constexpr int kMostSamples = 20 * kPerSegment;

// In units of the contrast: 0 the surroundings, 1 the disc's shade.
constexpr double kPlain = 0.35;          ///< gap and quiet zone stay below
constexpr double kMostScratched = 0.12;  ///< share of the quiet zone, beyond a whole ring
constexpr double kLeastSpan = 0.35;      ///< between segments without and with ink
constexpr double kMostLow = 0.3;         ///< of those without
constexpr double kLeastHigh = 0.5;       ///< of those with

// Of the ring, in units of the span between its two shades.
constexpr double kSure = 0.12;      ///< a segment's least distance from the middle
constexpr double kSameShade = 0.3;  ///< segments of one value differ by less
constexpr double kMisfit = 0.45;    ///< of a segment's half from what its bits say
constexpr double kMostBelow = 0.6;  ///< of a ring's sample below the surroundings
constexpr int kLeastInked = 3;      ///< segments of a ring, and as many without ink
constexpr double kBlank = 0.3;      ///< without a ring no sample of it reaches this

/// Samples along circles of the target, each in units of the contrast.
struct Circles {
  int count = 0;
  std::array<double, kMostSamples> gap{};
  std::array<double, kMostSamples> ring{};
  std::array<double, kMostSamples> quiet{};
};

/// From the plane of W (p - c) to the picture.
struct Mapping {
  double cx, cy, xx, xy, yy;
  explicit Mapping(const DiscModel& d) : cx(d.column_px), cy(d.row_px) {
    const double det = d.wxx * d.wyy - d.wxy * d.wxy;
    xx = d.wyy / det;
    xy = -d.wxy / det;
    yy = d.wxx / det;
  }
  [[nodiscard]] double X(double u, double v) const { return cx + xx * u + xy * v; }
  [[nodiscard]] double Y(double u, double v) const { return cy + xy * u + yy * v; }
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

Circles Sample(const PageView& picture, const DiscModel& disc, const Mapping& map, int bits) {
  Circles circles;
  circles.count = bits * kPerSegment;
  for (int i = 0; i < circles.count; ++i) {
    const double angle = kTurn * i / circles.count;
    const double u = std::cos(angle);
    const double v = std::sin(angle);
    const auto at = [&](double radius) {
      return Between(picture, map.X(radius * u, radius * v), map.Y(radius * u, radius * v));
    };
    const double gap = at(kGapRadius);
    const double quiet = at(kQuietSample);
    const double ink = disc.background + disc.contrast;
    // Light that changes across the target changes gap and quiet zone alike; a scratch does not.
    const bool scratched = std::abs(quiet - gap) > kPlain * std::abs(disc.contrast);
    const double nearby = scratched ? gap : 0.5 * (gap + quiet);
    double ring = 0;
    for (const double radius : kRingRadii) ring += at(radius);
    ring /= kRingRadii.size();
    circles.gap[i] = (gap - disc.background) / disc.contrast;
    circles.quiet[i] = (quiet - disc.background) / disc.contrast;
    const double local = ink - nearby;
    circles.ring[i] = local * disc.contrast > 0.3 * disc.contrast * disc.contrast
                          ? (ring - nearby) / local
                          : -1;  // no contrast left here: not a plain surrounding
  }
  return circles;
}

/// Share of the samples that are not plain.
double Disturbed(const std::array<double, kMostSamples>& values, int count) {
  int disturbed = 0;
  for (int i = 0; i < count; ++i) disturbed += std::abs(values[i]) > kPlain ? 1 : 0;
  return static_cast<double>(disturbed) / count;
}

/// The mean shades of the lighter and of the darker segments.
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

/// Where segments begin, in samples from the first, in [0, kPerSegment).
double Phase(const Circles& circles) {
  std::complex<double> sum = 0;
  const int n = circles.count;
  for (int i = 0; i < n; ++i) {
    const double change = std::abs(circles.ring[(i + 1) % n] - circles.ring[(i + n - 1) % n]);
    // Squared, so that true edges outweigh noise.
    sum += change * change * std::polar(1.0, kTurn * i / kPerSegment);
  }
  const double phase = std::arg(sum) / kTurn * kPerSegment;
  return phase < 0 ? phase + kPerSegment : phase;
}

/// Mean of the ring over `length` samples' widths from place `from`; sample i stands at place i.
double MeanOver(const Circles& circles, double from, int length) {
  const int n = circles.count;
  from += 0.5;  // half a sample's width
  const double below = std::floor(from);
  const double share = from - below;
  const int first = ((static_cast<int>(below) % n) + n) % n;
  double sum = 0;
  for (int i = 0; i < length; ++i) {
    const double a = circles.ring[(first + i) % n];
    const double b = circles.ring[(first + i + 1) % n];
    sum += a * (1 - share) + b * share;
  }
  return sum / length;
}

/// Whether the two shades are each of a kind, and every half segment what its neighbours say.
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
    const double inner = MeanOver(circles, begin + 0.5 * kHalf, kHalf);
    const double across = MeanOver(circles, begin + 1.5 * kHalf, kHalf);
    if (std::abs(inner - own) > kMisfit) return false;
    if (std::abs(across - 0.5 * (own + next)) > 0.6 * kMisfit) return false;
  }
  return true;
}

}  // namespace

RingReading ReadRing(const PageView& picture, const DiscModel& disc, int bits) {
  RingReading reading;
  const Mapping map(disc);
  if (!Inside(picture, map, kQuietSample)) {
    reading.state = RingState::kCutOff;
    return reading;
  }
  Circles circles = Sample(picture, disc, map, bits);
  const double gap = Disturbed(circles.gap, circles.count);
  const double quiet = Disturbed(circles.quiet, circles.count);
  // More than a third of the gap or most of the quiet zone in disorder: not a target at all.
  if (gap > 0.35 || quiet > 0.5) return reading;
  const auto [low, high] =
      std::minmax_element(circles.ring.begin(), circles.ring.begin() + circles.count);
  if (gap == 0 && quiet == 0 && *high<kBlank&& * low> - kBlank) {
    reading.state = RingState::kNone;
    return reading;
  }
  const double phase = Phase(circles);
  std::vector<double> shades(static_cast<std::size_t>(bits));
  for (int k = 0; k < bits; ++k) {
    // The middle half of the segment, so that its edges do not count.
    shades[k] = MeanOver(circles, phase + k * kPerSegment + 0.25 * kPerSegment, kPerSegment / 2);
  }
  const Shades two = TwoShades(shades);
  int sure = 0;
  int inked = 0;
  if (two.high - two.low > kLeastSpan) {
    for (double& value : circles.ring) value = (value - two.low) / (two.high - two.low);
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
      gap == 0 && quiet <= kMostScratched && two.low < kMostLow && two.high > kLeastHigh;
  if (plain_about && sure == bits && IsConsistent(circles, shades, reading.word, phase)) {
    reading.state = RingState::kClear;
  } else if (2 * sure > bits && inked >= kLeastInked && bits - inked >= kLeastInked &&
             *low > -kMostBelow) {
    reading.state = RingState::kUnclear;
  }
  return reading;
}

RingShade ShadeOf(const RingReading& reading, int bits) {
  constexpr int kParts = 8;
  RingShade shade;
  for (int i = 0; i < RingShade::kAngles; ++i) {
    // The mean over the step's width, so that a segment's edge lies between steps too.
    for (int part = 0; part < kParts; ++part) {
      const double turns =
          (i + (part + 0.5) / kParts - 0.5) / RingShade::kAngles - reading.start_rad / kTurn;
      const int k = static_cast<int>((turns - std::floor(turns)) * bits) % bits;
      shade.cover[i] += static_cast<float>(reading.word >> k & 1U) / kParts;
    }
  }
  return shade;
}

}  // namespace trammel::part_alignment
