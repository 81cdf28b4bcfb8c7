// Test world: a pinhole camera and a laser on a head with backlash, above a plate. Shares no code
// with the estimators: it projects points, they fit lines.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/random.h"
#include "pressure_advance/setup/solve_setup.h"

namespace trammel::pressure_advance::testing {

inline constexpr double kRad = std::numbers::pi / 180;

struct SetupWorld {
  double px_per_mm = 40;  // at the focus height
  double turn_rad = 0;    // counter-clockwise from above
  double laser_angle_rad = 45 * kRad;
  double focus_mm = 17.86;
  double distance_mm = 55;  // lens to plate, at the focus height
  double axis_x_mm = 28;    // nozzle to the foot of the optical axis
  double axis_y_mm = 50.2;
  double spot_mm = 5.5;  // stripe from that foot, along the camera's own x
  double backlash_x_mm = 0;
  double backlash_y_mm = 0;
  double backlash_z_mm = 0;
  double repeat_mm = 0;  // 1 sigma of each axis' place
  double noise_px = 0;   // 1 sigma of a mark's or a stripe's place
  double mark_x_mm = 150;
  double mark_y_mm = 150;
  double axis_error[3] = {0, 0, 0};  // per axis x, y, z: true motion over commanded, less 1
  double principal_px = 0;  // optical axis from the picture's middle, along the stripe's normal
  double mirror = 1;        // -1: the picture's columns are reversed
  double skew = 0;          // stripe width per mm from focus, relative
  double halo = 0;          // stripe width at best focus, independent of height, relative

  [[nodiscard]] double Scale(double z_mm) const {
    return px_per_mm * distance_mm / (distance_mm + z_mm - focus_mm);
  }
  [[nodiscard]] SeenMark See(HeadPlace head, Random& random) const {
    const double x = head.x_mm + backlash_x_mm * head.from_x / 2 + repeat_mm * random.Normal();
    const double y = head.y_mm + backlash_y_mm * head.from_y / 2 + repeat_mm * random.Normal();
    const double right_mm = (mark_x_mm - x) * (1 + axis_error[0]) - axis_x_mm;
    const double back_mm = (mark_y_mm - y) * (1 + axis_error[1]) - axis_y_mm;
    const double scale = Scale(head.z_mm);
    SeenMark mark{head, 0, 0};
    mark.column_px =
        640 + mirror * scale * (right_mm * std::cos(turn_rad) + back_mm * std::sin(turn_rad));
    mark.row_px = 360 - scale * (back_mm * std::cos(turn_rad) - right_mm * std::sin(turn_rad));
    mark.column_px += noise_px * random.Normal();
    mark.row_px += noise_px * random.Normal();
    return mark;
  }
  [[nodiscard]] SeenStripe SeeStripe(HeadPlace head, Random& random) const {
    const double moved = head.z_mm + backlash_z_mm * head.from_z / 2 + repeat_mm * random.Normal();
    const double z = focus_mm + (moved - focus_mm) * (1 + axis_error[2]);
    const double across_mm = spot_mm - std::tan(laser_angle_rad) * (z - focus_mm);
    const double spread = std::hypot(2.5, 1.2 * (z - focus_mm));
    const double width =
        Scale(z) / px_per_mm * std::max(spread, 2.5 * (1 + halo)) * std::exp(skew * (z - focus_mm));
    return {head, Scale(z) * across_mm + principal_px + noise_px * random.Normal(),
            width * (1 + 0.01 * random.Normal() * (noise_px > 0 ? 1 : 0))};
  }
  /// Sixteen places on a square of 9 mm, every other reached from the other side.
  [[nodiscard]] std::vector<SeenMark> Marks(Random& random) const {
    std::vector<SeenMark> marks;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const HeadPlace head{mark_x_mm - 28 + 3 * i - 4.5, mark_y_mm - 50 + 3 * j - 4.5, focus_mm,
                             (i + j) % 2 == 0 ? 1 : -1,    j / 2 == i / 2 ? 1 : -1,      -1};
        marks.push_back(See(head, random));
      }
    }
    return marks;
  }
  /// Heights from `from_mm` in steps of 0.5 mm, upwards and then downwards.
  [[nodiscard]] std::vector<SeenStripe> Stripes(double from_mm, int steps, Random& random) const {
    std::vector<SeenStripe> stripes;
    for (int i = 0; i < 2 * steps; ++i) {
      const int step = i < steps ? i : 2 * steps - 1 - i;
      stripes.push_back(
          SeeStripe({120, 100, from_mm + 0.5 * step, 1, 1, i < steps ? 1 : -1}, random));
    }
    return stripes;
  }
};

}  // namespace trammel::pressure_advance::testing
