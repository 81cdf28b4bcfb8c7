#include "tap/files/moves_from_z.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "base/statistics.h"

namespace trammel::files {
namespace {

using tap::Move;

/// Maximum distance from the lowest height of a sample at rest. Firmware computes z to far less
/// than 1 um; files round it to that.
constexpr double kRest_mm = 0.0015;
constexpr double kMaxResidual_mm = 0.003;
constexpr std::size_t kMinDescent = 4;
constexpr std::size_t kMinRise = 8;

struct Samples {
  std::span<const double> time_s;
  std::span<const double> z_mm;

  [[nodiscard]] Samples Part(std::size_t first, std::size_t last) const {
    return {time_s.subspan(first, last - first), z_mm.subspan(first, last - first)};
  }
};

/// z = z_mm + speed_mm_s (t - time_s)
struct Cruise {
  double time_s = 0;
  double z_mm = 0;
  double speed_mm_s = 0;

  [[nodiscard]] double TimeAt(double z) const { return time_s + (z - z_mm) / speed_mm_s; }
};

/// Fits by least squares; nothing if the samples are not on a line.
std::optional<Cruise> Fit(const Samples& samples) {
  Cruise line{Mean(samples.time_s), Mean(samples.z_mm), 0};
  double tt = 0;
  double tz = 0;
  for (std::size_t i = 0; i < samples.time_s.size(); ++i) {
    const double t = samples.time_s[i] - line.time_s;
    tt += t * t;
    tz += t * (samples.z_mm[i] - line.z_mm);
  }
  if (!(tt > 0)) return std::nullopt;
  line.speed_mm_s = tz / tt;
  for (std::size_t i = 0; i < samples.time_s.size(); ++i) {
    const double fitted = line.z_mm + line.speed_mm_s * (samples.time_s[i] - line.time_s);
    if (!(std::abs(samples.z_mm[i] - fitted) <= kMaxResidual_mm)) return std::nullopt;
  }
  return line;
}

bool Usable(const Samples& samples) {
  for (std::size_t i = 0; i < samples.time_s.size(); ++i) {
    if (!std::isfinite(samples.time_s[i]) || !std::isfinite(samples.z_mm[i])) return false;
    if (i > 0 && samples.time_s[i] <= samples.time_s[i - 1]) return false;
  }
  return true;
}

/// Indices of the approach, the rest and the rise.
struct Stretches {
  std::size_t approach_end = 0;  ///< one behind its last sample
  std::size_t rise_first = 0;
  std::size_t rise_end = 0;
  double low_mm = 0;
  double high_mm = 0;  ///< end of the pull-back
};

std::optional<Stretches> Divide(const Samples& samples) {
  const auto& z = samples.z_mm;
  Stretches found;
  found.low_mm = *std::min_element(z.begin(), z.end());
  const auto rests = [&](double value) { return value <= found.low_mm + kRest_mm; };
  const auto first_rest = std::find_if(z.begin(), z.end(), rests);
  const auto last_rest = std::find_if(z.rbegin(), z.rend(), rests).base();
  found.approach_end = static_cast<std::size_t>(first_rest - z.begin());
  found.rise_first = static_cast<std::size_t>(last_rest - z.begin());
  // The first and the last sample of a cruise may belong to an acceleration.
  if (found.approach_end < kMinDescent + 1) return std::nullopt;
  --found.approach_end;
  ++found.rise_first;
  if (found.rise_first >= z.size()) return std::nullopt;
  found.high_mm =
      *std::max_element(z.begin() + static_cast<std::ptrdiff_t>(found.rise_first), z.end());
  found.rise_end = found.rise_first;
  while (found.rise_end < z.size() && z[found.rise_end] < found.high_mm - kRest_mm) {
    ++found.rise_end;
  }
  if (found.rise_end < found.rise_first + kMinRise + 1) return std::nullopt;
  --found.rise_end;
  return found;
}

}  // namespace

std::vector<Move> MovesFromZ(std::span<const double> time_s, std::span<const double> z_mm) {
  if (time_s.size() != z_mm.size() || time_s.size() < kMinDescent + kMinRise) return {};
  const Samples samples{time_s, z_mm};
  if (!Usable(samples)) return {};
  const auto stretches = Divide(samples);
  if (!stretches) return {};
  const auto approach = Fit(samples.Part(0, stretches->approach_end));
  const auto rise = Fit(samples.Part(stretches->rise_first, stretches->rise_end));
  if (!approach || !rise || approach->speed_mm_s >= 0 || rise->speed_mm_s <= 0) return {};

  const double low = stretches->low_mm;
  const double interval = (time_s.back() - time_s.front()) / static_cast<double>(time_s.size() - 1);
  const double start = time_s.front();
  const double halt = approach->TimeAt(low);
  // From rest, constant acceleration takes twice the cruise's time for the same distance.
  const double ramp = interval;
  const double pull = rise->TimeAt(low) - ramp / 2;
  const double leave = rise->TimeAt(stretches->high_mm) - ramp / 2;
  if (!(start < halt && halt < pull && pull + ramp < leave)) return {};
  const double speed = rise->speed_mm_s;
  const double ramp_way = speed * ramp / 2;
  const double fall = -approach->speed_mm_s;
  return {
      {start, halt - start, fall, 0, low + fall * (halt - start), -1},
      {halt, 0, 0, 0, low, 0},
      {pull, ramp, 0, speed / ramp, low, 1},
      {pull + ramp, leave - pull - ramp, speed, 0, low + ramp_way, 1},
      {leave, ramp, speed, -speed / ramp, low + ramp_way + speed * (leave - pull - ramp), 1},
  };
}

}  // namespace trammel::files
