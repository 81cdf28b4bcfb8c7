#include "sim/print/printer_traits.h"

#include <cmath>

#include "base/check.h"

namespace trammel::sim {

namespace {

struct Shape {
  double value = 0;  // S / scale
  double slope = 0;  // derivative
};

// Computes the shape for flow >= 0 and saturating models only.
Shape SaturatingShape(const StorageModel& law, double flow_mm_s) {
  const double a = law.saturating_share;
  const double ratio = flow_mm_s / law.knee_mm_s;
  Shape bent;
  if (law.kind == StorageKind::kTanh) {
    bent.value = std::tanh(ratio);
    bent.slope = 1 - bent.value * bent.value;
  } else {
    bent.value = ratio / (1 + ratio);
    bent.slope = 1 / ((1 + ratio) * (1 + ratio));
  }
  return {(1 - a) * flow_mm_s + a * law.knee_mm_s * bent.value, (1 - a) + a * bent.slope};
}

double PositiveShape(const StorageModel& law, double flow_mm_s) {
  switch (law.kind) {
    case StorageKind::kLinear:
      return flow_mm_s;
    case StorageKind::kPower:
      return std::pow(flow_mm_s, law.exponent);
    case StorageKind::kTanh:
    case StorageKind::kReciprocal:
      return SaturatingShape(law, flow_mm_s).value;
  }
  return flow_mm_s;
}

// Newton from below: the shapes are concave with a slope of 1 at 0, so that `level` is at or below
// the root and every step remains there.
DrivenFlow InvertSaturating(const StorageModel& law, double level) {
  double flow = level;
  for (int i = 0; i < 50; ++i) {
    const Shape shape = SaturatingShape(law, flow);
    const double step = (level - shape.value) / shape.slope;
    flow += step;
    if (std::abs(step) <= 1e-12 * (1e-9 + flow)) {
      break;
    }
  }
  return {flow, 1 / (law.scale_s * SaturatingShape(law, flow).slope)};
}

DrivenFlow PositiveFlow(const StorageModel& law, double stored_mm) {
  const double level = stored_mm / law.scale_s;
  switch (law.kind) {
    case StorageKind::kLinear:
      return {level, 1 / law.scale_s};
    case StorageKind::kPower: {
      const double flow = std::pow(level, 1 / law.exponent);
      return {flow, flow / (law.exponent * stored_mm)};
    }
    case StorageKind::kTanh:
    case StorageKind::kReciprocal:
      return InvertSaturating(law, level);
  }
  return {};
}

}  // namespace

double Stored(const StorageModel& law, double flow_mm_s) {
  return std::copysign(law.scale_s * PositiveShape(law, std::abs(flow_mm_s)), flow_mm_s);
}

DrivenFlow FlowFromStored(const StorageModel& law, double stored_mm) {
  // Below a picometre the flow is negligible, and the power law's slope would be 0/0.
  if (std::abs(stored_mm) < 1e-9) {
    return {};
  }
  DrivenFlow driven = PositiveFlow(law, std::abs(stored_mm));
  driven.flow_mm_s = std::copysign(driven.flow_mm_s, stored_mm);
  return driven;
}

double IdealPressureAdvance(const StorageModel& law, double slow_mm_s, double fast_mm_s) {
  TRAMMEL_CHECK(slow_mm_s >= 0 && fast_mm_s > slow_mm_s, "slow = {}, fast = {}", slow_mm_s,
                fast_mm_s);
  return (Stored(law, fast_mm_s) - Stored(law, slow_mm_s)) / (fast_mm_s - slow_mm_s);
}

StorageModel ScaledTo(StorageModel law, double k_star_s, double slow_mm_s, double fast_mm_s) {
  TRAMMEL_CHECK(k_star_s > 0, "k_star_s = {}", k_star_s);
  law.scale_s = 1;
  law.scale_s = k_star_s / IdealPressureAdvance(law, slow_mm_s, fast_mm_s);
  return law;
}

PrinterTraits DrawTraits(double k_star_s, Random& random) {
  TRAMMEL_CHECK(k_star_s >= 1e-4 && k_star_s <= 10, "k_star_s = {}", k_star_s);
  constexpr double kLinearOdds = 0.2;
  constexpr double kPowerOdds = 0.5;
  constexpr double kTanhOdds = 0.2;
  constexpr double kRefillOdds = 0.7;
  PrinterTraits traits;
  traits.k_star_s = k_star_s;
  const double kind = random.Uniform();
  traits.law.kind = kind < kLinearOdds                            ? StorageKind::kLinear
                    : kind < kLinearOdds + kPowerOdds             ? StorageKind::kPower
                    : kind < kLinearOdds + kPowerOdds + kTanhOdds ? StorageKind::kTanh
                                                                  : StorageKind::kReciprocal;
  traits.law.exponent = random.Uniform(0.4, 1);
  traits.law.saturating_share = random.Uniform(0.3, 0.8);
  traits.law.knee_mm_s = random.Uniform(1, 4);
  traits.starvation = random.Uniform() < kRefillOdds ? Starvation::kRefill : Starvation::kClip;
  traits.lag_scatter_s = random.Uniform(0.001, 0.002);
  traits.flow_scatter = random.Uniform(0.01, 0.02);
  traits.flow_drift = random.Uniform(0, 0.015);
  traits.flow_noise = random.Uniform(0.005, 0.015);
  traits.flow_noise_length_mm = random.Uniform(0.5, 3);
  traits.slip = random.Uniform(0, 0.02);
  traits.start_loss_mm = random.Uniform(0, 0.02);
  traits.start_loss_scatter_mm = random.Uniform(0, 0.01);
  traits.smear_mm = random.Uniform(0.2, 0.4);
  traits.break_area_mm2 = random.Uniform(0.008, 0.016);
  traits.plate_tilt_x = random.Normal(0, 1e-4);
  traits.plate_tilt_y = random.Normal(0, 1e-4);
  traits.blobs_per_m = random.Uniform(0, 1);
  traits.gaps_per_m = random.Uniform(0, 0.5);
  traits.strings_per_m = random.Uniform(0, 0.5);
  traits.foot_mm = random.Uniform(0, 0.15);
  traits.fillet_mm = random.Uniform(0.15, 0.45);
  traits.corner_round_mm = random.Uniform(0.05, 0.3);
  return traits;
}

}  // namespace trammel::sim
