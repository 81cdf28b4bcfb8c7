#include "pressure_advance/flow/advance_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

// What the form adds to a straight line, for an offset of 1.
double Bend(AdvanceForm form, double shape, double flow_mm3_s) {
  switch (form) {
    case AdvanceForm::kPower:
      return std::pow(flow_mm3_s, shape);
    case AdvanceForm::kTanh:
      return std::tanh(flow_mm3_s / shape);
    case AdvanceForm::kReciprocal:
      return 1 - 1 / (1 + flow_mm3_s / shape);
  }
  return 0;
}

struct Fit {
  AdvanceLaw law;
  double chi_square = std::numeric_limits<double>::infinity();
};

double ChiSquare(const AdvanceLaw& law, const std::vector<AdvanceValue>& values) {
  double sum = 0;
  for (const AdvanceValue& value : values) {
    const double said_s = PressureAdvanceBetween(law, value.slow_mm3_s, value.fast_mm3_s);
    sum += Square((value.value_s - said_s) / value.sigma_s);
  }
  return sum;
}

// Weighted least squares of linear part and offset for one shape, neither below 0.
Fit FitShape(AdvanceForm form, double shape, const std::vector<AdvanceValue>& values) {
  double sw = 0, sb = 0, sy = 0, sbb = 0, sby = 0;
  for (const AdvanceValue& value : values) {
    const double w = 1 / Square(value.sigma_s);
    const double b = (Bend(form, shape, value.fast_mm3_s) - Bend(form, shape, value.slow_mm3_s)) /
                     (value.fast_mm3_s - value.slow_mm3_s);
    sw += w, sb += w * b, sy += w * value.value_s, sbb += w * b * b, sby += w * b * value.value_s;
  }
  const auto fit = [&](double linear_s, double offset_mm3) {
    const AdvanceLaw law{form, linear_s, offset_mm3, shape, {shape, shape}};
    return Fit{law, ChiSquare(law, values)};
  };
  const Fit bend_only = fit(0, sbb > 0 ? std::max(0.0, sby / sbb) : 0);
  if (form == AdvanceForm::kPower) return bend_only;
  const double determinant = sw * sbb - sb * sb;
  if (determinant > 1e-12 * sw * sbb) {
    const double linear_s = (sbb * sy - sb * sby) / determinant;
    const double offset_mm3 = (sw * sby - sb * sy) / determinant;
    if (linear_s >= 0 && offset_mm3 >= 0) return fit(linear_s, offset_mm3);
  }
  const Fit straight = fit(std::max(0.0, sy / sw), 0);
  return bend_only.chi_square < straight.chi_square ? bend_only : straight;
}

// The best of some shapes, with those that fit as well.
Fit Profile(AdvanceForm form, const std::vector<double>& shapes,
            const std::vector<AdvanceValue>& values) {
  std::vector<double> chi_squares;
  Fit best;
  for (const double shape : shapes) {
    const Fit fit = FitShape(form, shape, values);
    chi_squares.push_back(fit.chi_square);
    if (fit.chi_square < best.chi_square) best = fit;
  }
  const double unknowns = form == AdvanceForm::kPower ? 2 : 3;
  const double left_over = static_cast<double>(values.size()) - unknowns;
  const double excess = left_over > 0 ? best.chi_square / left_over : 1;
  // The sigmas are known: Birge's ratio (1932), not Student's t of one or two degrees of freedom.
  const double within = std::max(1.0, excess) * Square(kNormal95);
  Interval& open = best.law.shape95;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (chi_squares[i] > best.chi_square + within) continue;
    open = {std::min(open.lo, shapes[i]), std::max(open.hi, shapes[i])};
  }
  return best;
}

int DifferentFlows(const std::vector<AdvanceValue>& values) {
  constexpr double kApart = 1.1;
  std::vector<double> flows;
  for (const AdvanceValue& value : values) flows.push_back(value.fast_mm3_s);
  std::ranges::sort(flows);
  int count = 0;
  double last = 0;
  for (const double flow : flows) {
    if (flow < kApart * last) continue;
    ++count;
    last = flow;
  }
  return count;
}

std::vector<double> Exponents() {
  std::vector<double> exponents;
  for (int i = 20; i <= 600; ++i) exponents.push_back(0.0025 * i);  // 0.05 … 1.5
  return exponents;
}

// From well below the slow flow, where a knee is not seen, to well above the fast one, where it is
// a straight line.
std::vector<double> Knees(const std::vector<AdvanceValue>& values) {
  double slowest = std::numeric_limits<double>::infinity(), fastest = 0;
  for (const AdvanceValue& value : values) {
    slowest = std::min(slowest, std::max(value.slow_mm3_s, 0.01 * value.fast_mm3_s));
    fastest = std::max(fastest, value.fast_mm3_s);
  }
  constexpr int kSteps = 200;
  std::vector<double> knees;
  for (int i = 0; i <= kSteps; ++i) {
    knees.push_back(slowest / 4 * std::pow(8 * fastest / slowest, static_cast<double>(i) / kSteps));
  }
  return knees;
}

}  // namespace

double AdvanceAt(const AdvanceLaw& law, double flow_mm3_s) {
  return law.linear_s * flow_mm3_s + law.offset_mm3 * Bend(law.form, law.shape, flow_mm3_s);
}

double PressureAdvanceBetween(const AdvanceLaw& law, double slow_mm3_s, double fast_mm3_s) {
  TRAMMEL_CHECK(slow_mm3_s >= 0 && fast_mm3_s > slow_mm3_s, "{} to {} mm3/s", slow_mm3_s,
                fast_mm3_s);
  return (AdvanceAt(law, fast_mm3_s) - AdvanceAt(law, slow_mm3_s)) / (fast_mm3_s - slow_mm3_s);
}

AdvanceLaws FitAdvanceLaws(const std::vector<AdvanceValue>& values) {
  AdvanceLaws laws;
  const int flows = DifferentFlows(values);
  if (flows < 2) {
    laws.exponent =
        Measured::CannotTell("it takes two flows at least: calibrate with another fast speed, too");
    return laws;
  }
  const std::vector<double> exponents = Exponents();
  const AdvanceLaw power = Profile(AdvanceForm::kPower, exponents, values).law;
  const Interval& open = power.shape95;
  const bool open_below = open.lo <= exponents.front(), open_above = open.hi >= exponents.back();
  if (open_below && open_above) {
    laws.exponent = Measured::CannotTell(
        "any law fits as well: the values are too uncertain for how little their flows differ");
    return laws;
  }
  laws.bends = open.hi < 1 || open.lo > 1;
  laws.exponent = Measured::Good({power.shape, (open.hi - open.lo) / (2 * kNormal95), open});
  constexpr int kFewestFlows = 3;
  if (flows < kFewestFlows || !(open.hi < 1)) return laws;
  const std::vector<double> knees = Knees(values);
  const Fit tanh = Profile(AdvanceForm::kTanh, knees, values);
  const Fit reciprocal = Profile(AdvanceForm::kReciprocal, knees, values);
  laws.firmware = tanh.chi_square < reciprocal.chi_square ? tanh.law : reciprocal.law;
  for (const AdvanceValue& value : values) {
    const double said_s =
        PressureAdvanceBetween(*laws.firmware, value.slow_mm3_s, value.fast_mm3_s);
    laws.greatest_miss_s = std::max(laws.greatest_miss_s, std::abs(value.value_s - said_s));
  }
  return laws;
}

}  // namespace trammel::pressure_advance
