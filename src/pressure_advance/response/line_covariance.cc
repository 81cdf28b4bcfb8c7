#include "pressure_advance/response/line_covariance.h"

#include <cmath>
#include <cstddef>

namespace trammel::pressure_advance {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

LineCovariance::Pair LineCovariance::Block::Times(const Pair& pair) const {
  return {reading * pair.reading + both * pair.flow, both * pair.reading + flow * pair.flow};
}

LineCovariance::Block LineCovariance::Block::Inverse() const {
  const double determinant = Determinant();
  return {flow / determinant, -both / determinant, reading / determinant};
}

// Of T + D W D, T tridiagonal, D diagonal, W the flow's correlation whose inverse is tridiagonal,
// the inverse is a corner of that of [T D; D -1/W]: block-tridiagonal if the readings' and the
// flow's rows alternate. The common causes follow by the matrix inversion lemma, one by one.
LineCovariance::LineCovariance(const Terms& terms) {
  const Index n = terms.own.size();
  inverse_pivot_.reserve(static_cast<std::size_t>(n));
  Block carried;
  for (Index i = 0; i < n; ++i) {
    const double before = i > 0 ? terms.correlation(i - 1) : 0;
    const double after = i + 1 < n ? terms.correlation(i) : 0;
    const double left = 1 - before * before, right = 1 - after * after;
    const double moved = (i > 0 ? terms.between(i - 1) : 0) + (i + 1 < n ? terms.between(i) : 0);
    const Block pivot{terms.own(i) + moved - carried.reading, terms.wander(i) - carried.both,
                      -1 / left - after * after / right - carried.flow};
    log_determinant_ += std::log(std::abs(pivot.Determinant())) + std::log(right);
    inverse_pivot_.push_back(pivot.Inverse());
    if (i + 1 == n) break;
    const Pair beside{-terms.between(i), after / right};
    const Block& inverse = inverse_pivot_.back();
    carried = {beside.reading * inverse.reading * beside.reading,
               beside.reading * inverse.both * beside.flow,
               beside.flow * inverse.flow * beside.flow};
    beside_.push_back(beside);
  }
  const MatrixXd solved = SolveWithoutCommon(terms.common);
  weighed_.resize(n, 0);
  for (Index cause = 0; cause < terms.common.cols(); ++cause) {
    const VectorXd common = terms.common.col(cause);
    const VectorXd weighed = solved.col(cause) - weighed_ * (weighed_.transpose() * common);
    const double more = 1 + common.dot(weighed);
    log_determinant_ += std::log(more);
    weighed_.conservativeResize(Eigen::NoChange, cause + 1);
    weighed_.col(cause) = weighed / std::sqrt(more);
  }
}

MatrixXd LineCovariance::SolveWithoutCommon(const MatrixXd& columns) const {
  const std::size_t n = inverse_pivot_.size();
  MatrixXd solved(columns.rows(), columns.cols());
  std::vector<Pair> right(n);
  for (Index column = 0; column < columns.cols(); ++column) {
    Pair before;
    for (std::size_t i = 0; i < n; ++i) {
      right[i] = {columns(static_cast<Index>(i), column), 0};
      if (i > 0) {
        right[i].reading -= beside_[i - 1].reading * before.reading;
        right[i].flow -= beside_[i - 1].flow * before.flow;
      }
      before = inverse_pivot_[i].Times(right[i]);
    }
    Pair after;
    for (std::size_t i = n; i-- > 0;) {
      if (i + 1 < n) {
        right[i].reading -= beside_[i].reading * after.reading;
        right[i].flow -= beside_[i].flow * after.flow;
      }
      after = inverse_pivot_[i].Times(right[i]);
      solved(static_cast<Index>(i), column) = after.reading;
    }
  }
  return solved;
}

MatrixXd LineCovariance::Solve(const MatrixXd& columns) const {
  return SolveWithoutCommon(columns) - weighed_ * (weighed_.transpose() * columns);
}

VectorXd LineCovariance::InverseDiagonal() const {
  const std::size_t n = inverse_pivot_.size();
  VectorXd diagonal(static_cast<Index>(n));
  Block later;
  for (std::size_t i = n; i-- > 0;) {
    Block here = inverse_pivot_[i];
    if (i + 1 < n) {
      const Block& own = inverse_pivot_[i];
      const Pair& beside = beside_[i];
      const Block next{beside.reading * later.reading * beside.reading,
                       beside.reading * later.both * beside.flow,
                       beside.flow * later.flow * beside.flow};
      const Pair reading = next.Times({own.reading, own.both});
      const Pair flow = next.Times({own.both, own.flow});
      here.reading += own.reading * reading.reading + own.both * reading.flow;
      here.both += own.both * reading.reading + own.flow * reading.flow;
      here.flow += own.both * flow.reading + own.flow * flow.flow;
    }
    later = here;
    const auto row = static_cast<Index>(i);
    diagonal(row) = here.reading - weighed_.row(row).squaredNorm();
  }
  return diagonal;
}

}  // namespace trammel::pressure_advance
