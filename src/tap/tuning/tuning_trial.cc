#include "tap/tuning/tuning_trial.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/statistics.h"
#include "tap/samples/check_input.h"

namespace trammel::tap {
namespace {

/// Over which ooze lets go after the break.
constexpr double kPull_mm = 0.02;
/// The force lost at rest has gone by so many time constants at its end.
constexpr double kRestConstants = 4;

/// One tap's times and heights; the halt is at 0 s.
struct Schedule {
  double press_mm = 0;
  double contact_z_mm = 0;
  double before_s = 0;
  double approach_mm_s = 0;  // 0 without an approach
  double pull_back_s = 0;
  double ramp_s = 0;
  double ramp_mm = 0;
  double cruise_end_s = 0;
  double end_s = 0;
  double last_s = 0;
};

Schedule Plan(const TapTemplate& tap, const TrialSettings& settings, double press_mm) {
  Schedule plan;
  const TapSetting& setting = tap.setting;
  const double speed = settings.pull_back_speed_mm_s;
  plan.press_mm = press_mm;
  plan.before_s = tap.before_s;
  plan.approach_mm_s = std::isfinite(setting.approach_speed_mm_s) ? setting.approach_speed_mm_s : 0;
  plan.pull_back_s = tap.dwell_s;
  plan.ramp_s = setting.acceleration_mm_s2 > 0 ? speed / setting.acceleration_mm_s2 : 0;
  plan.ramp_mm = std::min(0.5 * speed * plan.ramp_s, 0.4 * settings.pull_back_mm);
  plan.cruise_end_s =
      plan.pull_back_s + plan.ramp_s + (settings.pull_back_mm - 2 * plan.ramp_mm) / speed;
  plan.end_s = plan.cruise_end_s + plan.ramp_s;
  plan.last_s = plan.end_s + tap.after_s;
  return plan;
}

std::vector<Move> MovesOf(const Schedule& plan, const TrialSettings& settings) {
  constexpr double kEarlier_s = 0.05;  // the approach begins before the samples
  const double halt_z = plan.contact_z_mm - plan.press_mm;
  const double speed = settings.pull_back_speed_mm_s;
  std::vector<Move> moves;
  if (plan.approach_mm_s > 0) {
    const double way_s = plan.before_s + kEarlier_s;
    moves.push_back(
        {-way_s, way_s, plan.approach_mm_s, 0, halt_z + plan.approach_mm_s * way_s, -1});
    moves.push_back({0, 0, 0, 0, halt_z, 0});
  }
  const double acceleration = plan.ramp_s > 0 ? speed / plan.ramp_s : 0;
  if (plan.ramp_s > 0) {
    moves.push_back({plan.pull_back_s, plan.ramp_s, 0, acceleration, halt_z, 1});
  }
  const double cruise_s = plan.pull_back_s + plan.ramp_s;
  moves.push_back({cruise_s, plan.cruise_end_s - cruise_s, speed, 0, halt_z + plan.ramp_mm, 1});
  if (plan.ramp_s > 0) {
    const double z = halt_z + plan.ramp_mm + speed * (plan.cruise_end_s - cruise_s);
    moves.push_back({plan.cruise_end_s, plan.ramp_s, speed, -acceleration, z, 1});
  }
  return moves;
}

/// Of the nozzle below the contact on the way up; negative above it.
double DepthUp(const Schedule& plan, const TrialSettings& settings, double time_s) {
  const double since = time_s - plan.pull_back_s;
  if (since <= 0) return plan.press_mm;
  if (since < plan.ramp_s) {
    const double part = since / plan.ramp_s;
    return plan.press_mm - plan.ramp_mm * part * part;
  }
  const double cruise = std::min(time_s, plan.cruise_end_s) - plan.pull_back_s - plan.ramp_s;
  return plan.press_mm - plan.ramp_mm - settings.pull_back_speed_mm_s * cruise;
}

/// Force of the bed at a time, positive for a press.
double PressAt(const TapTemplate& tap, const Schedule& plan, const TrialSettings& settings,
               double time_s) {
  const double peak = 1 / (1 - tap.lost_share);
  if (time_s < 0) {
    const double whole = plan.press_mm + tap.touch_extra_mm;
    const double depth = plan.press_mm + plan.approach_mm_s * time_s + tap.touch_extra_mm;
    return depth > 0 ? peak * tap.press.Force(plan.press_mm * depth / whole) : 0;
  }
  if (time_s < plan.pull_back_s) {
    const double rest = std::exp(-kRestConstants * time_s / plan.pull_back_s);
    return tap.press.Force(plan.press_mm) * (1 + (peak - 1) * rest);
  }
  const double depth = DepthUp(plan, settings, time_s);
  if (depth > 0) return tap.press.Force(depth);
  return -tap.pull_g * std::max(0.0, 1 + depth / kPull_mm);
}

/// The depth at which this tap's halt has the force that the settings ask for, relative to the
/// median of all: what a head overshoots is added to the trigger's force.
double PressDepth(const TrialWorld& world, const TapTemplate& tap, const TrialSettings& settings,
                  double scatter) {
  constexpr double kLeast = 0.05;
  std::vector<double> forces;
  for (const TapTemplate& other : world.templates) forces.push_back(other.press_force_g);
  const double depth = tap.DepthWith(settings.press_force_g - Median(forces));
  return std::max(kLeast * depth, depth + scatter);
}

}  // namespace

DrawnTap DrawTap(const TrialWorld& world, const TrialSettings& settings, Random& random) {
  const TapTemplate& tap = world.templates[random.Below(world.templates.size())];
  const double scatter = world.halt_scatter_mm * random.Uniform(-1, 1);
  Schedule plan = Plan(tap, settings, PressDepth(world, tap, settings, scatter));
  plan.contact_z_mm = random.Uniform(-0.05, 0.05);
  DrawnTap drawn;
  drawn.contact_z_mm = plan.contact_z_mm;
  drawn.moves = MovesOf(plan, settings);
  std::vector<double> phases;
  for (std::size_t i = 0; i < world.noise.sines.size(); ++i) {
    phases.push_back(random.Uniform(0, 2 * std::numbers::pi));
  }
  const std::vector<double>& intervals = tap.intervals_s;
  const double period_s = 1 / tap.setting.sample_rate_hz;
  std::size_t next = intervals.empty() ? 0 : random.Below(intervals.size());
  double time_s = -plan.before_s + period_s * random.Uniform();
  NoiseDraw noise(world.noise, random);
  while (time_s <= plan.last_s && drawn.time_s.size() < kMostSamples) {
    const double acted_s = time_s - world.latency_s;
    const double press_g = PressAt(tap, plan, settings, acted_s);
    const double deviation = acted_s < 0
                                 ? world.noise.approach_deviation_g
                                 : world.noise.deviation_g * (press_g > 0 ? tap.press_noise : 1);
    double force_g = press_g + tap.sign * (tap.drift_g_s * time_s + (acted_s > 0 ? tap.step_g : 0));
    force_g += deviation * noise.Next();
    for (std::size_t i = 0; i < phases.size(); ++i) {
      const NoiseModel::Sine& sine = world.noise.sines[i];
      force_g += sine.amplitude_g *
                 std::sin(2 * std::numbers::pi * sine.frequency_hz * time_s + phases[i]);
    }
    drawn.time_s.push_back(time_s);
    drawn.force_g.push_back(tap.tare_g + tap.sign * force_g);
    time_s += intervals.empty() ? period_s : intervals[next++ % intervals.size()];
  }
  return drawn;
}

double TrialOutcome::ShownShare() const {
  constexpr double kNormal95 = 1.644854;
  if (taps == 0) return 0;
  const auto n = static_cast<double>(taps);
  const double p = GoodShare();
  const double z2 = kNormal95 * kNormal95 / n;
  return (p + 0.5 * z2 - kNormal95 * std::sqrt(p * (1 - p) / n + 0.25 * z2 / n)) / (1 + z2);
}

FindingCode TrialOutcome::MainReason() const {
  FindingCode main = FindingCode::kNone;
  std::size_t most = 0;
  for (const auto& [code, count] : reasons) {
    if (count > most) main = code;
    most = std::max(most, count);
  }
  return main;
}

TrialOutcome RunTrial(const TrialWorld& world, const TrialSettings& settings,
                      const TapOptions& options, std::size_t taps, std::uint64_t seed) {
  constexpr double kOneDeviation = 0.682689;
  TrialOutcome outcome;
  TapAnalyser analyser(options);
  const Random random(seed);
  std::vector<double> uncertainties;
  std::vector<double> half_widths;
  std::vector<double> errors;
  for (std::size_t i = 0; i < taps; ++i) {
    Random own = random.Fork(i);
    const DrawnTap tap = DrawTap(world, settings, own);
    const TapAnalysis analysis = analyser.Analyse(tap.View());
    ++outcome.taps;
    if (analysis.verdict != Verdict::kGood) {
      ++outcome.reasons[analysis.reason.code];
      continue;
    }
    ++outcome.good;
    const auto notices = analysis.Notices();
    outcome.shallow += std::any_of(notices.begin(), notices.end(), [](const Finding& finding) {
      return finding.code == FindingCode::kShortPress;
    });
    uncertainties.push_back(analysis.standard_uncertainty_mm);
    half_widths.push_back(0.5 * (analysis.interval95_mm.hi - analysis.interval95_mm.lo));
    errors.push_back(std::abs(analysis.contact_z_mm - tap.contact_z_mm));
  }
  if (outcome.good > 0) {
    outcome.uncertainty_mm = Median(uncertainties);
    outcome.half_width_mm = Median(half_widths);
    outcome.error_mm = Quantile(errors, kOneDeviation);
  }
  return outcome;
}

double SamplesOfTap(const TrialWorld& world, const TrialSettings& settings) {
  const TapTemplate& tap = world.templates.front();
  const Schedule plan = Plan(tap, settings, tap.press_depth_mm);
  return (plan.before_s + plan.last_s) * tap.setting.sample_rate_hz;
}

}  // namespace trammel::tap
