#include "sim/laser/eye_test_support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace trammel::sim {

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
