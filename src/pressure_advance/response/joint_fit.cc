#include "pressure_advance/response/joint_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/square.h"

namespace trammel::pressure_advance {
namespace {

// Parameters: the answer (s), a slope and a bend for each window, slip and tail (s).
enum Parameter { kZero, kSlope, kBend = kSlope + 3, kSlip = kBend + 3, kTail, kCount };
// Windows: acceleration, deceleration, and the acceleration's, ending earlier.
constexpr int kWindows = 3;

// Part of a reading's sigma that is its line's level: it moves the transitions in opposite
// directions.
constexpr double kOfTheLevel = 0.7;
// Part of the early window's scatter that the acceleration's has, too: it lies in it.
constexpr double kNested = 0.95;
// Parameters that the residuals near the answer have adapted to.
constexpr double kFitted = 2.5;

using Parameters = Eigen::Matrix<double, kCount, 1>;
using Normal = Eigen::Matrix<double, kCount, kCount>;
using Window = Eigen::Matrix<double, kWindows, 1>;
using Jacobian = Eigen::Matrix<double, kWindows, kCount>;

struct Line {
  double pa_s = 0;
  Window excess_s = Window::Zero();
  Window sigma_s = Window::Zero();
};

// What the windows have in common, seen from the lines.
struct Problem {
  std::vector<Line> lines;
  Window slip_excess_s = Window::Zero();   // of a share of 1, signed
  Window level_excess_s = Window::Zero();  // likewise
};

// Variances that the residuals tell.
struct Scatter {
  double lag = 0;    // s^2, of a line's own lag
  double level = 0;  // relative, of its level beyond what is known
};

struct State {
  Parameters at = Parameters::Zero();
  Normal covariance = Normal::Zero();
  Parameters prior_sigma = Parameters::Zero();  // 0: none
  Scatter scatter;
  std::vector<double> weight;     // robust, of each line
  std::vector<Window> residual;   // of each line
  std::vector<Parameters> moved;  // by each line's residual
  std::vector<Jacobian> jacobian;
};

Problem Gather(const Transitions& transitions) {
  const TransitionSeries* series[] = {&transitions.acceleration, &transitions.deceleration,
                                      &*transitions.early};
  constexpr double kSign[] = {1, -1, 1};
  Problem problem;
  for (int k = 0; k < kWindows; ++k) {
    problem.slip_excess_s[k] = kSign[k] * series[k]->slip_excess_s;
    problem.level_excess_s[k] = kSign[k] * series[k]->level_excess_s;
  }
  for (std::size_t i = 0; i < series[0]->pa_s.size(); ++i) {
    Line line{series[0]->pa_s[i]};
    for (int k = 0; k < kWindows; ++k) {
      line.excess_s[k] = series[k]->excess_s[i];
      line.sigma_s[k] = series[k]->sigma_s[i];
    }
    if (line.sigma_s.allFinite()) problem.lines.push_back(line);
  }
  return problem;
}

// The tail's part in a window's crossing: the shorter window misses all of it once more.
double TailPart(int window, const JointFitOptions& options) {
  return options.tail_share + (window == 2 ? 1 : 0);
}

double DistanceSigma(int window, const JointFitOptions& options) {
  return window == 1 ? options.deceleration_distance_sigma : options.acceleration_distance_sigma;
}

// Residuals of one line and their derivatives (of the model).
void Linearise(const Problem& problem, const Line& line, const JointFitOptions& options,
               const Parameters& at, Window& residual, Jacobian& jacobian) {
  jacobian.setZero();
  const double u = at[kZero] - line.pa_s;
  const double side = u >= 0 ? 1 : -1;
  for (int k = 0; k < kWindows; ++k) {
    const double slope = at[kSlope + k];
    const double bend = at[kBend + k];
    const double tail = TailPart(k, options);
    const double form = u + tail * at[kTail] - bend * std::abs(u);
    residual[k] = line.excess_s[k] - slope * form - problem.slip_excess_s[k] * at[kSlip];
    jacobian(k, kZero) = slope * (1 - bend * side);
    jacobian(k, kSlope + k) = form;
    jacobian(k, kBend + k) = -slope * std::abs(u);
    jacobian(k, kSlip) = problem.slip_excess_s[k];
    jacobian(k, kTail) = slope * tail;
  }
}

// Covariance of one line's windows.
Eigen::Matrix3d Covariance(const Problem& problem, const Line& line, const State& state,
                           const JointFitOptions& options) {
  const double u = state.at[kZero] - line.pa_s;
  Window lag, far, reading;
  for (int k = 0; k < kWindows; ++k) {
    const double slope = state.at[kSlope + k];
    lag[k] = slope * (k == 1 ? std::max(0.2, 1 - state.at[kBend + k] * (u >= 0 ? 1 : -1)) : 1);
    far[k] = DistanceSigma(k, options) * slope * u;
    reading[k] = line.sigma_s[k] * (k == 1 ? options.deceleration_reading_factor
                                           : options.acceleration_reading_factor);
  }
  Eigen::Matrix3d covariance =
      state.scatter.lag * lag * lag.transpose() +
      state.scatter.level * problem.level_excess_s * problem.level_excess_s.transpose();
  for (int k = 0; k < kWindows; ++k) covariance(k, k) += Square(reading[k]) + Square(far[k]);
  const auto add = [&covariance](int j, int k, double value) {
    covariance(j, k) += value;
    covariance(k, j) += value;
  };
  add(0, 1, -kOfTheLevel * reading[0] * reading[1]);
  add(2, 1, -kOfTheLevel * reading[2] * reading[1]);
  add(0, 2, kNested * (Square(reading[2]) + far[0] * far[2]));
  return covariance;
}

// Lag and level from the residuals near the answer: the lag moves both transitions together, a
// level in opposite directions.
Scatter EstimateScatter(const Problem& problem, const State& state,
                        const JointFitOptions& options) {
  constexpr double kNear_s = 0.02;
  double together = 0, against = 0, known = 0, known_together = 0, weights = 0;
  for (std::size_t i = 0; i < problem.lines.size(); ++i) {
    const Line& line = problem.lines[i];
    const double u = state.at[kZero] - line.pa_s;
    const double weight = state.weight[i] / (1 + Square(u / kNear_s));
    const double a = state.residual[i][0] / state.at[kSlope];
    const double d = state.residual[i][1] / state.at[kSlope + 1];
    const double sigma_a = options.acceleration_reading_factor * line.sigma_s[0] / state.at[kSlope];
    const double sigma_d =
        options.deceleration_reading_factor * line.sigma_s[1] / state.at[kSlope + 1];
    together += weight * a * d;
    against += weight * Square(a - d);
    known +=
        weight * (Square(sigma_a) + Square(sigma_d) + 2 * kOfTheLevel * sigma_a * sigma_d +
                  Square(DistanceSigma(0, options) * u) + Square(DistanceSigma(1, options) * u));
    known_together += weight * kOfTheLevel * sigma_a * sigma_d;
    weights += weight;
  }
  const double n = static_cast<double>(problem.lines.size());
  const double left = n / std::max(1.0, n - kFitted);
  const double level_a = problem.level_excess_s[0];
  const double level_d = -problem.level_excess_s[1];
  constexpr double kLeastLevel = 0.005;
  constexpr double kLeastLag_s = 0.0002;
  Scatter scatter;
  scatter.level =
      std::max(Square(kLeastLevel), (against * left - known) / weights / Square(level_a + level_d));
  const double seen =
      (together * left + known_together) / weights + level_a * level_d * scatter.level;
  const double prior = options.lag_scatter_lines;
  const double free = std::max(0.0, n - 3);
  scatter.lag = std::max(Square(kLeastLag_s),
                         (seen * free + prior * Square(options.lag_scatter_s)) / (free + prior));
  return scatter;
}

double RobustWeight(const Window& residual, const Eigen::Matrix3d& covariance, bool redescending,
                    const JointFitOptions& options) {
  constexpr double kHuber = 2;
  const Eigen::Vector2d both = residual.head<2>();
  const double square = both.dot(covariance.topLeftCorner<2, 2>().inverse() * both);
  if (!redescending) return std::min(1.0, kHuber / std::sqrt(std::max(square, 1e-12)));
  const double most = Square(options.outlier_scale);
  return square < most ? Square(1 - square / most) : 0;
}

Parameters PriorSigma(const Parameters& at, const JointFitOptions& options) {
  Parameters sigma = Parameters::Zero();
  sigma[kBend] = sigma[kBend + 2] = options.acceleration_bend_sigma;
  // Of a scale mixture: Student's t, which believes what lies far out where it is clearly seen.
  const auto student = [](double scale, double off) {
    constexpr double kFreedom = 2;
    return scale * std::sqrt(std::max(1.0, (kFreedom + Square(off / scale)) / (kFreedom + 1)));
  };
  sigma[kBend + 1] = student(options.deceleration_bend_sigma,
                             std::min(0.0, at[kBend + 1] - options.deceleration_bend_mean));
  sigma[kSlip] = at[kSlip] < 0 ? options.level_scale : student(options.slip_scale, at[kSlip]);
  constexpr double kLeast_s = 0.005;
  sigma[kTail] = options.tail_sigma * std::max(kLeast_s, std::abs(at[kZero]));
  return sigma;
}

// One step of Gauss and Newton; false where the equations have no solution.
bool Step(const Problem& problem, const JointFitOptions& options, bool redescending, State& state) {
  Normal normal = Normal::Zero();
  Parameters right = Parameters::Zero();
  for (std::size_t i = 0; i < problem.lines.size(); ++i) {
    const Line& line = problem.lines[i];
    Linearise(problem, line, options, state.at, state.residual[i], state.jacobian[i]);
    const Eigen::Matrix3d covariance = Covariance(problem, line, state, options);
    state.weight[i] = RobustWeight(state.residual[i], covariance, redescending, options);
    const Eigen::Matrix<double, kCount, kWindows> weighed =
        state.weight[i] * state.jacobian[i].transpose() * covariance.inverse();
    normal += weighed * state.jacobian[i];
    state.moved[i] = weighed * state.residual[i];
    right += state.moved[i];
  }
  state.prior_sigma = PriorSigma(state.at, options);
  for (int j = 0; j < kCount; ++j) {
    if (state.prior_sigma[j] <= 0) continue;
    const double mean = j == kBend + 1 ? options.deceleration_bend_mean : 0;
    normal(j, j) += 1 / Square(state.prior_sigma[j]);
    right[j] += (mean - state.at[j]) / Square(state.prior_sigma[j]);
  }
  // The slopes of the two transitions, about equal.
  const double tie = 1 / Square(options.slope_sigma * state.at[kSlope]);
  const double unequal = state.at[kSlope + 1] - state.at[kSlope];
  normal(kSlope, kSlope) += tie;
  normal(kSlope + 1, kSlope + 1) += tie;
  normal(kSlope, kSlope + 1) -= tie;
  normal(kSlope + 1, kSlope) -= tie;
  right[kSlope] += tie * unequal;
  right[kSlope + 1] -= tie * unequal;
  state.covariance = normal.inverse();
  if (!state.covariance.allFinite()) return false;
  for (Parameters& moved : state.moved) moved = state.covariance * moved;
  Parameters step = state.covariance * right;
  constexpr double kLongest_s = 0.003;
  if (std::abs(step[kZero]) > kLongest_s) step *= kLongest_s / std::abs(step[kZero]);
  state.at += step;
  state.scatter = EstimateScatter(problem, state, options);
  return state.at.segment<3>(kSlope).minCoeff() > 0;
}

// A value that is linear in the parameters and, by `direct`, in each line's residuals.
JointValue ValueOf(double value_s, const Parameters& of, const std::vector<double>& direct,
                   const State& state, const JointFitOptions& options) {
  JointValue value{value_s, 0, 0, 0};
  double counted = 0;
  for (std::size_t i = 0; i < state.moved.size(); ++i) {
    value.lines += Square(direct[i] + of.dot(state.moved[i]));
    constexpr double kIgnored = 0.05;
    counted += state.weight[i] > kIgnored;
  }
  value.lines *= counted / std::max(1.0, counted - kFitted);
  const Parameters by = state.covariance * of;
  for (int j = 0; j < kCount; ++j) {
    if (state.prior_sigma[j] <= 0) continue;
    (j == kSlip ? value.slip : value.form) += Square(by[j] / state.prior_sigma[j]);
  }
  value.form += Square(options.tail_share_sigma * state.at[kTail]);
  return value;
}

// One transition's own crossing: where its residuals, weighed, are zero, slip, tail, slope and bend
// as all lines show them.
struct OwnCrossing {
  double value_s = 0;
  Parameters of = Parameters::Zero();
  std::vector<double> direct;
};

OwnCrossing CrossingOf(int window, const Problem& problem, const State& state,
                       const JointFitOptions& options) {
  OwnCrossing own{state.at[kZero], Parameters::Unit(kZero), {}};
  double total = 0;
  std::vector<double> weight;
  for (std::size_t i = 0; i < problem.lines.size(); ++i) {
    const double variance = Covariance(problem, problem.lines[i], state, options)(window, window);
    weight.push_back(state.weight[i] / variance);
    total += weight.back() * state.jacobian[i](window, kZero);
  }
  for (std::size_t i = 0; i < problem.lines.size(); ++i) {
    own.direct.push_back(weight[i] / total * state.residual[i][window]);
    own.value_s += own.direct.back();
    own.of -= weight[i] / total * state.jacobian[i].row(window).transpose();
  }
  return own;
}

}  // namespace

std::optional<JointFit> FitJointly(const Transitions& transitions, const TransitionCrossings& start,
                                   const JointFitOptions& options) {
  if (!transitions.early || !start.early || !(transitions.acceleration.level_excess_s > 0)) {
    return std::nullopt;
  }
  const Problem problem = Gather(transitions);
  constexpr std::size_t kFewestLines = 4;
  const std::size_t count = problem.lines.size();
  if (count < kFewestLines) return std::nullopt;
  State state;
  state.at[kZero] = start.acceleration.zero;
  state.at[kSlope] = state.at[kSlope + 1] = start.acceleration.slope;
  state.at[kSlope + 2] = start.early->slope;
  state.at[kBend + 1] = options.deceleration_bend_mean;
  if (!(state.at.segment<3>(kSlope).minCoeff() > 0)) return std::nullopt;
  state.scatter = {Square(options.lag_scatter_s), Square(0.005)};
  state.weight.assign(count, 1);
  state.residual.assign(count, Window::Zero());
  state.moved.assign(count, Parameters::Zero());
  state.jacobian.assign(count, Jacobian::Zero());
  constexpr int kIterations = 16;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    if (!Step(problem, options, iteration >= 4, state)) return std::nullopt;
  }
  const OwnCrossing a = CrossingOf(0, problem, state, options);
  const OwnCrossing d = CrossingOf(1, problem, state, options);
  std::vector<double> apart(count);
  for (std::size_t i = 0; i < count; ++i) apart[i] = a.direct[i] - d.direct[i];
  JointFit fit;
  fit.both = ValueOf(state.at[kZero], Parameters::Unit(kZero), std::vector<double>(count, 0.0),
                     state, options);
  fit.acceleration = ValueOf(a.value_s, a.of, a.direct, state, options);
  fit.deceleration = ValueOf(d.value_s, d.of, d.direct, state, options);
  fit.apart = ValueOf(a.value_s - d.value_s, a.of - d.of, apart, state, options);
  fit.slip_share = state.at[kSlip];
  fit.tail_s = state.at[kTail];
  return fit;
}

}  // namespace trammel::pressure_advance
