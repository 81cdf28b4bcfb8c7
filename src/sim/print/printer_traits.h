// Compressed filament in a hot end at a given flow: the cause of all lag.
#pragma once

#include "base/random.h"

namespace trammel::sim {

/// Shape of S(q), the filament stored (mm) at steady flow q (mm of filament per second).
enum class StorageKind {
  kLinear,      ///< S = c q: one time constant at every flow
  kPower,       ///< S = c q^n: shear thinning, the lag falls as the flow rises
  kTanh,        ///< S = c ((1 - a) q + a q0 tanh(q / q0)): part of the storage saturates
  kReciprocal,  ///< S = c ((1 - a) q + a q0 (1 - 1 / (1 + q / q0))): saturates more slowly
};

struct StorageModel {
  StorageKind kind = StorageKind::kLinear;
  double scale_s = 0.036;         ///< c: s (kPower: mm / (mm/s)^n); > 0
  double exponent = 1;            ///< n of kPower; 0.2 … 1
  double saturating_share = 0.5;  ///< a of the saturating laws; 0 … 0.95
  double knee_mm_s = 2;           ///< q0 of the saturating laws, filament mm/s; > 0
};

/// Returns S(q) in mm of filament; odd in q.
[[nodiscard]] double Stored(const StorageModel& law, double flow_mm_s);

/// Steady flow and its derivative with respect to the storage that drives it.
struct DrivenFlow {
  double flow_mm_s = 0;
  double slope_per_s = 0;  ///< dq/dS: the inverse of the local time constant
};

/// Inverts Stored, odd in stored_mm. The saturating laws are solved to 1e-12 of the flow.
[[nodiscard]] DrivenFlow FlowFromStored(const StorageModel& law, double stored_mm);

/// Returns K* = (S(fast) - S(slow)) / (fast - slow): the pressure advance that exactly supplies the
/// storage of the change of flow. REQUIRES fast > slow >= 0, filament mm/s.
[[nodiscard]] double IdealPressureAdvance(const StorageModel& law, double slow_mm_s,
                                          double fast_mm_s);

/// Returns the law scaled such that IdealPressureAdvance is k_star_s. REQUIRES k_star_s > 0.
[[nodiscard]] StorageModel ScaledTo(StorageModel law, double k_star_s, double slow_mm_s,
                                    double fast_mm_s);

/// Behaviour when less filament is driven than delivered.
enum class Starvation {
  kRefill,  ///< The melt draws back from the orifice and must be refilled: filament is conserved.
  kClip,  ///< Air is drawn in while printing and leaves no debt: the outflow is only clipped at 0.
};

/// Traits of a printer with one filament. All scatter is drawn for each print from its Random. The
/// defaults are an ideal printer: linear, without scatter and without defects.
struct PrinterTraits {
  double bed_size_x_mm = 250;          ///< > 0 … 2000
  double bed_size_y_mm = 250;          ///< > 0 … 2000
  double filament_diameter_mm = 1.75;  ///< 0.5 … 5
  double nozzle_diameter_mm = 0.4;     ///< 0.1 … 2

  /// Motion limits in a printer.cfg; G-code can set acceleration and corner velocity.
  double max_velocity_mm_s = 500;          ///< > 0
  double max_acceleration_mm_s2 = 3000;    ///< > 0, until the G-code sets it
  double square_corner_velocity_mm_s = 5;  ///< >= 0, Klipper's default
  double minimum_cruise_ratio = 0.5;       ///< 0 … 1 (exclusive), Klipper's default
  double smooth_time_s = 0.040;            ///< 0 … 0.2; width of the kernel, Klipper's default

  /// Lag. The law's scale is not used: each print scales the law to k_star_s at its own speeds.
  double k_star_s = 0.036;  ///< the truth, 0.0001 … 10
  StorageModel law;
  Starvation starvation = Starvation::kRefill;
  double lag_scatter_s = 0;  ///< 1 sigma of one line's K* about the mean, 0 … 0.1

  /// Flow, as shares of the commanded flow.
  double flow_factor = 1;           ///< mean of the delivered flow, 0.2 … 2
  double flow_scatter = 0;          ///< 1 sigma line to line, 0 … 0.2
  double flow_drift = 0;            ///< amplitude of a slow wander over the print, 0 … 0.2
  double flow_noise = 0;            ///< 1 sigma along a line, 0 … 0.2
  double flow_noise_length_mm = 1;  ///< correlation length of flow_noise, 0.1 … 100
  double slip = 0;  ///< share lost at 15 mm^3/s, growing with the square of flow, 0 … 0.3

  /// Starts of lines: filament missing (> 0) or in surplus (< 0) after an un-retraction.
  double start_loss_mm = 0;          ///< mean, mm of filament, -0.2 … 0.2
  double start_loss_scatter_mm = 0;  ///< 1 sigma, 0 … 0.2

  /// The bead.
  double smear_mm = 0.3;          ///< length over which the melt levels along the path, 0 … 2
  double break_area_mm2 = 0.012;  ///< below it a bead parts into droplets, 0 … 1
  double gap_error_mm = 0;        ///< nozzle above its commanded height, -0.2 … 0.2
  double plate_tilt_x = 0;        ///< rise of the plate per mm in x, about the bed's centre, +-0.01
  double plate_tilt_y = 0;        ///< the same in y

  /// Prints of several layers alone.
  double foot_mm = 0;          ///< first layer wider by this (elephant's foot), 0 … 0.5
  double fillet_mm = 0;        ///< radius to which melt fills a concave corner, 0 … 1
  double corner_round_mm = 0;  ///< 1 sigma along the path by which belts round corners, 0 … 1

  /// Defects per metre of printed line, 0 … 1000.
  double blobs_per_m = 0;
  double gaps_per_m = 0;
  double strings_per_m = 0;
};

/// Draws a plausible printer with the truth k_star_s: random law, exponent (0.4 … 1), scatter of
/// lag (1 … 2 ms) and flow (1 … 2 %), starts and rare defects. REQUIRES 0.0001 <= k_star_s <= 10.
[[nodiscard]] PrinterTraits DrawTraits(double k_star_s, Random& random);

}  // namespace trammel::sim
