// Taps whose press follows a law, for the tests of the contact method.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/random.h"
#include "tap/samples/tap.h"

namespace trammel::tap::test {

/// Share of the linear press's deepest force, at a share u of its depth.
using PressModel = std::function<double(double u)>;

struct PressWorld {
  PressModel law = [](double u) { return u; };
  double depth_mm = 0.045;
  double stiffness_g_mm = 3500;
  double noise_g = 2;
  double rate_hz = 320;
  double pull_back_mm_s = 0.32;
  double pull_back_mm = 0.1;
  double drift_g_s = 0;
  double hum_g = 0;
  double hum_hz = 50;
  double latency_s = 0;
  double resolution_g = 0;  ///< coarse converter's step; 0: none
  double sign = 1;
  double outlier_share = 0;  ///< share of samples off by 30 to 100 times the noise
  double memory = 0;         ///< noise correlation between samples (first-order regression)
  double held_share = 0;     ///< share of readings that repeat the previous value
  double late_s = 0;         ///< maximum delay of a time stamp
  double backlash_mm = 0;    ///< nozzle height above the drive until it rises
  double slip_g = 0;         ///< Force that goes once the nozzle has risen …
  double slip_mm = 0;        ///< … so far above the break.
  double ring_g = 0;         ///< amplitude of the structure from the pull-back's start on,
  double ring_hz = 8;        ///< and how often.
  int averages = 0;          ///< Over one sampling interval, one after the other, about its middle.
  double onset_lag_mm = 0;   ///< initial lag of the nozzle behind the drive, …
  double onset_fade_mm = 0.004;  ///< … and the way on which that falls to 1 / e.
};

struct PressTap {
  std::vector<double> time_s;
  std::vector<double> force_g;
  std::vector<Move> moves;
  double contact_z_mm = 0;
  [[nodiscard]] TapView View() const { return {time_s, force_g, moves}; }
};

inline constexpr int kPartsOfInterval = 16;

/// Weights at parts of the sampling interval.
inline std::vector<double> AveragingKernel(int averages) {
  std::vector<double> kernel = {1};
  for (int k = 0; k < averages; ++k) {
    std::vector<double> next(kernel.size() + kPartsOfInterval - 1, 0.0);
    for (std::size_t i = 0; i < kernel.size(); ++i) {
      for (std::size_t j = 0; j < kPartsOfInterval; ++j) {
        next[i + j] += kernel[i] / kPartsOfInterval;
      }
    }
    kernel = next;
  }
  return kernel;
}

/// Seeds below 1000 are for development; tests use those from 1000 on.
inline PressTap MakePressTap(const PressWorld& world, std::uint64_t seed) {
  Random random(seed);
  PressTap tap;
  tap.contact_z_mm = random.Uniform(-0.05, 0.05);
  const double halt_z = tap.contact_z_mm - world.depth_mm;
  const double start_s = 1000 + random.Uniform();
  const double approach_mm_s = 2;
  const double v = world.pull_back_mm_s;
  const double acceleration = 350;
  const double ramp_s = v / acceleration;
  const double halt_s = start_s + 0.6;
  const double back_s = halt_s + 0.25;
  const double cruise_s = (world.pull_back_mm - v * ramp_s) / v;
  const double ramp_mm = 0.5 * v * ramp_s;
  tap.moves = {{start_s, 0.6, approach_mm_s, 0, halt_z + 0.6 * approach_mm_s, -1},
               {halt_s, 0, 0, 0, halt_z, 0},
               {back_s, ramp_s, 0, acceleration, halt_z, 1},
               {back_s + ramp_s, cruise_s, v, 0, halt_z + ramp_mm, 1},
               {back_s + ramp_s + cruise_s, ramp_s, v, -acceleration,
                halt_z + world.pull_back_mm - ramp_mm, 1}};
  const double end_s = back_s + cruise_s + 2 * ramp_s + 0.2;
  const double top_g = world.stiffness_g_mm * world.depth_mm;
  const double hum_phase = random.Uniform(0, 6.28);
  const auto height = [&](double time_s) {
    if (time_s <= back_s) {
      return halt_z + approach_mm_s * std::max(0.0, halt_s - time_s) + world.backlash_mm;
    }
    const double dt = std::min(time_s - back_s, cruise_s + 2 * ramp_s);
    const double down = std::max(0.0, dt - ramp_s - cruise_s);
    const double z =
        halt_z + (dt < ramp_s ? 0.5 * acceleration * dt * dt
                              : ramp_mm + v * (dt - ramp_s) - 0.5 * acceleration * down * down);
    return std::max(
        halt_z + world.backlash_mm,
        std::min(z, z - world.onset_lag_mm * std::exp(-(z - halt_z) / world.onset_fade_mm)));
  };
  const std::vector<double> kernel = AveragingKernel(world.averages);
  double noise = 0;
  for (double t = start_s + random.Uniform() / world.rate_hz; t < end_s; t += 1 / world.rate_hz) {
    const double acted_s = t - world.latency_s;
    double press_g = 0;
    for (std::size_t i = 0; i < kernel.size(); ++i) {
      const double later = (static_cast<double>(i) - 0.5 * static_cast<double>(kernel.size() - 1)) /
                           kPartsOfInterval;
      const double d = tap.contact_z_mm - height(acted_s + later / world.rate_hz);
      press_g += kernel[i] * top_g * world.law(std::max(0.0, d) / world.depth_mm);
    }
    noise = world.memory * noise + std::sqrt(1 - world.memory * world.memory) * random.Normal();
    double force = press_g + world.noise_g * noise + world.drift_g_s * (t - start_s) +
                   world.hum_g * std::sin(6.283185307 * world.hum_hz * t + hum_phase);
    if (acted_s > back_s) {
      force += world.ring_g * std::sin(6.283185307 * world.ring_hz * (acted_s - back_s));
    }
    if (acted_s > back_s && height(acted_s) > tap.contact_z_mm + world.slip_mm) {
      force -= world.slip_g;
    }
    if (random.Uniform() < world.outlier_share) {
      force += world.noise_g * random.Uniform(30, 100);
    }
    if (world.resolution_g > 0) {
      force = world.resolution_g * std::round(force / world.resolution_g);
    }
    const bool held =
        world.held_share > 0 && !tap.force_g.empty() && random.Uniform() < world.held_share;
    const double late_s = world.late_s > 0 ? random.Uniform(0, world.late_s) : 0;
    tap.time_s.push_back(t + late_s);
    tap.force_g.push_back(held ? tap.force_g.back() : 100 + world.sign * force);
  }
  return tap;
}

/// Computes the force's residual after all combinations of the columns: orthogonalised one after
/// the other (modified Gram-Schmidt), without moments and normal equations.
inline double Unexplained(std::vector<std::vector<double>> columns, std::vector<double> rest) {
  const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += a[i] * b[i];
    }
    return sum;
  };
  const auto take_out = [&](const std::vector<double>& column, std::vector<double>& from) {
    const double share = product(column, from) / product(column, column);
    for (std::size_t i = 0; i < from.size(); ++i) {
      from[i] -= share * column[i];
    }
  };
  for (std::size_t k = 0; k < columns.size(); ++k) {
    for (std::size_t j = k + 1; j < columns.size(); ++j) {
      take_out(columns[k], columns[j]);
    }
    take_out(columns[k], rest);
  }
  return product(rest, rest);
}

}  // namespace trammel::tap::test
