#include "part_alignment/survey/snooping.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "part_alignment/survey/network_start.h"
#include "part_alignment/survey/orientation.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

constexpr double kMedianChiSquare2 = 1.3862943611198906;  // for two degrees of freedom: 2 ln 2
constexpr double kLossWidth = 3;                          // sigmas, of Cauchy's loss

// Minimum numbers of observations that determine a station and a point.
constexpr int kMinOfStation = 3;
constexpr int kMinOfPoint = 2;

// Worst test and number of observations of one station or point.
struct Worst {
  double test = 0;
  int observations = 0;
  void Add(double of_sight) {
    test = std::max(test, of_sight);
    ++observations;
  }
};

double Cauchy(double s, double width2) { return width2 * std::log1p(s / width2); }

struct PointFit {
  Vector3d at = Vector3d::Zero();
  double cost = 0;
};

// Fits one point alone, stations and lens fixed, Cauchy's loss.
std::optional<PointFit> FitPoint(const Network& network,
                                 const std::vector<std::size_t>& observations,
                                 const Vector3d& start, double scatter) {
  const double width2 = kLossWidth * kLossWidth;
  PointFit fit{start, std::numeric_limits<double>::infinity()};
  Vector3d at = start;
  constexpr int kMaxSteps = 20;
  double damping = 1e-6;
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    double cost = 0;
    for (const std::size_t i : observations) {
      const NetworkObservation& observation = network.observations[i];
      const Station& station = network.stations[observation.station];
      const auto projection = ProjectLens(network.lens, station.FromObject(at));
      if (!projection) return std::nullopt;
      const double weight = 1 / (scatter * observation.sigma_px);
      const Eigen::Vector2d residual = weight * (projection->pixel - observation.pixel);
      const Eigen::Matrix<double, 2, 3> row = weight * projection->by_point * station.rotation;
      const double s = residual.squaredNorm();
      cost += Cauchy(s, width2);
      normal += row.transpose() * row / (1 + s / width2);
      right += row.transpose() * residual / (1 + s / width2);
    }
    if (cost < fit.cost) {
      const bool done = fit.cost - cost < 1e-6;
      fit = {at, cost};
      if (done) break;
      damping *= 0.1;
    } else {
      damping *= 100;
    }
    normal.diagonal() *= 1 + damping;
    at = fit.at - geometry::SolveSymmetric(normal, right);
  }
  return fit;
}

std::vector<std::vector<std::size_t>> ObservationsByPoint(const Network& network) {
  std::vector<std::vector<std::size_t>> observations(network.points.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const NetworkObservation& observation = network.observations[i];
    if (network.stations[observation.station].placed && network.points[observation.point].placed)
      observations[observation.point].push_back(i);
  }
  for (auto& of_point : observations) {
    std::stable_sort(of_point.begin(), of_point.end(), [&](std::size_t a, std::size_t b) {
      return network.observations[a].station < network.observations[b].station;
    });
  }
  return observations;
}

}  // namespace

double RobustScatter(const Network& network) {
  std::vector<double> squares;
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    if (const auto misclosure = Misclosure(network, observation)) {
      squares.push_back(misclosure->squaredNorm() / (observation.sigma_px * observation.sigma_px));
    }
  }
  return squares.empty() ? 0 : std::sqrt(Median(squares) / kMedianChiSquare2);
}

NetworkPrecision SnoopObservations(const BundleOptions& options, double false_alarm,
                                   Network& network) {
  constexpr double kMinScatter = 1e-6;  // floor for noise-free observations
  while (true) {
    (void)AdjustBundle(options, network);
    NetworkPrecision precision = PrecisionOf(network, options.free, options.bars);
    std::vector<double> tests;
    for (const auto& check : precision.observations) {
      if (check.test > 0) tests.push_back(check.test);
    }
    if (tests.empty()) return precision;
    const double scatter2 = std::max(Median(tests) / kMedianChiSquare2, kMinScatter);
    // Bonferroni: chi-square of two degrees exceeds x with probability exp(-x / 2).
    const double limit = -2 * std::log(false_alarm / static_cast<double>(tests.size())) * scatter2;
    std::vector<Worst> of_station(network.stations.size());
    std::vector<Worst> of_point(network.points.size());
    for (std::size_t i = 0; i < network.observations.size(); ++i) {
      const NetworkObservation& observation = network.observations[i];
      if (!TakesPart(network, observation)) continue;
      of_station[observation.station].Add(precision.observations[i].test);
      of_point[observation.point].Add(precision.observations[i].test);
    }
    bool left_out = false;
    for (std::size_t i = 0; i < network.observations.size(); ++i) {
      NetworkObservation& observation = network.observations[i];
      const double test = precision.observations[i].test;
      const Worst& station = of_station[observation.station];
      const Worst& point = of_point[observation.point];
      if (test > limit && test >= station.test && test >= point.test &&
          station.observations > kMinOfStation && point.observations > kMinOfPoint) {
        observation.used = false;
        left_out = true;
      }
    }
    if (!left_out) return precision;
  }
}

std::vector<DoublePoint> FindDoublePoints(const Network& network) {
  constexpr std::size_t kMinThere = 3;
  constexpr double kMaxCostOfObservation = 5;  // on average: 2 expected
  const double scatter = std::max(RobustScatter(network), 1e-6);
  const auto by_point = ObservationsByPoint(network);
  std::vector<DoublePoint> doubles;
  for (std::size_t p = 0; p < by_point.size(); ++p) {
    std::vector<std::size_t> unused;
    std::vector<Vector3d> places;
    std::vector<Vector3d> directions;
    for (const std::size_t i : by_point[p]) {
      const NetworkObservation& observation = network.observations[i];
      const auto line = ObservationLine(network.lens, observation.pixel);
      if (observation.used || !line) continue;
      const Station& station = network.stations[observation.station];
      unused.push_back(i);
      places.push_back(station.place);
      directions.emplace_back(station.rotation.transpose() * *line);
    }
    if (unused.size() < kMinThere) continue;
    const auto start = Intersect(places, directions);
    if (!start) continue;
    const auto fit = FitPoint(network, unused, *start, scatter);
    if (fit && fit->cost < kMaxCostOfObservation * static_cast<double>(unused.size())) {
      doubles.push_back({p, by_point[p].size() - unused.size(), unused.size()});
    }
  }
  return doubles;
}

std::vector<MovedPoint> FindMovedPoints(const Network& network) {
  constexpr std::size_t kMinObservations = 3;  // per side
  constexpr double kMinGain = 60;              // of cost: far beyond the gain by choosing the split
  constexpr double kMaxCostOfObservation = 5;  // average of the resulting two: 2 expected
  const double scatter = std::max(RobustScatter(network), 1e-6);
  const auto by_point = ObservationsByPoint(network);
  std::vector<MovedPoint> moved;
  for (std::size_t p = 0; p < by_point.size(); ++p) {
    const std::vector<std::size_t>& observations = by_point[p];
    if (observations.size() < 2 * kMinObservations) continue;
    const auto one = FitPoint(network, observations, network.points[p].at, scatter);
    if (!one || one->cost < kMinGain) continue;
    double best = one->cost;
    MovedPoint candidate;
    for (std::size_t k = kMinObservations; k + kMinObservations <= observations.size(); ++k) {
      const auto middle = observations.begin() + static_cast<std::ptrdiff_t>(k);
      const auto before = FitPoint(network, {observations.begin(), middle}, one->at, scatter);
      const auto after = FitPoint(network, {middle, observations.end()}, one->at, scatter);
      if (!before || !after || before->cost + after->cost >= best) continue;
      best = before->cost + after->cost;
      candidate = {p, network.observations[*middle].station, (after->at - before->at).norm()};
    }
    if (one->cost - best > kMinGain &&
        best < kMaxCostOfObservation * static_cast<double>(observations.size())) {
      moved.push_back(candidate);
    }
  }
  return moved;
}

namespace {

// Normal equations of a point's position by one station alone.
struct PointPull {
  std::size_t station = 0;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
};
using PullsOfPoint = std::vector<std::vector<PointPull>>;

PullsOfPoint PullsOf(const Network& network) {
  PullsOfPoint pulls(network.points.size());
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    const ObservationPartials partials = PartialsOf(network, observation);
    pulls[observation.point].push_back({observation.station,
                                        partials.by_point.transpose() * partials.by_point,
                                        -partials.by_point.transpose() * partials.residual});
  }
  return pulls;
}

// Shift of a point from its position by the stations before to that by those after.
struct PointStep {
  double chi_square = 0;  // three degrees of freedom
  double by = 0;
};

std::optional<PointStep> StepOf(const std::vector<PointPull>& pulls,
                                const std::vector<std::size_t>& rank, std::size_t first_after) {
  constexpr int kMinOfSide = 3;
  PointPull before;
  PointPull after;
  int of_before = 0;
  int of_after = 0;
  for (const PointPull& pull : pulls) {
    const bool is_after = rank[pull.station] >= first_after;
    PointPull& side = is_after ? after : before;
    side.normal += pull.normal;
    side.right += pull.right;
    ++(is_after ? of_after : of_before);
  }
  if (of_before < kMinOfSide || of_after < kMinOfSide) return std::nullopt;
  const Eigen::Matrix3d of_before_mm2 = before.normal.inverse();
  const Eigen::Matrix3d of_after_mm2 = after.normal.inverse();
  const Vector3d by = of_after_mm2 * after.right - of_before_mm2 * before.right;
  const Eigen::Matrix3d covariance = of_before_mm2 + of_after_mm2;
  if (!covariance.allFinite()) return std::nullopt;
  return PointStep{by.dot(covariance.inverse() * by), by.norm()};
}

// Most significant step of all points together, in the stations' order by `rank`.
struct JointStep {
  std::size_t first_after = 0;  // rank
  double sigmas = 0;            // of the sum of chi-squares above its mean
};

JointStep FindJointStep(const PullsOfPoint& pulls, const std::vector<std::size_t>& rank) {
  constexpr double kOfPoint = 3;      // degrees of freedom
  constexpr double kMaxOfPoint = 30;  // one point that moved is no change of the shape
  constexpr int kMinPoints = 4;
  JointStep most;
  for (std::size_t first_after = 1; first_after < rank.size(); ++first_after) {
    double sum = 0;
    int points = 0;
    for (const auto& of_point : pulls) {
      if (const auto step = StepOf(of_point, rank, first_after)) {
        sum += std::min(step->chi_square, kMaxOfPoint);
        ++points;
      }
    }
    if (points < kMinPoints) continue;
    const double mean = kOfPoint * points;
    const double sigmas = (sum - mean) / std::sqrt(2 * mean);
    if (sigmas > most.sigmas) most = {first_after, sigmas};
  }
  return most;
}

}  // namespace

std::optional<ShapeStep> FindShapeStep(const Network& network, Random& random) {
  constexpr double kMinSigmas = 5;
  constexpr int kOrders = 20;
  constexpr double kBeyondOrders = 4;  // their standard deviations above their mean
  // Limits of the deviation of random orders: 1.2 to 1.5 in sound networks; a true step widens it,
  // too.
  constexpr double kMinDeviation = 1.0;
  constexpr double kMaxDeviation = 2.5;
  constexpr double kOfOnePoint = 16.27;  // chi-square of three degrees: 0.1 %
  const PullsOfPoint pulls = PullsOf(network);
  std::vector<std::size_t> rank(network.stations.size());
  for (std::size_t s = 0; s < rank.size(); ++s) rank[s] = s;
  const JointStep step = FindJointStep(pulls, rank);
  if (step.sigmas < kMinSigmas) return std::nullopt;
  double sum = 0;
  double squares = 0;
  for (int order = 0; order < kOrders; ++order) {
    for (std::size_t i = rank.size(); i > 1; --i) std::swap(rank[i - 1], rank[random.Below(i)]);
    const double sigmas = FindJointStep(pulls, rank).sigmas;
    sum += sigmas;
    squares += sigmas * sigmas;
  }
  const double mean = sum / kOrders;
  const double deviation = std::sqrt(std::max(squares / kOrders - mean * mean, 0.0));
  if (step.sigmas < mean + kBeyondOrders * std::clamp(deviation, kMinDeviation, kMaxDeviation))
    return std::nullopt;
  for (std::size_t s = 0; s < rank.size(); ++s) rank[s] = s;
  ShapeStep found{step.first_after, 0, 0, 0};
  double most = 0;
  for (std::size_t p = 0; p < pulls.size(); ++p) {
    const auto of_point = StepOf(pulls[p], rank, step.first_after);
    if (!of_point) continue;
    found.points += of_point->chi_square > kOfOnePoint ? 1 : 0;
    if (of_point->chi_square <= most) continue;
    most = of_point->chi_square;
    found.most = p;
    found.by = of_point->by;
  }
  return found;
}

namespace {

// Fits a station with a focal length of its own, to all of its observations: the loss narrows, so
// any start is near enough.
std::optional<StationFit> FitWithFocal(Network network,
                                       const std::vector<std::size_t>& observations,
                                       Station station, double scatter) {
  for (const std::size_t i : observations) network.observations[i].used = true;
  std::optional<StationFit> fit;
  for (const double width : {1000.0, 30.0, 1.0}) {
    fit = FitStation(network, observations, station, width * kLossWidth * scatter, true);
    if (!fit) return std::nullopt;
    network.lens[kFocal] = fit->focal_px;
    station = fit->station;
  }
  return fit;
}

}  // namespace

std::optional<FocalStep> FindFocalStep(const Network& network) {
  constexpr std::size_t kMinStations = 2;  // per side
  constexpr std::size_t kMinObservations = 6;
  constexpr double kMinGain = 60;
  constexpr double kMaxCostOfObservation = 5;  // in their scatter: 2 expected
  const double scatter = std::max(RobustScatter(network), 1e-6);
  const auto observations = ObservationsByStation(network);
  std::vector<std::pair<std::size_t, double>> focals;
  std::vector<double> weights;
  for (std::size_t s = 0; s < observations.size(); ++s) {
    if (!network.stations[s].placed || observations[s].size() < kMinObservations) continue;
    const auto fit = FitWithFocal(network, observations[s], network.stations[s], scatter);
    if (!fit || fit->observations < kMinObservations) continue;
    // Few observations have other minima, with focal lengths that are off by half.
    const auto max_cost =
        kMaxCostOfObservation * scatter * scatter * static_cast<double>(fit->observations);
    if (!(fit->cost < max_cost)) continue;
    focals.emplace_back(s, fit->focal_px);
    weights.push_back(1 / std::pow(scatter * fit->focal_sigma_px, 2));
  }
  // Sums before and after each station yield the gain of two means over one.
  double all = 0;
  double all_weight = 0;
  for (std::size_t i = 0; i < focals.size(); ++i) {
    all += weights[i] * focals[i].second;
    all_weight += weights[i];
  }
  double sum = 0;
  double weight = 0;
  double best = kMinGain;
  std::optional<FocalStep> step;
  for (std::size_t i = 0; i + kMinStations < focals.size(); ++i) {
    sum += weights[i] * focals[i].second;
    weight += weights[i];
    if (i + 1 < kMinStations) continue;
    const double before = sum / weight;
    const double after = (all - sum) / (all_weight - weight);
    const double gain =
        weight * (all_weight - weight) / all_weight * (after - before) * (after - before);
    if (gain > best) {
      best = gain;
      step = FocalStep{focals[i + 1].first, before, after};
    }
  }
  return step;
}

}  // namespace trammel::part_alignment
