#include "support/drawn_tap.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"

namespace trammel::test_support {
namespace {

constexpr double kStart_s = 100;  // of the recording: printer clocks do not start at zero

struct Schedule {
  double halt_s, pull_back_s, cruise_s, cruise_end_s, end_s;
  double halt_z_mm, ramp_mm;
};

Schedule Plan(const TapDrawing& drawing, double contact_z_mm) {
  Schedule plan{};
  const double ramp_s = drawing.pull_back_mm_s / drawing.acceleration_mm_s2;
  plan.ramp_mm = drawing.pull_back_mm_s * ramp_s / 2;
  plan.halt_z_mm = contact_z_mm - drawing.depth_mm;
  plan.halt_s = kStart_s + drawing.before_s;
  plan.pull_back_s = plan.halt_s + drawing.dwell_s;
  plan.cruise_s = plan.pull_back_s + ramp_s;
  plan.cruise_end_s =
      plan.cruise_s + (drawing.pull_back_mm - 2 * plan.ramp_mm) / drawing.pull_back_mm_s;
  plan.end_s = plan.cruise_end_s + ramp_s;
  return plan;
}

double HeightAboveHalt(const TapDrawing& drawing, const Schedule& plan, double time_s) {
  if (time_s < plan.halt_s) {
    return drawing.approach_mm_s * (plan.halt_s - time_s);
  }
  if (time_s < plan.cruise_s) {
    const double dt = std::max(0.0, time_s - plan.pull_back_s);
    return drawing.acceleration_mm_s2 * dt * dt / 2;
  }
  if (time_s < plan.cruise_end_s) {
    return plan.ramp_mm + drawing.pull_back_mm_s * (time_s - plan.cruise_s);
  }
  const double dt = std::max(0.0, plan.end_s - time_s);
  return drawing.pull_back_mm - drawing.acceleration_mm_s2 * dt * dt / 2;
}

double PressForce(const TapDrawing& drawing, double depth_mm) {
  return depth_mm <= 0 ? 0
                       : drawing.stiffness_g_mm * depth_mm *
                             (1 + drawing.curvature * depth_mm / drawing.depth_mm);
}

// Force of bed and plastic, positive for a press.
double ContactForce(const TapDrawing& drawing, const Schedule& plan, double time_s) {
  // Lost motion when the pull-back starts, made up for within its first third of the press.
  const double since_s = time_s - plan.pull_back_s;
  const double lag_s = since_s > 0 ? drawing.onset_lag_s * std::exp(-since_s / 0.02) : 0;
  const double height_mm = HeightAboveHalt(drawing, plan, time_s - lag_s);
  const double depth_mm = drawing.depth_mm - height_mm;
  double force_g = PressForce(drawing, depth_mm);
  const bool down = time_s < plan.halt_s;
  if (time_s >= plan.halt_s) {
    force_g *= 1 - drawing.relaxed * (1 - std::exp(-(time_s - plan.halt_s) / 0.1));
  }
  if (drawing.plastic_mm > 0 && down && depth_mm > -drawing.plastic_mm) {
    const double squeezed = std::min(1.0, 1 + depth_mm / drawing.plastic_mm);
    force_g += drawing.plastic_g * squeezed * squeezed;
  } else if (drawing.plastic_mm > 0 && !down) {
    force_g += drawing.plastic_g * std::exp(-(time_s - plan.halt_s) / 0.05);
  }
  if (!down && depth_mm < 0 && depth_mm > -drawing.pull_mm) {
    force_g -= drawing.pull_g * (1 + depth_mm / drawing.pull_mm);
  }
  return force_g;
}

double FreeForce(const TapDrawing& drawing, const Schedule& plan, double time_s) {
  double force_g = drawing.drift_g_s * (time_s - kStart_s);
  force_g += drawing.hum_g * std::sin(2 * std::numbers::pi * drawing.hum_hz * time_s);
  if (time_s >= plan.pull_back_s) {
    force_g += drawing.step_g;
    // Settling time of a drive and its frame: some ten milliseconds.
    const double since_s = time_s - plan.pull_back_s;
    force_g += drawing.onset_ring_g * std::exp(-since_s / 0.008) * std::sin(since_s / 0.003);
  }
  return force_g;
}

std::vector<DrawnMove> Moves(const TapDrawing& drawing, const Schedule& plan) {
  // The approach was queued to run on below the bed, as homing does.
  const double ramp_s = drawing.approach_mm_s / drawing.acceleration_mm_s2;
  const double cruise_s = plan.halt_s - drawing.before_s - 0.1;
  const double cruise_z = plan.halt_z_mm + drawing.approach_mm_s * (plan.halt_s - cruise_s);
  const double top_z = cruise_z + drawing.approach_mm_s * ramp_s / 2;
  const double v = drawing.pull_back_mm_s;
  const double a = drawing.acceleration_mm_s2;
  const double up_s = plan.cruise_s - plan.pull_back_s;
  return {
      {cruise_s - ramp_s, ramp_s, 0, a, top_z, -1},
      {cruise_s, 30, drawing.approach_mm_s, 0, cruise_z, -1},
      {plan.halt_s + 0.05, 0, 0, 0, plan.halt_z_mm, 0},
      {plan.pull_back_s, up_s, 0, a, plan.halt_z_mm, 1},
      {plan.cruise_s, plan.cruise_end_s - plan.cruise_s, v, 0, plan.halt_z_mm + plan.ramp_mm, 1},
      {plan.cruise_end_s, up_s, v, -a, plan.halt_z_mm + drawing.pull_back_mm - plan.ramp_mm, 1}};
}

}  // namespace

DrawnTap DrawTap(const TapDrawing& drawing, std::uint64_t seed) {
  Random random(seed);
  DrawnTap tap;
  tap.contact_z_mm = random.Uniform(-0.1, 0.1);
  const Schedule plan = Plan(drawing, tap.contact_z_mm);
  tap.contact_time_s = plan.cruise_s + (drawing.depth_mm - plan.ramp_mm) / drawing.pull_back_mm_s;
  tap.moves = Moves(drawing, plan);
  const double phase_s = random.Uniform() / drawing.rate_hz;
  for (int i = 0;; ++i) {
    const double time_s = kStart_s + phase_s + i / drawing.rate_hz;
    if (time_s > plan.end_s + drawing.after_s) {
      break;
    }
    double force_g = FreeForce(drawing, plan, time_s) + random.Normal(0, drawing.noise_g);
    if (time_s < plan.halt_s) {
      force_g += random.Normal(0, drawing.approach_noise_g);
    }
    if (drawing.impulse_g > 0) {
      force_g += std::abs(time_s - plan.halt_s) < 0.01 ? drawing.impulse_g : 0;
    } else if (!drawing.no_contact) {
      force_g += ContactForce(drawing, plan, time_s);
    }
    force_g = drawing.tare_g + drawing.sign * force_g;
    tap.time_s.push_back(time_s);
    tap.force_g.push_back(std::clamp(force_g, -drawing.full_scale_g, drawing.full_scale_g));
  }
  return tap;
}

}  // namespace trammel::test_support
