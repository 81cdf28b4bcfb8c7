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
                      std::size_t judges, std::vector<double>& scratch) {
  scratch.clear();
  for (std::size_t i = 0; i < judges; ++i) {
    const std::size_t j = i * x.size() / judges;
    scratch.push_back(std::abs(y[j] - line.at(x[j])));
  }
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::nth_element(scratch.begin(), middle, scratch.end());
  return *middle;
}

}  // namespace

RobustLine FitRobustLine(std::span<const double> x, std::span<const double> y,
                         std::vector<double>& scratch) {
  TRAMMEL_CHECK(x.size() == y.size() && x.size() >= 2, "{} and {} points", x.size(), y.size());
  const std::size_t anchors = std::min(kAnchors, x.size());
  const std::size_t judges = std::min(kJudges, x.size());
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
      line.median_residual = MedianResidual(x, y, line, judges, scratch);
      if (line.median_residual < best.median_residual) {
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
    best.median_residual = MedianResidual(x, y, best, x.size(), scratch);
  }
  return best;
}

}  // namespace trammel::geometry
