#include "extruder_world.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace trammel::test {
namespace {

namespace pa = pressure_advance;

constexpr double kStep_s = 0.0005;
constexpr double kCell_mm = 0.05;
constexpr double kFootprint_mm = 0.4;
constexpr double kNominal_mm2 = 0.11;  // line cross-section

// Flow over stored filament, tabulated over the square root of flow: thinning laws are steep at 0.
class HotEnd {
 public:
  HotEnd(const StoredModel& law, double scale, double second_s, double fastest_mm_s)
      : second_s_(second_s), fastest_mm_s_(fastest_mm_s) {
    for (int i = 0; i <= kCells; ++i) stored_.push_back(scale * law(FlowAt(i)));
  }

  [[nodiscard]] double Flow(double stored) const {
    if (stored <= 0) return 0;
    const auto above = std::upper_bound(stored_.begin(), stored_.end(), stored);
    const auto i = std::clamp<std::ptrdiff_t>(above - stored_.begin(), 1, kCells);
    const double share = (stored - stored_[i - 1]) / (stored_[i] - stored_[i - 1]);
    return FlowAt(static_cast<double>(i - 1)) +
           share * (FlowAt(static_cast<double>(i)) - FlowAt(static_cast<double>(i - 1)));
  }
  void Settle(double flow_mm_s) {
    double lo = 0, hi = stored_.back();
    for (int i = 0; i < 60; ++i) {
      const double middle = (lo + hi) / 2;
      (Flow(middle) < flow_mm_s ? lo : hi) = middle;
    }
    first_ = lo;
    second_ = second_s_ * flow_mm_s;
  }
  // Steps are short against every lag but that of a thinning law near rest, hence the substeps.
  double Push(double filament, bool gaps_are_lost) {
    constexpr int kSub = 4;
    double out = 0;
    for (int i = 0; i < kSub; ++i) {
      first_ += filament / kSub;
      const double passed = std::clamp(Flow(first_) * kStep_s / kSub, 0.0, std::max(0.0, first_));
      first_ -= passed;
      if (gaps_are_lost) first_ = std::max(first_, 0.0);
      if (second_s_ <= 0) {
        out += passed;
        continue;
      }
      second_ += passed;
      const double left = second_ * -std::expm1(-kStep_s / kSub / second_s_);
      second_ -= left;
      out += left;
    }
    return out;
  }

 private:
  static constexpr int kCells = 2000;
  [[nodiscard]] double FlowAt(double cell) const {
    return 4 * fastest_mm_s_ * (cell / kCells) * (cell / kCells);
  }
  double second_s_;
  double fastest_mm_s_;
  std::vector<double> stored_;
  double first_ = 0;
  double second_ = 0;
};

double SpeedAt(const ExtruderWorld& world, double s) {
  const double slow2 = world.slow_mm_s * world.slow_mm_s;
  const double from = s - world.first_share * world.length_mm;
  const double to = (world.first_share + world.fast_share) * world.length_mm - s;
  if (from <= 0 || to <= 0) return world.slow_mm_s;
  return std::min(world.fast_mm_s,
                  std::sqrt(slow2 + 2 * world.acceleration_mm_s2 * std::min(from, to)));
}

struct Drive {
  std::vector<double> position_mm;
  std::vector<double> rate_mm_s;  // filament speed, with pressure advance and smoothing
};

Drive Command(const ExtruderWorld& world, double pressure_advance_s) {
  std::vector<double> speed;
  Drive drive;
  double s = -0.3 * world.slow_mm_s;
  while (s < world.length_mm + 1) {
    const double v = SpeedAt(world, s);
    drive.position_mm.push_back(s);
    speed.push_back(v);
    s += SpeedAt(world, s + v * kStep_s / 2) * kStep_s;
  }
  const auto n = static_cast<std::ptrdiff_t>(speed.size());
  const auto at = [&](std::ptrdiff_t i) { return speed[std::clamp<std::ptrdiff_t>(i, 0, n - 1)]; };
  const auto half = static_cast<std::ptrdiff_t>(world.smooth_time_s / 2 / kStep_s);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    double sum = 0, weights = 0;
    for (std::ptrdiff_t k = -half; k <= half; ++k) {
      const auto weight = static_cast<double>(half + 1 - std::abs(k));
      const double ramp = (at(i + k + 1) - at(i + k - 1)) / (2 * kStep_s);
      sum += weight * (at(i + k) + pressure_advance_s * ramp);
      weights += weight;
    }
    drive.rate_mm_s.push_back(sum / weights);
  }
  return drive;
}

// The law's factor: a line whose secant over the whole speed change is k_star_s.
double Scale(const ExtruderWorld& world, double k_star_s) {
  const double secant = (world.law(world.fast_mm_s) - world.law(world.slow_mm_s)) /
                        (world.fast_mm_s - world.slow_mm_s);
  return std::max(k_star_s, 1e-6) / secant;
}

std::vector<double> Lay(const ExtruderWorld& world, double k_star_s, double pressure_advance_s) {
  HotEnd hot_end(world.law, (1 - world.second_share) * Scale(world, k_star_s),
                 world.second_share * k_star_s, world.fast_mm_s);
  const double slow_ratio = world.slow_mm_s / world.fast_mm_s;
  hot_end.Settle(world.slow_mm_s * (1 - world.slip * slow_ratio * slow_ratio));
  const Drive drive = Command(world, pressure_advance_s);
  double flow_mm_s = world.slow_mm_s;
  std::vector<double> cells(static_cast<std::size_t>(world.length_mm / kCell_mm) + 1, 0.0);
  const auto last = static_cast<double>(cells.size()) - 1;
  for (std::size_t i = 0; i + 1 < drive.rate_mm_s.size(); ++i) {
    const double rate = drive.rate_mm_s[i];
    const double ratio = flow_mm_s / world.fast_mm_s;  // slip answers to the pressure
    const double kept = 1 - world.slip * ratio * ratio;
    const double out = hot_end.Push(rate * kept * kStep_s, world.gaps_are_lost);
    flow_mm_s = out / kStep_s;
    const double from = (drive.position_mm[i] - kFootprint_mm / 2) / kCell_mm;
    const double to = (drive.position_mm[i + 1] + kFootprint_mm / 2) / kCell_mm;
    for (double cell = std::max(0.0, std::floor(from)); cell <= std::min(last, to); ++cell) {
      const double share =
          std::max(0.0, std::min(to, cell + 1) - std::max(from, cell)) / (to - from);
      cells[static_cast<std::size_t>(cell)] += out * share / kCell_mm;
    }
  }
  return cells;
}

std::vector<double> ReadingPositions_mm(const ExtruderWorld& world) {
  std::vector<double> positions_mm;
  for (double s = world.left_out_mm; s <= world.length_mm - world.left_out_mm;
       s += world.reading_mm) {
    positions_mm.push_back(s);
  }
  return positions_mm;
}

double LineLag_s(const ExtruderWorld& world, std::size_t line, double scatter_s) {
  const auto count = static_cast<double>(world.pressure_advance_s.size());
  const double along = static_cast<double>(line) / (count - 1) - 0.5;
  return std::max(0.0, world.k_star_s * (1 + world.lag_drift * along) + scatter_s);
}

std::vector<double> LaidAreas(const ExtruderWorld& world, double k_star_s,
                              double pressure_advance_s) {
  const std::vector<double> cells = Lay(world, k_star_s, pressure_advance_s);
  std::vector<double> areas;
  for (const double s : ReadingPositions_mm(world)) {
    areas.push_back(cells[static_cast<std::size_t>(s / kCell_mm + 0.5)]);
  }
  return areas;
}

}  // namespace

StoredModel PowerLaw(double exponent) {
  return [exponent](double q) { return std::pow(q, exponent); };
}

StoredModel TanhLaw(double share, double knee_mm_s) {
  return [=](double q) { return (1 - share) * q + share * knee_mm_s * std::tanh(q / knee_mm_s); };
}

pa::LineMotion ExtruderWorld::Motion() const {
  return {{{first_share, slow_mm_s},
           {fast_share, fast_mm_s},
           {1 - first_share - fast_share, slow_mm_s}},
          length_mm,
          acceleration_mm_s2};
}

double TruePressureAdvance(const ExtruderWorld& world) {
  // Advance also passes through the slipping drive: a third of the slip on average.
  const double delivered = world.fast_mm_s * (1 - world.slip);
  const double first = (1 - world.second_share) * Scale(world, world.k_star_s) *
                       (world.law(delivered) - world.law(world.slow_mm_s));
  const double second = world.second_share * world.k_star_s * (delivered - world.slow_mm_s);
  return (first + second) / (world.fast_mm_s - world.slow_mm_s) / (1 - world.slip / 3);
}

ExtruderWorld WorldOf(pa::PatternPreset preset) {
  constexpr double kFrames_per_s = 30;
  pa::PatternConfig pattern;
  settings::ScanSettings scan;
  ApplyPreset(preset, pattern, scan);
  ExtruderWorld world;
  world.length_mm = pattern.line_length_mm;
  world.first_share = pattern.segments[0].fraction;
  world.fast_share = pattern.segments[1].fraction;
  world.slow_mm_s = pattern.segments[0].speed_mm_s;
  world.fast_mm_s = pattern.segments[1].speed_mm_s;
  world.acceleration_mm_s2 = pattern.acceleration_mm_s2;
  world.left_out_mm = scan.skip_mm;
  world.reading_mm = scan.scan_speed_mm_s / kFrames_per_s;
  return world;
}

std::vector<pa::LineProfile> PrintPattern(const ExtruderWorld& world, Random& random) {
  std::vector<pa::LineProfile> profiles;
  const std::vector<double> positions_mm = ReadingPositions_mm(world);
  for (std::size_t line = 0; line < world.pressure_advance_s.size(); ++line) {
    const double k_star_s = LineLag_s(world, line, world.lag_scatter_s * random.Normal());
    const std::vector<double> areas = LaidAreas(world, k_star_s, world.pressure_advance_s[line]);
    const double flow = 1 + world.flow_scatter * random.Normal();
    const double keep = std::exp(-world.reading_mm / world.flow_noise_length_mm);
    double wander = random.Normal();
    pa::LineProfile profile;
    profile.pressure_advance_s = world.pressure_advance_s[line];
    for (std::size_t i = 0; i < areas.size(); ++i) {
      wander = keep * wander + std::sqrt(1 - keep * keep) * random.Normal();
      const double area = areas[i] * flow * (1 + world.flow_noise * wander);
      const double sigma = kNominal_mm2 * world.reading_noise;
      pa::ProfileSample sample;
      sample.position = positions_mm[i];
      sample.area = {kNominal_mm2 * area + sigma * random.Normal(), sigma};
      profile.samples.push_back(sample);
    }
    profiles.push_back(std::move(profile));
  }
  return profiles;
}

std::vector<pa::LineProfile> SeenInAPhoto(std::vector<pa::LineProfile> profiles, double length_mm) {
  constexpr double kWidthPerArea_px = 200;
  constexpr double kRoundEdges_px = 3;
  for (pa::LineProfile& profile : profiles) {
    profile.position_unit = pa::PositionUnit::kLineLength;
    profile.cross_section_unit = pa::CrossSectionUnit::kPixel;
    for (pa::ProfileSample& sample : profile.samples) {
      sample.position /= length_mm;
      sample.width = {sample.area.value * kWidthPerArea_px + kRoundEdges_px,
                      sample.area.sigma * kWidthPerArea_px};
      sample.area = {};
    }
  }
  return profiles;
}

}  // namespace trammel::test
