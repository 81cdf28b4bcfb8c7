#include "sim/print/printer_traits.h"

#include "base/check.h"
#include "sim/print/field_bound.h"

namespace trammel::sim {

Result<void> Validate(const PrinterTraits& t) {
  return CheckBounds("printer trait",
                     {
                         {"bed_size_x_mm", t.bed_size_x_mm, 1, 2000},
                         {"bed_size_y_mm", t.bed_size_y_mm, 1, 2000},
                         {"filament_diameter_mm", t.filament_diameter_mm, 0.5, 5},
                         {"nozzle_diameter_mm", t.nozzle_diameter_mm, 0.1, 2},
                         {"max_velocity_mm_s", t.max_velocity_mm_s, 1, 1e4},
                         {"max_acceleration_mm_s2", t.max_acceleration_mm_s2, 1, 1e6},
                         {"square_corner_velocity_mm_s", t.square_corner_velocity_mm_s, 0, 1e3},
                         {"minimum_cruise_ratio", t.minimum_cruise_ratio, 0, 0.999},
                         {"smooth_time_s", t.smooth_time_s, 0, 0.2},
                         {"k_star_s", t.k_star_s, 1e-4, 10},
                         {"law.exponent", t.law.exponent, 0.2, 1},
                         {"law.saturating_share", t.law.saturating_share, 0, 0.95},
                         {"law.knee_mm_s", t.law.knee_mm_s, 0.01, 1000},
                         {"lag_scatter_s", t.lag_scatter_s, 0, 0.1},
                         {"flow_scatter", t.flow_scatter, 0, 0.2},
                         {"flow_drift", t.flow_drift, 0, 0.2},
                         {"flow_noise", t.flow_noise, 0, 0.2},
                         {"flow_noise_length_mm", t.flow_noise_length_mm, 0.1, 100},
                         {"slip", t.slip, 0, 0.3},
                         {"start_loss_mm", t.start_loss_mm, -0.2, 0.2},
                         {"start_loss_scatter_mm", t.start_loss_scatter_mm, 0, 0.2},
                         {"smear_mm", t.smear_mm, 0, 2},
                         {"break_area_mm2", t.break_area_mm2, 0, 1},
                         {"plate_tilt_x", t.plate_tilt_x, -0.01, 0.01},
                         {"plate_tilt_y", t.plate_tilt_y, -0.01, 0.01},
                         {"blobs_per_m", t.blobs_per_m, 0, 1000},
                         {"gaps_per_m", t.gaps_per_m, 0, 1000},
                         {"strings_per_m", t.strings_per_m, 0, 1000},
                     });
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
  return traits;
}

}  // namespace trammel::sim
