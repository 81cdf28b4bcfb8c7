// Taps drawn from a description of their force curve, good ones and each kind of bad one.
#pragma once

#include <cstdint>
#include <vector>

namespace trammel::test_support {

/// A move as Klipper's trapezoid queue holds it.
struct DrawnMove {
  double start_time_s = 0;
  double duration_s = 0;
  double start_velocity_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double start_z_mm = 0;
  double z_direction = 0;
};

/// A clean tap on a linear press unless said otherwise; forces are those of the published table.
struct TapDrawing {
  double rate_hz = 320;
  double noise_g = 2;
  double stiffness_g_mm = 3500;
  double depth_mm = 0.045;
  double sign = 1;       ///< sign of the press
  double tare_g = 0;     ///< The free nozzle's force.
  double curvature = 0;  ///< Force = stiffness d (1 + curvature d / depth).
  double approach_mm_s = 2;
  double pull_back_mm_s = 0.32;
  double pull_back_mm = 0.2;
  double acceleration_mm_s2 = 350;
  double before_s = 0.6;  ///< Recorded before the halt.
  double dwell_s = 0.3;
  double after_s = 0.3;  ///< Recorded after the pull-back.
  double drift_g_s = 0;
  double hum_g = 0;
  double hum_hz = 50;

  double onset_lag_s = 0;       ///< The press follows the pull-back this much later at its start.
  double onset_ring_g = 0;      ///< A swing of force during the pull-back's acceleration.
  double approach_noise_g = 0;  ///< Added while the head moves down.
  double relaxed = 0;           ///< Part of the force lost exponentially at rest, in 0.1 s.
  double plastic_mm = 0;        ///< Soft plastic that touches this much before the bed …
  double plastic_g = 0;         ///< … and pushes with this force when the bed is reached.
  double pull_g = 0;            ///< Ooze pulls after the break …
  double pull_mm = 0.02;        ///< … over this way.
  double step_g = 0;            ///< increase of the free nozzle's force after the press
  double impulse_g = 0;         ///< Instead of a press: an impulse of 20 ms at the halt.
  bool no_contact = false;      ///< The bed is not there.
  double full_scale_g = 1e9;    ///< Forces beyond it are cut off.
};

struct DrawnTap {
  std::vector<double> time_s;
  std::vector<double> force_g;
  std::vector<DrawnMove> moves;  ///< Six.
  double contact_z_mm = 0;
  double contact_time_s = 0;  ///< during the pull-back
};

/// The contact's height and the samples' phase are drawn from the seed, off any grid.
[[nodiscard]] DrawnTap DrawTap(const TapDrawing& drawing, std::uint64_t seed);

}  // namespace trammel::test_support
