#include "pressure_advance/flow/flow_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include "base/square.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kSame = 0.02;  // relative difference of conditions that count as one

bool Same(double a, double b) { return std::abs(a - b) <= kSame * std::max(a, b); }

// A standard uncertainty whose normal interval is no narrower than the one that is stated: one of
// few degrees of freedom is wider.
double Sigma(const Quantity& quantity) {
  const double half = 0.5 * (quantity.interval95.hi - quantity.interval95.lo);
  return std::max(quantity.standard_uncertainty, half / kNormal95);
}

Quantity QuantityOf(double value, double u, double half) {
  return {value, u, {value - half, value + half}};
}

// Weighted mean of values under the same conditions. Scatter beyond what they state widens it.
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
  const double excess = std::sqrt(chi_square / left_over);
  const double u = std::max(1.0, excess) / std::sqrt(weights);
  return QuantityOf(mean, u, (excess > 1 ? StudentT95(left_over) : kNormal95) * u);
}

std::vector<FlowPoint> Merged(std::vector<FlowPoint> points) {
  std::ranges::sort(points, {}, [](const FlowPoint& p) {
    return std::pair{p.acceleration_mm_s2, p.flow_mm3_s};
  });
  std::vector<FlowPoint> rows;
  std::vector<std::vector<Quantity>> values;
  for (const FlowPoint& point : points) {
    const auto alike = std::ranges::find_if(rows, [&](const FlowPoint& row) {
      return Same(row.acceleration_mm_s2, point.acceleration_mm_s2) &&
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

// One slope for all groups, each with a level of its own: value = level(group) + slope · x.
FlowTrend CommonSlope(const std::vector<FlowPoint>& rows,
                      const std::function<double(const FlowPoint&)>& group,
                      const std::function<double(const FlowPoint&)>& x, const char* what) {
  std::vector<std::vector<const FlowPoint*>> groups;
  for (const FlowPoint& row : rows) {
    const auto found = std::ranges::find_if(
        groups, [&](const auto& members) { return Same(group(*members.front()), group(row)); });
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
  const double excess = left_over > 0 ? std::sqrt(chi_square / left_over) : 1;
  const double u = std::max(1.0, excess) / std::sqrt(spread);
  // The rows' own uncertainties are known: Birge's ratio (1932), not Student's t of few rows.
  const double half = kNormal95 * u;
  trend.per_unit = Measured::Good(QuantityOf(slope, u, half));
  trend.significant = std::abs(slope) > half;
  return trend;
}

// Rows of the acceleration with the most of them; of several such, the highest.
std::vector<FlowPoint> OfOneAcceleration(const std::vector<FlowPoint>& rows) {
  std::vector<FlowPoint> most;
  for (const FlowPoint& row : rows) {
    std::vector<FlowPoint> alike;
    std::ranges::copy_if(rows, std::back_inserter(alike), [&](const FlowPoint& other) {
      return Same(other.acceleration_mm_s2, row.acceleration_mm_s2);
    });
    if (alike.size() >= most.size()) most = std::move(alike);
  }
  return most;
}

void FitLaws(FlowTable& table) {
  std::vector<FlowPoint> rows = table.rows;
  if (table.over_acceleration.significant) {
    rows = OfOneAcceleration(rows);
    table.laws_acceleration_mm_s2 = rows.front().acceleration_mm_s2;
  }
  std::vector<AdvanceValue> values;
  for (const FlowPoint& row : rows) {
    if (!(row.flow_mm3_s > row.slow_flow_mm3_s)) continue;
    values.push_back({row.slow_flow_mm3_s, row.flow_mm3_s, row.pressure_advance_s.value,
                      Sigma(row.pressure_advance_s)});
  }
  table.laws = FitAdvanceLaws(values);
}

}  // namespace

Result<FlowTable> MakeFlowTable(std::vector<FlowPoint> points) {
  if (points.empty()) return Fail("there is no calibration to make a table of");
  for (const FlowPoint& point : points) {
    const bool sound = point.flow_mm3_s > 0 && std::isfinite(point.flow_mm3_s) &&
                       point.acceleration_mm_s2 > 0 && std::isfinite(point.acceleration_mm_s2) &&
                       point.pressure_advance_s.standard_uncertainty > 0;
    if (!sound) {
      return Fail(fmt::format(
          "flow {} mm3/s at {} mm/s2 with an uncertainty of {} s: all must be positive numbers",
          point.flow_mm3_s, point.acceleration_mm_s2,
          point.pressure_advance_s.standard_uncertainty));
    }
  }
  FlowTable table;
  table.rows = Merged(std::move(points));
  const auto count = static_cast<double>(table.rows.size());
  double sum = 0, u = 0, half = 0;  // as if all rows erred alike: much of it comes of one printer
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

std::vector<FlowPoint> AdaptiveRows(const FlowTable& table) {
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
