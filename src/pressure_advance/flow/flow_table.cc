#include "pressure_advance/flow/flow_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

// Computes the form's nonlinear term, for an offset of 1.
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

// (A(fast) - A(slow)) / (fast - slow): the one pressure advance that stores just what this change
// of flow needs, s.
double PressureAdvanceBetween(const AdvanceModel& law, double slow_mm3_s, double fast_mm3_s) {
  TRAMMEL_CHECK(slow_mm3_s >= 0 && fast_mm3_s > slow_mm3_s, "{} to {} mm3/s", slow_mm3_s,
                fast_mm3_s);
  const auto stored_mm3 = [&](double flow_mm3_s) {
    return law.linear_s * flow_mm3_s + law.offset_mm3 * Bend(law.form, law.shape, flow_mm3_s);
  };
  return (stored_mm3(fast_mm3_s) - stored_mm3(slow_mm3_s)) / (fast_mm3_s - slow_mm3_s);
}

struct Fit {
  AdvanceModel law;
  double chi_square = std::numeric_limits<double>::infinity();
};

double ChiSquare(const AdvanceModel& law, const std::vector<AdvanceValue>& values) {
  double sum = 0;
  for (const AdvanceValue& value : values) {
    const double said_s = PressureAdvanceBetween(law, value.slow_mm3_s, value.fast_mm3_s);
    sum += Square((value.value_s - said_s) / value.sigma_s);
  }
  return sum;
}

// Fits linear part and offset for one shape by weighted least squares, neither below 0.
Fit FitShape(AdvanceForm form, double shape, const std::vector<AdvanceValue>& values) {
  double sw = 0, sb = 0, sy = 0, sbb = 0, sby = 0;
  for (const AdvanceValue& value : values) {
    const double w = 1 / Square(value.sigma_s);
    const double b = (Bend(form, shape, value.fast_mm3_s) - Bend(form, shape, value.slow_mm3_s)) /
                     (value.fast_mm3_s - value.slow_mm3_s);
    sw += w, sb += w * b, sy += w * value.value_s, sbb += w * b * b, sby += w * b * value.value_s;
  }
  const auto fit = [&](double linear_s, double offset_mm3) {
    const AdvanceModel law{form, linear_s, offset_mm3, shape, {shape, shape}};
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

// Returns the best of some shapes, with those that fit equally well.
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
  const double surplus = left_over > 0 ? best.chi_square / left_over : 1;
  // The sigmas are known: Birge's ratio (1932), not Student's t of one or two degrees of freedom.
  const double within = std::max(1.0, surplus) * Square(kNormal95);
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

// Lists knees from well below the slow flow, where a knee is invisible, to well above the fast one,
// where it is straight.
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

AdvanceModels FitAdvanceModels(const std::vector<AdvanceValue>& values) {
  AdvanceModels laws;
  const int flows = DifferentFlows(values);
  if (flows < 2) {
    laws.exponent =
        Measured::CannotTell("it takes two flows at least: calibrate with another fast speed, too");
    return laws;
  }
  const std::vector<double> exponents = Exponents();
  const AdvanceModel power = Profile(AdvanceForm::kPower, exponents, values).law;
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

namespace {

constexpr double kSame = 0.02;  // relative difference of conditions that count as one

bool Same(double a, double b) { return std::abs(a - b) <= kSame * std::max(a, b); }

bool SameLayer(const FlowPoint& a, const FlowPoint& b) {
  return a.layer_height_mm.has_value() == b.layer_height_mm.has_value() &&
         Same(a.layer_height_mm.value_or(0), b.layer_height_mm.value_or(0));
}

// Returns a standard uncertainty whose normal interval covers the stated one, which is wider with
// few degrees of freedom.
double Sigma(const Quantity& quantity) {
  const double half = 0.5 * (quantity.interval95.hi - quantity.interval95.lo);
  return std::max(quantity.standard_uncertainty, half / kNormal95);
}

Quantity QuantityOf(double value, double u, double half) {
  return {value, u, {value - half, value + half}};
}

// Returns the weighted mean of values under the same conditions. Scatter beyond their stated
// uncertainties widens it.
Quantity Combined(const std::vector<Quantity>& values) {
  if (values.size() == 1) return values.front();
  double weights = 0, sum = 0;
  for (const Quantity& value : values) {
    const double weight = 1 / Square(Sigma(value));
    weights += weight, sum += weight * value.value;
  }
  const double mean = sum / weights;
  double chi_square = 0;
  for (const Quantity& value : values) {
    chi_square += Square((value.value - mean) / Sigma(value));
  }
  const double left_over = static_cast<double>(values.size()) - 1;
  const double surplus = std::sqrt(chi_square / left_over);
  const double u = std::max(1.0, surplus) / std::sqrt(weights);
  return QuantityOf(mean, u, (surplus > 1 ? StudentT95(left_over) : kNormal95) * u);
}

std::vector<FlowPoint> Merged(std::vector<FlowPoint> points) {
  std::ranges::sort(points, {}, [](const FlowPoint& p) {
    return std::tuple{p.layer_height_mm, p.acceleration_mm_s2, p.flow_mm3_s};
  });
  std::vector<FlowPoint> rows;
  std::vector<std::vector<Quantity>> values;
  for (const FlowPoint& point : points) {
    const auto alike = std::ranges::find_if(rows, [&](const FlowPoint& row) {
      return SameLayer(row, point) && Same(row.acceleration_mm_s2, point.acceleration_mm_s2) &&
             Same(row.flow_mm3_s, point.flow_mm3_s);
    });
    const auto index = static_cast<std::size_t>(alike - rows.begin());
    if (alike == rows.end()) {
      rows.push_back(point);
      values.push_back({point.pressure_advance_s});
      continue;
    }
    alike->count += point.count;
    values[index].push_back(point.pressure_advance_s);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].pressure_advance_s = Combined(values[i]);
  return rows;
}

// Fits one slope for all groups, each of one layer height and with its own level:
// value = level(group) + slope · x.
FlowTrend CommonSlope(const std::vector<FlowPoint>& rows,
                      const std::function<double(const FlowPoint&)>& group,
                      const std::function<double(const FlowPoint&)>& x, const char* what) {
  std::vector<std::vector<const FlowPoint*>> groups;
  for (const FlowPoint& row : rows) {
    const auto found = std::ranges::find_if(groups, [&](const auto& members) {
      return SameLayer(*members.front(), row) && Same(group(*members.front()), group(row));
    });
    if (found == groups.end()) {
      groups.push_back({&row});
    } else {
      found->push_back(&row);
    }
  }
  double moment = 0, spread = 0, count = 0, levels = 0;
  std::vector<std::pair<const FlowPoint*, std::pair<double, double>>> used;  // less group's means
  for (const auto& members : groups) {
    if (members.size() < 2) continue;
    double weights = 0, sum_x = 0, sum_y = 0;
    for (const FlowPoint* row : members) {
      const double weight = 1 / Square(Sigma(row->pressure_advance_s));
      weights += weight, sum_x += weight * x(*row), sum_y += weight * row->pressure_advance_s.value;
    }
    for (const FlowPoint* row : members) {
      const double weight = 1 / Square(Sigma(row->pressure_advance_s));
      const double dx = x(*row) - sum_x / weights;
      const double dy = row->pressure_advance_s.value - sum_y / weights;
      moment += weight * dx * dy, spread += weight * dx * dx, count += 1;
      used.push_back({row, {dx, dy}});
    }
    levels += 1;
  }
  FlowTrend trend;
  if (!(spread > 0)) {
    trend.per_unit = Measured::CannotTell(
        fmt::format("no two calibrations differ in {} alone: make more of them", what));
    return trend;
  }
  const double slope = moment / spread;
  double chi_square = 0;
  for (const auto& [row, d] : used) {
    chi_square += Square((d.second - slope * d.first) / Sigma(row->pressure_advance_s));
  }
  const double left_over = count - levels - 1;
  const double surplus = left_over > 0 ? std::sqrt(chi_square / left_over) : 1;
  const double u = std::max(1.0, surplus) / std::sqrt(spread);
  // The rows' own uncertainties are known: Birge's ratio (1932), not Student's t of few rows.
  const double half = kNormal95 * u;
  trend.per_unit = Measured::Good(QuantityOf(slope, u, half));
  trend.significant = std::abs(slope) > half;
  return trend;
}

// Returns the rows of the acceleration with the most of them at one layer height; of several, the
// last.
std::vector<FlowPoint> OfOneAcceleration(const std::vector<FlowPoint>& rows) {
  std::vector<FlowPoint> most;
  for (const FlowPoint& row : rows) {
    std::vector<FlowPoint> alike;
    std::ranges::copy_if(rows, std::back_inserter(alike), [&](const FlowPoint& other) {
      return SameLayer(other, row) && Same(other.acceleration_mm_s2, row.acceleration_mm_s2);
    });
    if (alike.size() >= most.size()) most = std::move(alike);
  }
  return most;
}

void FitLaws(FlowTable& table) {
  std::vector<FlowPoint> rows = table.rows;
  const bool one_layer =
      std::ranges::all_of(rows, [&](const FlowPoint& row) { return SameLayer(row, rows.front()); });
  if (table.over_acceleration.significant || !one_layer) {
    rows = OfOneAcceleration(rows);
    table.laws_acceleration_mm_s2 = rows.front().acceleration_mm_s2;
    if (!one_layer) table.laws_layer_height_mm = rows.front().layer_height_mm;
  }
  std::vector<AdvanceValue> values;
  for (const FlowPoint& row : rows) {
    if (!(row.flow_mm3_s > row.slow_flow_mm3_s)) continue;
    values.push_back({row.slow_flow_mm3_s, row.flow_mm3_s, row.pressure_advance_s.value,
                      Sigma(row.pressure_advance_s)});
  }
  table.laws = FitAdvanceModels(values);
}

}  // namespace

Result<FlowTable> MakeFlowTable(std::vector<FlowPoint> points) {
  if (points.empty()) return Fail("there is no calibration to make a table of");
  for (const FlowPoint& point : points) {
    const bool sound = point.flow_mm3_s > 0 && std::isfinite(point.flow_mm3_s) &&
                       point.acceleration_mm_s2 > 0 && std::isfinite(point.acceleration_mm_s2) &&
                       point.layer_height_mm.value_or(1) > 0 &&
                       std::isfinite(point.layer_height_mm.value_or(1)) &&
                       point.pressure_advance_s.standard_uncertainty > 0;
    if (!sound) {
      return Fail(fmt::format(
          "flow {} mm3/s at {} mm/s2{} with an uncertainty of {} s: all must be positive numbers",
          point.flow_mm3_s, point.acceleration_mm_s2,
          point.layer_height_mm ? fmt::format(" in layers of {} mm", *point.layer_height_mm) : "",
          point.pressure_advance_s.standard_uncertainty));
    }
  }
  FlowTable table;
  table.rows = Merged(std::move(points));
  const auto count = static_cast<double>(table.rows.size());
  double sum = 0, u = 0, half = 0;  // errors fully correlated: most come from one printer
  for (const FlowPoint& row : table.rows) {
    const Quantity& value = row.pressure_advance_s;
    sum += value.value / count;
    u += value.standard_uncertainty / count;
    half += 0.5 * (value.interval95.hi - value.interval95.lo) / count;
  }
  table.single_s = QuantityOf(sum, u, half);
  for (const FlowPoint& row : table.rows) {
    table.greatest_miss_s =
        std::max(table.greatest_miss_s, std::abs(row.pressure_advance_s.value - sum));
  }
  const auto flow = [](const FlowPoint& row) { return row.flow_mm3_s; };
  const auto acceleration = [](const FlowPoint& row) { return row.acceleration_mm_s2; };
  table.over_flow = CommonSlope(table.rows, acceleration, flow, "flow");
  table.over_acceleration = CommonSlope(
      table.rows, flow, [](const FlowPoint& row) { return std::log2(row.acceleration_mm_s2); },
      "acceleration");
  FitLaws(table);
  const auto [slowest, fastest] =
      std::ranges::minmax(table.rows, {}, [](const FlowPoint& row) { return row.slow_flow_mm3_s; });
  if (!Same(slowest.slow_flow_mm3_s, fastest.slow_flow_mm3_s)) {
    table.notices.push_back(
        fmt::format("the slow stretches differ, {:.2f} to {:.2f} mm3/s: where the lag depends on "
                    "flow the rows do not compare",
                    slowest.slow_flow_mm3_s, fastest.slow_flow_mm3_s));
  }
  if (const auto heights_mm = LayerHeights_mm(table.rows); heights_mm.size() > 1) {
    table.notices.push_back(
        fmt::format("the layers are {:.3g} mm high: rows of one height alone compare, and the one "
                    "value is over all of them",
                    fmt::join(heights_mm, " and ")));
  }
  for (const FlowPoint& row : table.rows) {
    if (row.flow_mm3_s < 2 * row.slow_flow_mm3_s) {
      table.notices.push_back(fmt::format(
          "{:.2f} mm3/s is hardly more than the slow stretches' {:.2f}: its value is of a small "
          "change of flow",
          row.flow_mm3_s, row.slow_flow_mm3_s));
    }
  }
  return table;
}

std::vector<double> LayerHeights_mm(const std::vector<FlowPoint>& rows) {
  std::vector<double> heights_mm;
  for (const FlowPoint& row : rows) {
    const auto same = [&](double height_mm) { return IsOfLayerHeight(row, height_mm); };
    if (row.layer_height_mm && std::ranges::none_of(heights_mm, same)) {
      heights_mm.push_back(*row.layer_height_mm);
    }
  }
  std::ranges::sort(heights_mm);
  return heights_mm;
}

bool IsOfLayerHeight(const FlowPoint& row, double layer_height_mm) {
  return row.layer_height_mm && Same(*row.layer_height_mm, layer_height_mm);
}

std::vector<FlowPoint> AdaptiveRows(const FlowTable& table) {
  TRAMMEL_CHECK(LayerHeights_mm(table.rows).size() <= 1, "{} layer heights",
                LayerHeights_mm(table.rows).size());
  std::vector<FlowPoint> kept;
  for (const FlowPoint& row : table.rows) {
    const auto alike = [&](const FlowPoint& other) {
      return Same(other.acceleration_mm_s2, row.acceleration_mm_s2);
    };
    if (std::ranges::count_if(table.rows, alike) < 2) continue;
    kept.push_back(row);  // under the first one's acceleration: the slicer takes it to the digit
    kept.back().acceleration_mm_s2 = std::ranges::find_if(table.rows, alike)->acceleration_mm_s2;
  }
  return kept;
}

}  // namespace trammel::pressure_advance
