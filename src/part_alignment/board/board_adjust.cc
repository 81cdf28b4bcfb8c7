#include "part_alignment/board/board_adjust.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// The sights of each stop, so that each is gone through once.
std::vector<std::vector<const BoardNetwork::Sight*>> SightsByStop(const BoardNetwork& network) {
  std::vector<std::vector<const BoardNetwork::Sight*>> by_stop(network.stops.size());
  for (const BoardNetwork::Sight& sight : network.sights) {
    if (sight.used && network.stops[sight.view].used) by_stop[sight.view].push_back(&sight);
  }
  return by_stop;
}

Index MarkIndex(Index shared, std::size_t mark) { return shared + 3 * static_cast<Index>(mark); }

// False where a sight is not seen.
bool AddStop(const BoardNetwork& network, const BoardState& state, std::size_t stop,
             const std::vector<const BoardNetwork::Sight*>& sights, BoardNormal& normal) {
  const Index shared = SharedUnknowns(network);
  BoardNormal::Stop& sums = normal.stops[stop];
  const double weight_place = 1 / std::pow(network.machine.repeatability_mm, 2);
  sums.block = weight_place * Matrix3d::Identity();
  sums.right = -weight_place * state.off_mm[stop];
  sums.sights = static_cast<int>(sights.size());
  const auto unknowns = shared + 3 * static_cast<Index>(sights.size());
  sums.coupling.setZero(unknowns, 3);
  for (Index i = 0; i < shared; ++i) sums.unknowns.push_back(i);
  const StopFrame frame = FrameOf(network, state, stop);
  SightPartials partials;
  MatrixXd shared_shared = MatrixXd::Zero(shared, shared);
  Index row = shared;
  for (const BoardNetwork::Sight* sight : sights) {
    if (!PartialsOf(network, state, frame, *sight, partials)) return false;
    const double weight = 1 / (sight->sigma_px * sight->sigma_px);
    const Index mark = MarkIndex(shared, sight->mark);
    const Eigen::Matrix<double, 3, 2> weighted = weight * partials.by_mark.transpose();
    const Matrix3d mark_mark = weighted * partials.by_mark;
    const Vector3d mark_right = -(weighted * partials.residual);
    const MatrixXd mark_shared = weighted * partials.by_shared;  // 3 × shared
    const Eigen::Matrix<double, Eigen::Dynamic, 2> weighted_shared =
        weight * partials.by_shared.transpose();
    shared_shared += weighted_shared.lazyProduct(partials.by_shared);
    normal.right.head(shared) -= weighted_shared.lazyProduct(partials.residual);
    normal.matrix.block<3, 3>(mark, mark) += mark_mark;
    normal.matrix.block(mark, 0, 3, shared) += mark_shared;
    normal.right.segment<3>(mark) += mark_right;
    // The stop's place moves the picture as the mark does, the other way round.
    sums.block += mark_mark;
    sums.right -= mark_right;
    sums.coupling.topRows(shared) -= mark_shared.transpose();
    sums.coupling.middleRows<3>(row) -= mark_mark;
    for (Index i = 0; i < 3; ++i) sums.unknowns.push_back(mark + i);
    row += 3;
    normal.cost += weight * partials.residual.squaredNorm();
  }
  normal.matrix.topLeftCorner(shared, shared) += shared_shared;
  normal.cost += weight_place * state.off_mm[stop].squaredNorm();
  return true;
}

void AddTouches(const BoardNetwork& network, const BoardState& state, BoardNormal& normal) {
  const Index shared = SharedUnknowns(network);
  for (const BoardNetwork::Touch& touch : network.touches) {
    const TouchPartials partials = PartialsOf(network, state, touch);
    const Index mark = MarkIndex(shared, touch.mark);
    for (Index axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(touch.sigma_mm[axis])) continue;
      const double variance = TouchVariance(network, touch, axis);
      const VectorXd by_shared = partials.by_shared.row(axis).transpose();
      const double residual = partials.residual_mm[axis];
      normal.matrix.topLeftCorner(shared, shared) += by_shared * by_shared.transpose() / variance;
      normal.matrix.row(mark + axis).head(shared) += by_shared.transpose() / variance;
      normal.matrix(mark + axis, mark + axis) += 1 / variance;
      normal.right.head(shared) -= by_shared * (residual / variance);
      normal.right[mark + axis] -= residual / variance;
      normal.cost += residual * residual / variance;
    }
  }
}

void AddPriors(const BoardNetwork& network, const BoardState& state, BoardNormal& normal) {
  const VectorXd shared = SharedOf(network, state);
  for (Index i = kBoardScale; i < shared.size(); ++i) {
    const double sigma = PriorSigma(network, i);
    if (!(sigma > 0)) continue;  // held
    normal.matrix(i, i) += 1 / (sigma * sigma);
    normal.right[i] -= shared[i] / (sigma * sigma);
    normal.cost += std::pow(shared[i] / sigma, 2);
  }
  if (!network.place) return;
  for (Index i = 0; i < 3; ++i) {
    const double variance = std::pow(network.place->sigma_mm[i], 2);
    const double off = shared[7 + i] - network.place->at_mm[i];
    normal.matrix(7 + i, 7 + i) += 1 / variance;
    normal.right[7 + i] -= off / variance;
    normal.cost += off * off / variance;
  }
}

// Takes the stop's place out of the others' equations; lower triangle.
void Eliminate(const BoardNormal::Stop& stop, BoardNormal& normal) {
  if (stop.sights == 0) return;
  const Matrix3d inverse = stop.block.inverse();
  const MatrixXd solved = stop.coupling * inverse;
  const VectorXd right = solved * stop.right;
  const MatrixXd taken = solved * stop.coupling.transpose();
  const auto size = static_cast<Index>(stop.unknowns.size());
  for (Index c = 0; c < size; ++c) {
    const Index column = stop.unknowns[static_cast<std::size_t>(c)];
    for (Index r = 0; r < size; ++r) {
      const Index row = stop.unknowns[static_cast<std::size_t>(r)];
      if (row >= column) normal.matrix(row, column) -= taken(r, c);
    }
    normal.right[column] -= right[c];
  }
}

void Hold(const BoardNetwork& network, const HeldUnknowns& held, BoardNormal& normal) {
  const Index size = normal.matrix.rows();
  const Index shared = SharedUnknowns(network);
  for (Index i = 0; i < size; ++i) {
    const bool is_held = i < shared && held[static_cast<std::size_t>(i)];
    if (!is_held && normal.matrix(i, i) > 0) continue;
    normal.matrix.row(i).setZero();
    normal.matrix.col(i).setZero();
    normal.matrix(i, i) = 1;
    normal.right[i] = 0;
  }
}

BoardState Stepped(const BoardNetwork& network, const BoardNormal& normal, const VectorXd& step,
                   const BoardState& state) {
  BoardState next = state;
  const Index shared = SharedUnknowns(network);
  SetShared(SharedOf(network, state) + step.head(shared), next);
  for (std::size_t i = 0; i < next.marks_mm.size(); ++i) {
    next.marks_mm[i] += step.segment<3>(MarkIndex(shared, i));
  }
  for (std::size_t i = 0; i < normal.stops.size(); ++i) {
    const BoardNormal::Stop& stop = normal.stops[i];
    if (stop.sights == 0) continue;
    Vector3d right = stop.right;
    for (std::size_t k = 0; k < stop.unknowns.size(); ++k) {
      right -= stop.coupling.row(static_cast<Index>(k)).transpose() * step[stop.unknowns[k]];
    }
    next.off_mm[i] += stop.block.inverse() * right;
  }
  return next;
}

}  // namespace

BoardNormal NormalOf(const BoardNetwork& network, const BoardState& state,
                     const HeldUnknowns& held) {
  BoardNormal normal;
  const Index size = MarkIndex(SharedUnknowns(network), network.marks);
  normal.matrix.setZero(size, size);
  normal.right.setZero(size);
  normal.stops.resize(network.stops.size());
  normal.cost = 0;
  const auto by_stop = SightsByStop(network);
  for (std::size_t stop = 0; stop < by_stop.size(); ++stop) {
    if (by_stop[stop].empty()) continue;
    if (!AddStop(network, state, stop, by_stop[stop], normal)) {
      normal.cost = std::numeric_limits<double>::infinity();
      return normal;
    }
  }
  AddTouches(network, state, normal);
  AddPriors(network, state, normal);
  for (const BoardNormal::Stop& stop : normal.stops) Eliminate(stop, normal);
  normal.matrix.triangularView<Eigen::StrictlyUpper>() = normal.matrix.transpose();
  Hold(network, held, normal);
  return normal;
}

double CostOf(const BoardNetwork& network, const BoardState& state) {
  double cost = 0;
  std::vector<StopFrame> frames;
  for (std::size_t i = 0; i < network.stops.size(); ++i) {
    frames.push_back(FrameOf(network, state, i));
  }
  const double weight_place = 1 / std::pow(network.machine.repeatability_mm, 2);
  for (const BoardNetwork::Sight& sight : network.sights) {
    if (!sight.used || !network.stops[sight.view].used) continue;
    const auto residual = SightResidual(network, state, frames[sight.view], sight);
    if (!residual) return std::numeric_limits<double>::infinity();
    cost += residual->squaredNorm() / (sight.sigma_px * sight.sigma_px);
  }
  for (const Vector3d& off : state.off_mm) cost += weight_place * off.squaredNorm();
  BoardNormal others;
  const Index size = MarkIndex(SharedUnknowns(network), network.marks);
  others.matrix.setZero(size, size);
  others.right.setZero(size);
  others.cost = 0;
  AddTouches(network, state, others);
  AddPriors(network, state, others);
  return cost + others.cost;
}

BoardFit AdjustBoard(const BoardNetwork& network, const HeldUnknowns& held, int most_iterations,
                     BoardState& state) {
  constexpr double kEnoughStep = 1e-7;  // in sigmas of what is solved for
  constexpr double kStuckDamping = 1e10;
  BoardFit fit;
  BoardNormal normal = NormalOf(network, state, held);
  fit.cost = normal.cost;
  double damping = 1e-4;
  while (fit.iterations < most_iterations && std::isfinite(fit.cost)) {
    ++fit.iterations;
    const VectorXd scale = normal.matrix.diagonal().cwiseSqrt().cwiseInverse();
    const MatrixXd scaled = scale.asDiagonal() * normal.matrix * scale.asDiagonal();
    bool accepted = false;
    double decrement = 0;
    while (!accepted && damping < kStuckDamping) {
      MatrixXd damped = scaled;
      damped.diagonal().array() += damping;
      const VectorXd right = scale.cwiseProduct(normal.right);
      const VectorXd solved = geometry::SolveSymmetric(damped, right);
      decrement = solved.dot(right);
      const BoardState next = Stepped(network, normal, scale.cwiseProduct(solved), state);
      const bool possible = next.camera.focal_length_mm > 0 && solved.allFinite();
      const double cost =
          possible ? CostOf(network, next) : std::numeric_limits<double>::infinity();
      accepted = cost <= fit.cost || (decrement < kEnoughStep && std::isfinite(cost));
      if (accepted) {
        state = next;
        fit.cost = cost;
        damping = std::max(damping * 0.1, 1e-15);
      } else {
        damping = std::max(damping, 1e-12) * 10;
      }
    }
    if (!accepted) {
      fit.converged = decrement < 1e-3;
      return fit;
    }
    if (decrement < kEnoughStep) {
      fit.converged = true;
      return fit;
    }
    normal = NormalOf(network, state, held);
  }
  return fit;
}

BoardFit AdjustFirst(const HeldUnknowns& held, int most_iterations, BoardNetwork& network,
                     BoardState& state) {
  std::vector<BoardNetwork::Sight*> hidden;
  const auto sees = [&](const BoardNetwork::Sight& sight) {
    return SightResidual(network, state, FrameOf(network, state, sight.view), sight).has_value();
  };
  for (BoardNetwork::Sight& sight : network.sights) {
    if (!sight.used || !network.stops[sight.view].used || sees(sight)) continue;
    sight.used = false;
    hidden.push_back(&sight);
  }
  BoardFit fit = AdjustBoard(network, held, most_iterations, state);
  if (hidden.empty()) return fit;
  for (BoardNetwork::Sight* sight : hidden) sight->used = sees(*sight);
  return AdjustBoard(network, held, most_iterations, state);
}

namespace {

StatedCheck CheckOf(double off_mm, double variance, double of_others) {
  constexpr double kNothing = 1e-6;  // of redundancy: nothing checks it
  StatedCheck check;
  check.off_mm = off_mm;
  check.redundancy = 1 - std::min(1.0, of_others / variance);
  if (check.redundancy > kNothing) check.test = off_mm / std::sqrt(variance * check.redundancy);
  return check;
}

std::vector<StatedCheck> ChecksOf(const BoardNetwork& network, const BoardState& state,
                                  const MatrixXd& covariance) {
  std::vector<StatedCheck> checks;
  const Index shared = SharedUnknowns(network);
  for (std::size_t i = 0; i < network.touches.size(); ++i) {
    const BoardNetwork::Touch& touch = network.touches[i];
    const TouchPartials partials = PartialsOf(network, state, touch);
    for (Index axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(touch.sigma_mm[axis])) continue;
      VectorXd row = VectorXd::Zero(covariance.rows());
      row.head(shared) = partials.by_shared.row(axis).transpose();
      row[MarkIndex(shared, touch.mark) + axis] = 1;
      StatedCheck& check = checks.emplace_back(CheckOf(partials.residual_mm[axis],
                                                       TouchVariance(network, touch, axis),
                                                       row.dot(covariance * row)));
      check.touch = i;
      check.axis = axis;
    }
  }
  for (Index axis = 0; network.place && axis < 3; ++axis) {
    const double off_mm =
        state.camera.taper_from_camera.translation_mm[axis] - network.place->at_mm[axis];
    checks.push_back(CheckOf(off_mm, std::pow(network.place->sigma_mm[axis], 2),
                             covariance(7 + axis, 7 + axis)));
    checks.back().axis = axis;
  }
  return checks;
}

}  // namespace

MatrixXd InvertScaled(const MatrixXd& matrix) {
  const VectorXd scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const MatrixXd inverse =
      geometry::SolveSymmetric(scaled, MatrixXd::Identity(matrix.rows(), matrix.cols()));
  const MatrixXd whole = scale.asDiagonal() * inverse * scale.asDiagonal();
  return (whole + whole.transpose()) / 2;
}

BoardPrecision PrecisionOf(const BoardNetwork& network, const BoardState& state,
                           const HeldUnknowns& held) {
  BoardPrecision precision;
  precision.normal = NormalOf(network, state, held);
  const BoardNormal& normal = precision.normal;
  precision.covariance = InvertScaled(normal.matrix);
  const Index shared = SharedUnknowns(network);
  for (Index i = 0; i < shared; ++i) {
    if (!held[static_cast<std::size_t>(i)]) continue;
    precision.covariance.row(i).setZero();
    precision.covariance.col(i).setZero();
  }
  const double weight_place = 1 / std::pow(network.machine.repeatability_mm, 2);
  std::vector<bool> seen(network.marks, false);
  for (const BoardNetwork::Sight& sight : network.sights) {
    if (!sight.used || !network.stops[sight.view].used) continue;
    seen[sight.mark] = true;
    const auto residual = SightResidual(network, state, FrameOf(network, state, sight.view), sight);
    if (residual) {
      precision.pixel_square += residual->squaredNorm() / (sight.sigma_px * sight.sigma_px);
    }
    ++precision.sights;
  }
  // Each observation and prior has a redundancy; together they are equations less unknowns.
  double others = 0;  // redundancy of what is stated: shared priors, touches, the place
  double rows = 2.0 * precision.sights;
  double unknowns = 3.0 * static_cast<double>(std::count(seen.begin(), seen.end(), true));
  for (Index i = 0; i < shared; ++i) {
    if (held[static_cast<std::size_t>(i)]) continue;
    unknowns += 1;
    const double sigma = PriorSigma(network, i);
    if (!(sigma > 0)) continue;
    rows += 1;
    others += 1 - precision.covariance(i, i) / (sigma * sigma);
  }
  precision.off_covariance.assign(network.stops.size(), Matrix3d::Zero());
  for (std::size_t i = 0; i < normal.stops.size(); ++i) {
    const BoardNormal::Stop& stop = normal.stops[i];
    if (stop.sights == 0) continue;
    const auto size = static_cast<Index>(stop.unknowns.size());
    MatrixXd of_stop(size, size);
    for (Index r = 0; r < size; ++r) {
      for (Index c = 0; c < size; ++c) {
        of_stop(r, c) = precision.covariance(stop.unknowns[static_cast<std::size_t>(r)],
                                             stop.unknowns[static_cast<std::size_t>(c)]);
      }
    }
    const Matrix3d inverse = stop.block.inverse();
    const MatrixXd back = stop.coupling * inverse;
    const MatrixXd spread = of_stop * back;
    precision.off_covariance[i] = inverse + back.transpose().lazyProduct(spread);
    precision.place_square += weight_place * state.off_mm[i].squaredNorm();
    precision.place_redundancy += 3 - weight_place * precision.off_covariance[i].trace();
    rows += 3;
    unknowns += 3;
  }
  precision.stated = ChecksOf(network, state, precision.covariance);
  for (const StatedCheck& check : precision.stated) {
    rows += 1;
    others += check.redundancy;
  }
  precision.pixel_redundancy = rows - unknowns - others - precision.place_redundancy;
  return precision;
}

}  // namespace trammel::part_alignment
