#include "measurement/creep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/statistics.h"
#include "base/student.h"

namespace trammel::measurement {
namespace {

/// A straight line through values at 0, 1, 2 …, by least squares.
struct Line {
  double slope = 0;
  double scatter_u = 0;  ///< standard uncertainty of the slope by the scatter about the line
  double stated_u = 0;   ///< by the stated uncertainties
};

Line FitLine(const std::vector<Quantity>& values) {
  const auto count = static_cast<double>(values.size());
  const double middle = (count - 1) / 2;
  const double spread = count * (count * count - 1) / 12;  // sum of (place - middle)^2
  double mean = 0;
  Line line;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double weight = (static_cast<double>(i) - middle) / spread;
    mean += values[i].value / count;
    line.slope += weight * values[i].value;
    line.stated_u = std::hypot(line.stated_u, weight * values[i].standard_uncertainty);
  }
  double squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double rest = values[i].value - mean - line.slope * (static_cast<double>(i) - middle);
    squares += rest * rest;
  }
  line.scatter_u = std::sqrt(squares / (count - 2) / spread);
  return line;
}

double InUnits(double value, double unit) {
  if (unit > 0) return value / unit;
  return value == 0 ? 0 : std::numeric_limits<double>::infinity();
}

/// Whether the line is not level, whichever uncertainty is asked.
bool IsAslant(const Line& line, double freedom) {
  constexpr double kSqrt2 = 1.4142135623730951;
  return StudentTail(InUnits(line.slope, line.scatter_u), freedom) < kCreepFalseAlarm &&
         std::erfc(std::abs(InUnits(line.slope, line.stated_u)) / kSqrt2) < kCreepFalseAlarm;
}

}  // namespace

std::vector<Creep> FindCreep(std::span<const Outcome> series) {
  std::vector<Creep> found;
  if (series.empty()) return found;
  for (const Answer& answer : series.back().answers) {
    if (!answer.value.good()) continue;
    std::vector<Quantity> values;
    for (const Outcome& outcome : series) {
      const Answer* const one = outcome.Find(answer.name);
      if (one != nullptr && one->unit == answer.unit && one->value.good()) {
        values.push_back(one->value.quantity());
      }
    }
    if (values.size() < kFewestForCreep) continue;
    const Line line = FitLine(values);
    const auto steps = static_cast<double>(values.size() - 1);
    const double freedom = steps - 1;
    const double change = steps * line.slope;
    const double half =
        steps * std::max(kNormal95 * line.stated_u, StudentPoint(0.05, freedom) * line.scatter_u);
    found.push_back(
        {answer.name,
         answer.unit,
         {change, steps * std::max(line.stated_u, line.scatter_u), {change - half, change + half}},
         values.size(),
         IsAslant(line, freedom)});
  }
  return found;
}

}  // namespace trammel::measurement
