#include "geometry/robust_line.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/check.h"

namespace trammel::geometry {
namespace {

/// Number of points that span the candidate lines: 24 give 276 pairs, a quarter of them clean even
/// if half of the points are outliers.
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

/// True if MedianResidual() would be below `bound`; does not order the residuals.
bool HasMedianBelow(double bound, std::span<const double> x, std::span<const double> y,
                    const RobustLine& line) {
  std::size_t near = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    near += std::abs(y[i] - line.at(x[i])) < bound ? 1 : 0;
  }
  return near > x.size() / 2;
}

}  // namespace

RobustLine FitRobustLine(std::span<const double> x, std::span<const double> y,
                         std::vector<double>& scratch) {
  TRAMMEL_CHECK(x.size() == y.size() && x.size() >= 2, "{} and {} points", x.size(), y.size());
  const std::size_t anchors = std::min(kAnchors, x.size());
  // Evenly chosen points that candidates are tried on.
  const std::size_t judges = std::min(kJudges, x.size());
  scratch.resize(2 * judges + x.size());
  const std::span judge_x = std::span(scratch).first(judges);
  const std::span judge_y = std::span(scratch).subspan(judges, judges);
  const std::span residuals = std::span(scratch).last(x.size());
  for (std::size_t i = 0; i < judges; ++i) {
    judge_x[i] = x[i * x.size() / judges];
    judge_y[i] = y[i * x.size() / judges];
  }
  RobustLine best;
  best.median_residual = std::numeric_limits<double>::max();
  std::array<double, kAnchors> anchor_x;
  std::array<double, kAnchors> anchor_y;
  for (std::size_t i = 0; i < anchors; ++i) {
    anchor_x[i] = x[i * (x.size() - 1) / (anchors - 1)];
    anchor_y[i] = y[i * (x.size() - 1) / (anchors - 1)];
  }
  const auto candidate = [&](std::size_t a, std::size_t b) {
    RobustLine line;
    line.slope = (anchor_y[b] - anchor_y[a]) / (anchor_x[b] - anchor_x[a]);
    line.offset = anchor_y[a] - line.slope * anchor_x[a];
    return line;
  };
  const auto median = [&](const RobustLine& line) {
    return MedianResidual(judge_x, judge_y, line, residuals);
  };
  // First tries a few likely good candidates, whose residual bounds the best.
  double bound = std::numeric_limits<double>::max();
  for (std::size_t a = 0; a < anchors / 4; a += 2) {
    if (anchor_x[a] == anchor_x[anchors - 1 - a]) break;
    bound = std::min(bound, median(candidate(a, anchors - 1 - a)));
  }
  bound = std::nextafter(bound, std::numeric_limits<double>::infinity());
  for (std::size_t a = 0; a < anchors; ++a) {
    for (std::size_t b = a + 1; b < anchors; ++b) {
      if (anchor_x[a] == anchor_x[b]) continue;
      RobustLine line = candidate(a, b);
      if (!HasMedianBelow(bound, judge_x, judge_y, line)) continue;
      bound = line.median_residual = median(line);
      best = line;
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
