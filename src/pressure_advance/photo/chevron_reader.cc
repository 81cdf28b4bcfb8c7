#include "pressure_advance/photo/chevron_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

using vision::GrayImage;

// Returns the column where the fill passes one half, from plate (at `from`) to filament.
std::optional<double> HalfCrossing(const GrayImage& fill, int y, double from, double to) {
  const double step = to > from ? 0.5 : -0.5;
  double before = ValueAt(fill, from, y);
  if (before >= 0.5) return std::nullopt;
  for (double x = from + step; (to - x) * step > 0; x += step) {
    const double here = ValueAt(fill, x, y);
    if (here >= 0.5) return x - step * (here - 0.5) / (here - before);
    before = here;
  }
  return std::nullopt;
}

// Straight line x = c0 + c1 y through the points, robust.
struct Line {
  double c0 = 0, c1 = 0;
  [[nodiscard]] double operator()(double y) const { return c0 + c1 * y; }
};

// Fits by Tukey's biweight. geometry::FitRobustLine, through pairs of points, scatters too much to
// be continued to the apex.
Line FitLine(const std::vector<double>& y, const std::vector<double>& x) {
  constexpr int kRounds = 6;
  constexpr double kMinScatter_px = 0.05, kOutlier = 4;
  Line line;
  std::vector<double> weight(x.size(), 1), off(x.size());
  for (int round = 0; round < kRounds; ++round) {
    double w = 0, sx = 0, sy = 0, sxy = 0, syy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      w += weight[i];
      sx += weight[i] * x[i];
      sy += weight[i] * y[i];
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      sxy += weight[i] * (x[i] - sx / w) * (y[i] - sy / w);
      syy += weight[i] * (y[i] - sy / w) * (y[i] - sy / w);
    }
    line.c1 = syy > 0 ? sxy / syy : 0;
    line.c0 = (sx - line.c1 * sy) / w;
    for (std::size_t i = 0; i < x.size(); ++i) off[i] = x[i] - line(y[i]);
    const double scatter = std::max(kMinScatter_px, RobustStandardDeviation(off));
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double r = off[i] / (kOutlier * scatter);
      weight[i] = std::abs(r) < 1 ? std::pow(1 - r * r, 2) : 0;
    }
  }
  return line;
}

// Edges of one arm: columns over the rows' distance from the apexes' row (signed, px).
struct Arm {
  Line inner, outer;
  bool seen = false;
};

// Returns the band's edges in the mean section of an arm, in spacings from its middle along x.
std::optional<std::pair<double, double>> MeanEdges(const ChevronView& view, int chevron, int side) {
  constexpr int kHalf = 25;  // places on either side, of 1/50 spacing
  std::array<double, 2 * kHalf + 1> section{};
  const int begin = view.RowOf(side, kStraightBegin), end = view.RowOf(side, kStraightEnd);
  for (int y = begin; side * (end - y) >= 0; y += side) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      section[i + kHalf] += ValueAt(view.fill, view.ColumnOf(chevron, y, i / (2.0 * kHalf)), y);
    }
  }
  const double level = (std::abs(end - begin) + 1) / 2.0;
  if (section.front() >= level || section.back() >= level) return std::nullopt;
  const auto from_left =
      std::find_if(section.begin(), section.end(), [&](double value) { return value >= level; });
  if (from_left == section.end()) return std::nullopt;
  const auto from_right =
      std::find_if(section.rbegin(), section.rend(), [&](double value) { return value >= level; });
  const auto place = [&](std::ptrdiff_t index) {
    return static_cast<double>(index - kHalf) / (2.0 * kHalf);
  };
  return std::pair(place(from_left - section.begin()), place(section.rend() - from_right - 1));
}

Arm EdgesOf(const ChevronView& view, int chevron, int side) {
  Arm arm;
  const auto mean = MeanEdges(view, chevron, side);
  if (!mean) return arm;
  std::vector<double> y_inner, inner, y_outer, outer;
  const int begin = view.RowOf(side, kStraightBegin), end = view.RowOf(side, kStraightEnd);
  for (int y = begin; side * (end - y) >= 0; y += side) {
    constexpr double kReach = 0.12;  // spacings: a string or a speck farther off does not matter
    const auto crossing = [&](double edge, double outwards) {
      return HalfCrossing(view.fill, y, view.ColumnOf(chevron, y, edge + outwards * kReach),
                          view.ColumnOf(chevron, y, edge - outwards * kReach));
    };
    if (const auto x = crossing(mean->first, -1)) {
      y_inner.push_back(y - view.apex_y_px);
      inner.push_back(*x);
    }
    if (const auto x = crossing(mean->second, 1)) {
      y_outer.push_back(y - view.apex_y_px);
      outer.push_back(*x);
    }
  }
  const auto rows = static_cast<std::size_t>(std::abs(end - begin) + 1);
  if (2 * inner.size() < rows || 2 * outer.size() < rows) return arm;
  arm.inner = FitLine(y_inner, inner);
  arm.outer = FitLine(y_outer, outer);
  arm.seen = true;
  return arm;
}

// Returns the filled length of a row, px.
double SumRow(const ChevronView& view, int chevron, int y) {
  constexpr int kPerPixel = 2;
  const double from = view.ColumnOf(chevron, y, -0.5), to = view.ColumnOf(chevron, y, 0.5);
  const int n = static_cast<int>((to - from) * kPerPixel);
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += ValueAt(view.fill, from + (i + 0.5) * (to - from) / n, y);
  return sum * (to - from) / n;
}

// Straight edges of both arms of a chevron, continued to where they meet.
struct IdealBand {
  Arm above, below;

  [[nodiscard]] double RowWidth(double dy) const {
    return std::min(above.outer(dy), below.outer(dy)) - std::min(above.inner(dy), below.inner(dy));
  }
};

// Sums of `rows` neighbouring values, half overlapping.
std::vector<double> WindowSums(const std::vector<double>& values, std::size_t rows) {
  std::vector<double> sums;
  for (std::size_t i = 0; i + rows <= values.size(); i += std::max<std::size_t>(1, rows / 2)) {
    sums.push_back(std::accumulate(values.begin() + i, values.begin() + i + rows, 0.0));
  }
  return sums;
}

// True if the photo shows a corner with the space around it, to the ends of its straight arms.
bool ShowsCorner(const ChevronView& view, int chevron) {
  for (const int side : {-1, 1}) {
    for (const double t : {0.0, kStraightBegin, kStraightEnd}) {
      const int y = view.RowOf(side, t);
      for (const double off : {-0.5, 0.5}) {
        if (!view.Shows(view.ColumnOf(chevron, y, off), y)) return false;
      }
    }
  }
  return true;
}

ChevronReading ReadCorner(const ChevronView& view, int chevron, double half_rows) {
  ChevronReading reading;
  if (!ShowsCorner(view, chevron)) {
    reading.unusable = "the photo does not show all of this corner";
    return reading;
  }
  const IdealBand band{EdgesOf(view, chevron, -1), EdgesOf(view, chevron, 1)};
  if (!band.above.seen || !band.below.seen) {
    reading.unusable = "an arm's edges are not seen";
    return reading;
  }
  const auto surplus = [&](int y) {
    return SumRow(view, chevron, y) - band.RowWidth(y - view.apex_y_px);
  };
  // The straight arms calibrate the sum of a row, and show its scatter.
  std::vector<double> straight;
  std::array<double, 2> arm_widths{};
  for (const int side : {-1, 1}) {
    const int begin = view.RowOf(side, kStraightBegin), end = view.RowOf(side, kStraightEnd);
    for (int y = begin; side * (end - y) >= 0; y += side) straight.push_back(surplus(y));
    arm_widths[side > 0] = band.RowWidth((begin + end) / 2.0 - view.apex_y_px);
  }
  const double offset = Median(straight);
  for (double& value : straight) value -= offset;
  const int begin = static_cast<int>(std::ceil(view.apex_y_px - half_rows));
  const int end = static_cast<int>(std::floor(view.apex_y_px + half_rows));
  double sum = 0;
  for (int y = begin; y <= end; ++y) sum += surplus(y) - offset;
  // A row's length is the band's width times sqrt 2, and an area over the width is a length.
  const double unit = Mean(arm_widths) / std::numbers::sqrt2 * view.spacing_px;
  const auto rows = static_cast<std::size_t>(end - begin + 1);
  // Half of the window, as each arm is little longer than one; two halves scatter independently.
  const std::vector<double> windows = WindowSums(straight, std::max<std::size_t>(1, rows / 2));
  reading.surplus = sum / unit;
  reading.wider = arm_widths[1] / arm_widths[0] - 1;
  reading.sigma = std::max(1e-3, StandardDeviation(windows) * std::numbers::sqrt2 / unit);
  return reading;
}

}  // namespace

std::vector<ChevronReading> ReadChevrons(const ChevronView& view, double half_window) {
  constexpr double kLeast = 0.1, kMost = 1.7;  // spacings: the window ends where the arms begin
  const double half_rows =
      std::clamp(half_window, kLeast, kMost) / std::numbers::sqrt2 * view.spacing_px;
  std::vector<ChevronReading> readings;
  for (int chevron = 0; chevron < view.found.count; ++chevron) {
    readings.push_back(ReadCorner(view, chevron, half_rows));
  }
  return readings;
}

PhotoView PictureOf(const ChevronView& view, const std::vector<double>& pressure_advance_s) {
  const Frame& from = view.picture;
  PhotoView result;
  // Turned by a right angle against the clock: (x, y) becomes (y, width - 1 - x).
  result.rectified = Frame(from.height, from.width);
  for (int y = 0; y < from.height; ++y) {
    const std::uint8_t* source = from.view().row(y);
    for (int x = 0; x < from.width; ++x) {
      std::copy_n(source + std::ptrdiff_t{3} * x, 3,
                  result.rectified.row(from.width - 1 - x) + std::ptrdiff_t{3} * y);
    }
  }
  for (int chevron = 0; chevron < view.found.count; ++chevron) {
    TracedLine& line = result.lines.emplace_back();
    line.pressure_advance_s = pressure_advance_s[chevron];
    constexpr double kTraced = 4.2;
    const int end = view.RowOf(1, kTraced);
    for (int y = view.RowOf(-1, kTraced); y <= end; y += 2) {
      const double middle = view.ColumnOf(chevron, y, 0), reach = view.spacing_px / 2;
      const auto inner = HalfCrossing(view.fill, y, middle - reach, middle + reach);
      const auto outer = HalfCrossing(view.fill, y, middle + reach, middle - reach);
      if (!inner || !outer) continue;
      line.x_px.push_back(y);
      line.centre_px.push_back(from.width - 1 - (*inner + *outer) / 2);
      line.width_px.push_back(std::max(0.0, *outer - *inner));
    }
  }
  return result;
}

}  // namespace trammel::pressure_advance
