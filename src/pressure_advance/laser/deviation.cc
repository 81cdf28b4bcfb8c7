#include "pressure_advance/laser/deviation.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "base/check.h"
#include "geometry/linear_systems.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kRedThreshold = 50;  // pixels with less red are blacked out
constexpr int kBlur_px = 3;        // kernel, along and across the stripe
constexpr double kBlurSigma_px = 11;
constexpr double kExponent = 10;

// Returns the weight of each grey level.
std::array<double, 256> Weights() {
  std::array<double, 256> weight{};
  for (std::size_t v = 0; v < weight.size(); ++v) {
    weight[v] = std::pow(static_cast<double>(v) / 255, kExponent);
  }
  return weight;
}

/// Returns the cubic's minimum strictly inside [lo, hi], if it is lower than both ends.
std::optional<double> MinimumInside(const std::vector<double>& c, double lo, double hi) {
  const auto value = [&](double p) { return c[0] + p * (c[1] + p * (c[2] + p * c[3])); };
  const double discriminant = c[2] * c[2] - 3 * c[1] * c[3];
  if (discriminant < 0) {
    return std::nullopt;
  }
  // Solves 3 c3 p^2 + 2 c2 p + c1 = 0 without cancellation.
  const double q = -(c[2] + std::copysign(std::sqrt(discriminant), c[2]));
  std::optional<double> best;
  for (const double p : {q != 0 ? c[1] / q : NAN, c[3] != 0 ? q / (3 * c[3]) : NAN}) {
    const bool inside = std::isfinite(p) && p > lo && p < hi;
    if (inside && value(p) < value(lo) && value(p) < value(hi) &&
        (!best || value(p) < value(*best))) {
      best = p;
    }
  }
  return best;
}

/// Fits in u = (p - middle) / half range, which minimises the correlation of the powers, and
/// expands to powers of p.
void FitCubic(const std::vector<double>& p, const std::vector<double>& score,
              DeviationResult& result) {
  const auto [lo, hi] = std::minmax_element(p.begin(), p.end());
  const double middle = 0.5 * (*lo + *hi);
  const double half = 0.5 * (*hi - *lo);
  const auto n = static_cast<Eigen::Index>(p.size());
  Eigen::MatrixXd powers(n, 4);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double u = (p[static_cast<std::size_t>(i)] - middle) / half;
    powers.row(i) << 1, u, u * u, u * u * u;
    y[i] = score[static_cast<std::size_t>(i)];
  }
  const Eigen::VectorXd d = geometry::SolveLeastSquares(powers, y);
  const double residual = (y - powers * d).squaredNorm();
  const double total = (y.array() - y.mean()).matrix().squaredNorm();
  const double a = 1 / half;
  const double b = -middle / half;  // u = a p + b
  result.cubic = {d[0] + b * (d[1] + b * (d[2] + b * d[3])),
                  a * (d[1] + b * (2 * d[2] + 3 * b * d[3])), a * a * (d[2] + 3 * b * d[3]),
                  a * a * a * d[3]};
  result.r_squared = total > 0 ? 1 - residual / total : 0;
  result.cubic_minimum_s = MinimumInside(result.cubic, *lo, *hi);
}

}  // namespace

void FilterFrame(const BgrView& crop, DeviationFrame& result) {
  static const std::array<double, 256> weight = Weights();
  if (result.masked.width != crop.width || result.masked.height != crop.height) {
    result.masked = Frame(crop.width, crop.height);
  }
  const auto width = static_cast<std::size_t>(crop.width);
  for (int y = 0; y < crop.height; ++y) {
    const std::uint8_t* in = crop.row(y);
    std::uint8_t* out = result.masked.row(y);
    for (std::size_t x = 0; x < width; ++x, in += 3, out += 3) {
      const bool lit = in[2] >= kRedThreshold;
      for (int c = 0; c < 3; ++c) {
        out[c] = lit ? in[c] : std::uint8_t{0};
      }
    }
  }
  result.grey.resize(width * static_cast<std::size_t>(crop.height));
  result.blurred.resize(result.grey.size());
  const cv::Mat masked(crop.height, crop.width, CV_8UC3, result.masked.bgr.data());
  cv::Mat grey(crop.height, crop.width, CV_8UC1, result.grey.data());
  cv::Mat blurred(crop.height, crop.width, CV_8UC1, result.blurred.data());
  cv::cvtColor(masked, grey, cv::COLOR_BGR2GRAY);
  cv::GaussianBlur(grey, blurred, {kBlur_px, kBlur_px}, kBlurSigma_px, kBlurSigma_px);
  result.centre_px.assign(static_cast<std::size_t>(crop.height), kNoCentre);
  for (std::size_t y = 0; y < result.centre_px.size(); ++y) {
    double sum = 0;
    double total = 0;
    for (std::size_t x = 0; x < width; ++x) {
      const double w = weight[result.blurred[y * width + x]];
      sum += w * static_cast<double>(x);
      total += w;
    }
    if (total > 0) {
      result.centre_px[y] = sum / total;
    }
  }
}

HeightMap DeviationHeights(std::span<const Frame> frames, std::span<const std::size_t> order,
                           AxisDirection height_direction) {
  DeviationFrame scratch;
  HeightMap map;
  map.frames = order.size();
  map.rows = order.empty() ? 0 : static_cast<std::size_t>(frames[order[0]].height);
  map.height_px.resize(map.frames * map.rows);
  map.sigma_px.resize(map.frames * map.rows);
  const bool falls = Sign(height_direction) < 0;
  for (std::size_t f = 0; f < map.frames; ++f) {
    const Frame& frame = frames[order[f]];
    FilterFrame(frame.view(), scratch);
    for (std::size_t r = 0; r < map.rows; ++r) {
      const double centre = scratch.centre_px[r];
      if (centre != kNoCentre) {
        map.height_px[map.index(f, r)] = static_cast<float>(falls ? frame.width - centre : centre);
        map.sigma_px[map.index(f, r)] = 1;
      }
    }
  }
  return map;
}

std::optional<double> DeviationScore(const HeightMap& heights) {
  if (heights.frames < 2 || heights.rows == 0) {
    return std::nullopt;
  }
  double score = 0;
  std::size_t scored = 0;
  for (std::size_t r = 0; r < heights.rows; ++r) {
    double sum = 0;
    std::size_t seen = 0;
    for (std::size_t f = 0; f < heights.frames; ++f) {
      if (heights.sigma_px[heights.index(f, r)] > 0) {
        sum += heights.height_px[heights.index(f, r)];
        ++seen;
      }
    }
    if (seen < 2 || 2 * seen < heights.frames) {
      continue;
    }
    const double mean = sum / static_cast<double>(seen);
    double square = 0;
    for (std::size_t f = 0; f < heights.frames; ++f) {
      if (heights.sigma_px[heights.index(f, r)] > 0) {
        const double off = heights.height_px[heights.index(f, r)] - mean;
        square += off * off;
      }
    }
    score += std::sqrt(square / static_cast<double>(seen));
    ++scored;
  }
  if (2 * scored < heights.rows) {
    return std::nullopt;
  }
  return score * static_cast<double>(heights.rows) / static_cast<double>(scored);
}

DeviationResult ScoreByDeviation(std::span<const double> pressure_advance_s,
                                 std::span<const std::optional<double>> score_px) {
  TRAMMEL_CHECK(pressure_advance_s.size() == score_px.size(), "{} lines, {} scores",
                pressure_advance_s.size(), score_px.size());
  DeviationResult result;
  result.score_px.assign(score_px.begin(), score_px.end());
  std::vector<double> p;
  std::vector<double> score;
  for (std::size_t i = 0; i < score_px.size(); ++i) {
    if (score_px[i]) {
      p.push_back(pressure_advance_s[i]);
      score.push_back(*score_px[i]);
    }
  }
  if (p.empty()) {
    return result;
  }
  const auto lowest = std::min_element(score.begin(), score.end()) - score.begin();
  result.best_s = p[static_cast<std::size_t>(lowest)];
  std::vector<double> distinct = p;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  if (p.size() >= 5 && distinct.size() >= 4) {
    FitCubic(p, score, result);
  }
  return result;
}

}  // namespace trammel::pressure_advance
