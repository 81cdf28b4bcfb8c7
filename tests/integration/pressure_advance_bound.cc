#include "pressure_advance_bound.h"

#include <Eigen/LU>
#include <cmath>

#include "base/square.h"

namespace trammel::test {
namespace {

// Windows and reference of docs/pressure-advance.md; 4 mm at either end are not scanned.
constexpr double kRange_s = 0.06;
constexpr double kA_mm = 10.5, kD_mm = 8.25, kReference_mm = 3.25;
constexpr double kChange_mm_s = 145;
// By how much the most slip that is drawn moves the two, in opposite directions.
constexpr double kSlipA_s = 0.0024, kSlipD_s = 0.0012;

// Variances of one line's two excesses from its flow and its level, s^2. A line's level is known
// from its reference and from the other lines' flow.
Eigen::Matrix2d FlowOf(const sim::PrinterTraits& traits) {
  const double density = 2 * traits.flow_noise_length_mm * Square(traits.flow_noise);
  const double read = density / kReference_mm;
  const double level = read * Square(traits.flow_scatter) / (read + Square(traits.flow_scatter));
  Eigen::Matrix2d flow;
  flow << density * kA_mm + level * kA_mm * kA_mm, -level * kA_mm * kD_mm, -level * kA_mm * kD_mm,
      density * kD_mm + level * kD_mm * kD_mm;
  return flow / Square(kChange_mm_s);
}

}  // namespace

double TestedPa(int line) { return kRange_s * line / (kBoundLines - 1); }

Eigen::VectorXd Expected(const Learnt& learnt, double pa_s, Eigen::MatrixXd& gradient) {
  const double below = learnt.crossing_s - pa_s;
  const int rows = below > 0 ? 2 : 1;
  Eigen::VectorXd excess(rows);
  gradient.resize(rows, 4);
  for (int row = 0; row < rows; ++row) {
    const double slip_s = row == 0 ? kSlipA_s : -kSlipD_s;
    excess(row) = learnt.slope * below - learnt.bend * std::abs(below) + slip_s * learnt.slip;
    gradient.row(row) << learnt.slope - std::copysign(learnt.bend, below), below, -std::abs(below),
        slip_s;
  }
  return excess;
}

Eigen::Matrix2d CovarianceOf(const sim::PrinterTraits& traits) {
  return Eigen::Matrix2d::Constant(Square(traits.lag_scatter_s)) + FlowOf(traits);
}

Eigen::Matrix4d KnownBeforehand() {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  information(2, 2) = 1 / Square(kBendSigma);
  information(3, 3) = 1 / Square(kSlipSigma);
  return information;
}

double BoundOf(const sim::PrinterTraits& traits) {
  const Eigen::Matrix2d covariance = CovarianceOf(traits);
  Eigen::Matrix4d information = KnownBeforehand();
  for (int i = 0; i < kBoundLines; ++i) {
    Eigen::MatrixXd gradient;
    const auto rows = Expected({traits.k_star_s}, TestedPa(i), gradient).rows();
    information += gradient.transpose() * covariance.topLeftCorner(rows, rows).inverse() * gradient;
  }
  return std::sqrt(information.inverse()(0, 0));
}

double MeanBoundOf(const sim::PrinterTraits& traits) {
  const Eigen::Matrix2d flow = FlowOf(traits);
  const double apart = flow(0, 0) + flow(1, 1) - 2 * flow(0, 1);
  return std::sqrt((Square(traits.lag_scatter_s) + flow.determinant() / apart) / kBoundLines);
}

}  // namespace trammel::test
