#include "geometry/robust_line.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"

namespace trammel::geometry {
namespace {

/// Points that span the candidate lines: 24 give 276 pairs, of which a quarter is clean even where
/// half of the points are not.
constexpr std::size_t kAnchors = 24;
constexpr std::size_t kJudges = 256;

double MedianResidual(std::span<const double> x, std::span<const double> y, const RobustLine& line,
                      std::span<double> residuals) {
  for (std::size_t i = 0; i < x.size(); ++i) {
    residuals[i] = std::abs(y[i] - line.at(x[i]));
  }
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(residuals.begin(), middle,
                   residuals.begin() + static_cast<std::ptrdiff_t>(x.size()));
  return *middle;
}

/// Tells whether MedianResidual() would be below `bound`, without ordering the residuals: most
/// candidates are given up after little more than half of the points.
bool HasMedianBelow(double bound, std::span<const double> x, std::span<const double> y,
                    const RobustLine& line) {
  constexpr std::size_t kBlock = 8;  // points between two looks at the count
  std::size_t beyond_left = x.size() - x.size() / 2;
  for (std::size_t i = 0; i < x.size();) {
    const std::size_t end = std::min(i + kBlock, x.size());
    std::size_t beyond = 0;
    for (; i < end; ++i) {
      beyond += std::abs(y[i] - line.at(x[i])) < bound ? 0 : 1;
    }
    if (beyond >= beyond_left) return false;
    beyond_left -= beyond;
  }
  return true;
}

}  // namespace

RobustLine FitRobustLine(std::span<const double> x, std::span<const double> y,
                         std::vector<double>& scratch) {
  TRAMMEL_CHECK(x.size() == y.size() && x.size() >= 2, "{} and {} points", x.size(), y.size());
  const std::size_t anchors = std::min(kAnchors, x.size());
  const std::size_t judges = std::min(kJudges, x.size());
  scratch.resize(2 * judges + x.size());
  const std::span judge_x(scratch.data(), judges);
  const std::span judge_y(scratch.data() + judges, judges);
  const std::span residuals(scratch.data() + 2 * judges, x.size());
  for (std::size_t i = 0; i < judges; ++i) {
    judge_x[i] = x[i * x.size() / judges];
    judge_y[i] = y[i * x.size() / judges];
  }
  RobustLine best;
  best.median_residual = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < anchors; ++i) {
    for (std::size_t j = i + 1; j < anchors; ++j) {
      const std::size_t a = i * (x.size() - 1) / (anchors - 1);
      const std::size_t b = j * (x.size() - 1) / (anchors - 1);
      if (x[a] == x[b]) {
        continue;
      }
      RobustLine line;
      line.slope = (y[b] - y[a]) / (x[b] - x[a]);
      line.offset = y[a] - line.slope * x[a];
      if (HasMedianBelow(best.median_residual, judge_x, judge_y, line)) {
        line.median_residual = MedianResidual(judge_x, judge_y, line, residuals);
        best = line;
      }
    }
  }
  // One weighted step over the points near the line: the pairs alone are as noisy as two points.
  const double reach = std::max(3 * 1.4826 * best.median_residual, 1e-9);
  double sw = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::abs(y[i] - best.at(x[i])) > reach) {
      continue;
    }
    sw += 1;
    sx += x[i];
    sy += y[i];
    sxx += x[i] * x[i];
    sxy += x[i] * y[i];
  }
  const double determinant = sw * sxx - sx * sx;
  if (determinant > 1e-9 * sw * sxx) {
    best.slope = (sw * sxy - sx * sy) / determinant;
    best.offset = (sy - best.slope * sx) / sw;
    best.median_residual = MedianResidual(x, y, best, residuals);
  }
  return best;
}

}  // namespace trammel::geometry
