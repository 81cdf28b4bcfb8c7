#include "tap/tuning/tuning_candidates.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"

namespace trammel::tap {
namespace {

/// A shallower press gets the notice short_press; with what its depth is measured to.
constexpr double kLeastDepth_mm = 0.0215;
/// Force reached that no advice goes beyond: Klipper bounds the trigger's force by 250 gf.
constexpr double kMostForce_g = 300;
constexpr double kMostDeeper = 3;  // times the recorded depth: beyond, the press is not known
constexpr double kSlowest_mm_s = 0.03;
constexpr double kLongest_s = 3;
constexpr double kMostDistance_mm = 2;
constexpr double kPressSamples = 24;  // in the press, so that they decide it and not the model
constexpr double kLongestRamp = 0.1;  // of the press: samples in it are dropped

/// Rounds to two digits, so that people can type it.
double Rounded(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return unit * std::floor(value / unit + 1e-6);
}

double DepthSpread(const TrialWorld& world) {
  std::vector<double> depths;
  for (const TapTemplate& tap : world.templates) depths.push_back(tap.press_depth_mm);
  return world.halt_scatter_mm + 2 * StandardDeviation(depths);
}

double Time(const TrialSettings& settings) {
  return settings.pull_back_mm / settings.pull_back_speed_mm_s;
}

/// A change by less than a tenth is not worth the trouble.
bool IsClose(double value, double present) { return std::abs(value - present) < 0.1 * present; }

std::vector<double> Forces(const TrialWorld& world, const TrialSettings& present, bool shallow) {
  const double depth = MedianDepth(world, present.press_force_g);
  const double wanted = kLeastDepth_mm + DepthSpread(world);
  std::vector<double> forces;
  if (!shallow) forces.push_back(present.press_force_g);
  const auto add = [&](double force) {
    force = std::ceil(force);
    const double deeper = MedianDepth(world, force);
    const bool useful = deeper < kMostDeeper * depth && !(shallow && deeper < kLeastDepth_mm);
    if (useful && force <= std::max(kMostForce_g, present.press_force_g)) forces.push_back(force);
  };
  if (depth < wanted) {
    // By bisection on the measured press.
    double lo = present.press_force_g;
    double hi = 4 * kMostForce_g;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (lo + hi);
      (MedianDepth(world, middle) < wanted ? lo : hi) = middle;
    }
    add(hi);
    add(1.3 * hi);
  }
  add(1.4 * present.press_force_g);
  add(2 * present.press_force_g);
  return forces;
}

std::vector<double> Distances(const TrialWorld& world, const TrialSettings& present,
                              double force_g) {
  constexpr double kStep_mm = 0.01;
  constexpr double kLeast = 1.8;  // presses: below, the break comes too late
  const double deepest = MedianDepth(world, force_g) + DepthSpread(world);
  std::vector<double> distances;
  const bool far_enough = present.pull_back_mm >= kLeast * deepest;
  if (far_enough) distances.push_back(present.pull_back_mm);
  for (const double presses : {3.0, 4.0}) {
    const double distance = kStep_mm * std::ceil(presses * deepest / kStep_mm);
    if (distance > kMostDistance_mm || (far_enough && IsClose(distance, present.pull_back_mm))) {
      continue;
    }
    distances.push_back(distance);
  }
  return distances;
}

/// @param target  Of the noise factor, relative to the present one.
std::vector<double> Speeds(const TrialWorld& world, const TrialSettings& present,
                           TrialSettings settings, double target) {
  const double depth = MedianDepth(world, settings.press_force_g);
  const TapSetting& setting = world.templates.front().setting;
  double fastest = depth * setting.sample_rate_hz / kPressSamples;
  if (setting.acceleration_mm_s2 > 0) {
    fastest = std::min(fastest, std::sqrt(2 * setting.acceleration_mm_s2 * kLongestRamp * depth));
  }
  settings.pull_back_speed_mm_s = present.pull_back_speed_mm_s;
  const double factor = NoiseFactor(world, settings) / NoiseFactor(world, present);
  const double by_noise =
      present.pull_back_speed_mm_s * std::pow(std::max(target, 1e-3) / factor, 2);
  std::vector<double> speeds{present.pull_back_speed_mm_s};
  for (const double part : {1.6, 1.0, 0.6, 0.35}) {
    const double wanted = part * std::min(by_noise, fastest / std::max(part, 1.0));
    const double speed =
        Rounded(std::clamp(wanted, kSlowest_mm_s, std::max(kSlowest_mm_s, fastest)));
    if (!IsClose(speed, present.pull_back_speed_mm_s)) speeds.push_back(speed);
  }
  return speeds;
}

}  // namespace

TrialSettings PresentSettings(const TrialWorld& world) {
  std::vector<double> forces;
  for (const TapTemplate& tap : world.templates) forces.push_back(tap.press_force_g);
  const TapSetting& setting = world.templates.front().setting;
  return {Median(forces), setting.pull_back_speed_mm_s, setting.pull_back_mm};
}

double MedianDepth(const TrialWorld& world, double force_g) {
  const double more_g = force_g - PresentSettings(world).press_force_g;
  std::vector<double> depths;
  for (const TapTemplate& tap : world.templates) {
    depths.push_back(tap.DepthWith(more_g));
  }
  return Median(depths);
}

double NoiseFactor(const TrialWorld& world, const TrialSettings& settings) {
  const double depth = MedianDepth(world, settings.press_force_g);
  const double after = std::max(settings.pull_back_mm - depth, 0.05 * depth);
  return depth / settings.press_force_g *
         std::sqrt(settings.pull_back_speed_mm_s * (9 / depth + 4 / after));
}

double Cost(const TrialSettings& settings, const TrialSettings& present) {
  constexpr double kChange = 1.1;
  double cost = Time(settings) * std::max(1.0, settings.press_force_g / present.press_force_g);
  if (settings.press_force_g != present.press_force_g) cost *= kChange;
  if (settings.pull_back_mm != present.pull_back_mm) cost *= kChange;
  if (settings.pull_back_speed_mm_s != present.pull_back_speed_mm_s) cost *= kChange;
  return cost;
}

std::vector<Candidate> Candidates(const TrialWorld& world, const TrialSettings& present,
                                  double target, bool shallow) {
  std::vector<Candidate> candidates;
  for (const double force : Forces(world, present, shallow)) {
    for (const double distance : Distances(world, present, force)) {
      for (const double speed : Speeds(world, present, {force, 0, distance}, target)) {
        const TrialSettings settings{force, speed, distance};
        if (Time(settings) > std::max(kLongest_s, Time(present))) continue;
        candidates.push_back({settings, Cost(settings, present)});
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  const auto same = [](const Candidate& a, const Candidate& b) { return a.cost == b.cost; };
  candidates.erase(std::unique(candidates.begin(), candidates.end(), same), candidates.end());
  return candidates;
}

}  // namespace trammel::tap
