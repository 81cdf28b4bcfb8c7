#include "sim/laser/laser_test_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace trammel::sim {

std::string WriteTestPattern(const TestPattern& p) {
  std::string text = fmt::format(
      "; a test pattern\nG28\nG90\nM83\nM109 S255\nSET_VELOCITY_LIMIT ACCEL={}\nG1 Z0.25 F600\n"
      "G1 E-0.5 F2100\n",
      p.acceleration_mm_s2);
  for (int i = 0; i < p.lines; ++i) {
    const double advance_s = p.lines > 1 ? p.last_advance_s * i / (p.lines - 1) : p.last_advance_s;
    const double x0_mm = 100;
    const double x1_mm = x0_mm + p.slow_fraction * p.length_mm;
    const double x2_mm = x0_mm + (1 - p.slow_fraction) * p.length_mm;
    const double x3_mm = x0_mm + p.length_mm;
    text += fmt::format("SET_PRESSURE_ADVANCE ADVANCE={} SMOOTH_TIME={}\nM117 PA {}\n", advance_s,
                        p.smooth_time_s, advance_s);
    text += fmt::format("G1 X{} Y{} F12000\nG1 E0.5 F2100\n", x0_mm, 100 + 4 * i);
    text += fmt::format("G1 X{} E{} F{}\n", x1_mm, (x1_mm - x0_mm) * p.filament_per_mm,
                        p.slow_mm_s * 60);
    text += fmt::format("G1 X{} E{} F{}\n", x2_mm, (x2_mm - x1_mm) * p.filament_per_mm,
                        p.fast_mm_s * 60);
    text += fmt::format("G1 X{} E{} F{}\nG1 E-0.5 F2100\n", x3_mm,
                        (x3_mm - x2_mm) * p.filament_per_mm, p.slow_mm_s * 60);
  }
  return text + "M104 S0\nM84\n";
}

Bed StraightBead(double x0_mm, double x1_mm, double y_mm, double width_mm, double height_mm) {
  Bed bed{250, 250, {Strand{}}};
  const int steps = static_cast<int>(std::ceil((x1_mm - x0_mm) / 0.05));
  const double area = height_mm * (width_mm - height_mm * (1 - std::numbers::pi / 4));
  for (int i = 0; i <= steps; ++i) {
    bed.strands[0].samples.push_back(
        {x0_mm + (x1_mm - x0_mm) * i / steps, y_mm, area, width_mm, height_mm});
  }
  return bed;
}

double StripeColumn(const Frame& frame, int row, int floor) {
  double sum = 0;
  double moment = 0;
  const std::uint8_t* pixels = frame.view().row(row);
  for (int x = 0; x < frame.width; ++x) {
    const int red = pixels[3 * x + 2] - floor;
    if (red <= 0) continue;
    sum += red;
    moment += red * x;
  }
  return sum > 0 ? moment / sum : -1;
}

int RedPeak(const Frame& frame, int row) {
  int peak = 0;
  const std::uint8_t* pixels = frame.view().row(row);
  for (int x = 0; x < frame.width; ++x) peak = std::max<int>(peak, pixels[3 * x + 2]);
  return peak;
}

}  // namespace trammel::sim
