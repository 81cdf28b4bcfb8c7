#include "pressure_advance/response/paired_difference.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/square.h"
#include "pressure_advance/response/fit_transitions.h"

namespace trammel::pressure_advance {
namespace {

// One line's difference, linear in three unknowns: that at the answer, how another law changes it
// below, and the share that gaps lose beyond.
struct Line {
  Eigen::Vector3d form;
  double difference_s = 0;
  double sigma_s = 0;   // of the readings
  double beyond_s = 0;  // what a straight loss leaves out
  double robust = 1;    // weight in [0, 1]

  [[nodiscard]] double variance(double scatter_s) const {
    return Square(scatter_s) + Square(sigma_s) + Square(beyond_s);
  }
};

void Place(const std::vector<double>& pa_s, double answer_s, double slope,
           const PairedOptions& options, std::vector<Line>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool below = answer_s > 0 && pa_s[i] < answer_s;
    const double short_of = below ? 1 - Square(pa_s[i] / answer_s) : 0;
    const double past_s = slope * std::max(0.0, pa_s[i] - answer_s);
    lines[i].form = {1 - (1 - options.at_rest) * short_of, short_of, -past_s};
    lines[i].beyond_s = options.distance_sigma * past_s;
  }
}

Eigen::Vector3d Solve(const std::vector<Line>& lines, double scatter_s, double law_sigma_s,
                      const PairedOptions& options, PairedDifference& result) {
  Eigen::Matrix3d data = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right(0, 0, options.loss_mean / Square(options.loss_sigma));
  for (const Line& line : lines) {
    const double weight = line.robust / line.variance(scatter_s);
    data += weight * line.form * line.form.transpose();
    right += weight * line.difference_s * line.form;
  }
  Eigen::Matrix3d prior = Eigen::Matrix3d::Zero();
  prior(1, 1) = 1 / Square(law_sigma_s);
  prior(2, 2) = 1 / Square(options.loss_sigma);
  const Eigen::LDLT<Eigen::Matrix3d> solver(data + prior);
  Eigen::Vector3d solved = solver.solve(right);
  const Eigen::Vector3d row = solver.solve(Eigen::Vector3d::UnitX());
  result.value_s = solved[0];
  result.sigma_s = std::sqrt(std::max(0.0, row.dot(data * row)));
  result.form_s = std::sqrt(row.dot(prior * row));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    result.fitted_s[i] = line.form.dot(solved);
    result.influence[i] = line.robust / line.variance(scatter_s) * row.dot(line.form);
  }
  return solved;
}

// The scatter of the lines about the fit, and their weights in the next one.
double Reweight(const Eigen::Vector3d& solved, double scatter_s, double prior_s, bool redescending,
                const PairedOptions& options, std::vector<Line>& lines) {
  constexpr double kPriorLines = 2;
  constexpr double kFitted = 1.5;  // the priors hold the other unknowns
  constexpr double kHuber = 1.345;
  double squares = kPriorLines * Square(prior_s);
  double count = kPriorLines;
  for (Line& line : lines) {
    const double residual_s = line.difference_s - line.form.dot(solved);
    const double near = 1 - Square(line.beyond_s) / line.variance(scatter_s);
    squares += line.robust * near * Square(residual_s);
    count += line.robust * near;
    const double pull = std::abs(residual_s) / std::sqrt(line.variance(scatter_s));
    line.robust = !redescending ? std::min(1.0, kHuber / std::max(pull, 1e-12))
                  : pull >= options.outlier_scale
                      ? 0
                      : Square(1 - Square(pull / options.outlier_scale));
  }
  return std::sqrt(squares / std::max(1.0, count - kFitted));
}

void CutOffBelowZero(PairedDifference& difference) {
  const double least_s = -std::sqrt(difference.variance());
  if (difference.value_s >= least_s) return;
  difference.form_s = std::sqrt(difference.variance());
  difference.sigma_s = 0;
  difference.value_s = least_s;
  difference.cut_off = true;
  std::fill(difference.influence.begin(), difference.influence.end(), 0.0);
}

}  // namespace

PairedDifference FitPairedDifference(const TransitionSeries& acceleration,
                                     const TransitionSeries& deceleration, double zero_s,
                                     double slope, double share, const PairedOptions& options) {
  constexpr int kIterations = 12;
  const std::size_t count = acceleration.pa_s.size();
  std::vector<Line> lines(count);
  for (std::size_t i = 0; i < count; ++i) {
    lines[i].difference_s = acceleration.excess_s[i] - deceleration.excess_s[i];
    lines[i].sigma_s = std::hypot(acceleration.sigma_s[i], deceleration.sigma_s[i]);
  }
  PairedDifference result;
  result.fitted_s.resize(count);
  result.influence.resize(count);
  const double prior_s = options.scatter_s * slope;
  double scatter_s = prior_s;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double answer_s = zero_s - share * std::max(0.0, result.value_s) / slope;
    Place(acceleration.pa_s, answer_s, slope, options, lines);
    const double law_sigma_s = std::hypot(options.at_rest_sigma * result.value_s,
                                          options.law_sigma * std::max(answer_s, 1e-4) * slope);
    const Eigen::Vector3d solved = Solve(lines, scatter_s, law_sigma_s, options, result);
    scatter_s = Reweight(solved, scatter_s, prior_s, iteration >= kIterations / 2, options, lines);
  }
  CutOffBelowZero(result);
  return result;
}

}  // namespace trammel::pressure_advance
