// Models one line's readings: unknowns of the storage law, gradient and covariance.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/lag_model.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// Covariance of readings along a line: each reading's own variance, filament that moves to the
/// next reading, a flow that wanders with a correlation that falls off exponentially, and causes
/// common to the line. All takes a time that grows as the number of readings.
class LineCovariance {
 public:
  struct Terms {
    Eigen::VectorXd own;          ///< variance of each reading, > 0
    Eigen::VectorXd between;      ///< variance of what moves to the next reading; n - 1 values
    Eigen::VectorXd wander;       ///< of the wandering flow at each reading, 1 sigma
    Eigen::VectorXd correlation;  ///< of that with the next reading's, [0, 1); n - 1 values
    Eigen::MatrixXd common;       ///< of each common cause, 1 sigma; n x causes, at least one
  };
  LineCovariance() = default;
  explicit LineCovariance(const Terms& terms);

  /// @returns the inverse covariance times columns, n x any
  [[nodiscard]] Eigen::MatrixXd Solve(const Eigen::MatrixXd& columns) const;
  [[nodiscard]] double LogDeterminant() const { return log_determinant_; }
  [[nodiscard]] Eigen::VectorXd InverseDiagonal() const;

 private:
  // Of a reading and of what its flow wanders by.
  struct Pair {
    double reading = 0, flow = 0;
  };
  struct Block {
    double reading = 0, both = 0, flow = 0;  // symmetric

    [[nodiscard]] Pair Times(const Pair& pair) const;
    [[nodiscard]] double Determinant() const { return reading * flow - both * both; }
    [[nodiscard]] Block Inverse() const;
  };
  [[nodiscard]] Eigen::MatrixXd SolveWithoutCommon(const Eigen::MatrixXd& columns) const;

  std::vector<Block> inverse_pivot_;  // of a block-tridiagonal matrix (see the constructor)
  std::vector<Pair> beside_;          // diagonals of the blocks beside the diagonal
  // Of each common cause u, taken in one after the other: C⁻¹ u / (1 + u C⁻¹ u)^1/2 of those
  // before.
  Eigen::MatrixXd weighed_;
  double log_determinant_ = 0;
};

/// Unknowns of a fit: level, tilt, drift, what a swell reads too much, the power of
/// the area that is read, less one, how far along the bed's axis lines are read before their place,
/// then those of the lag.
inline constexpr int kLevel = 0, kTilt = 1, kDrift = 2, kSwell = 3, kPower = 4, kPlace = 5,
                     kOfLag = 6;
inline constexpr int kLagUnknowns = 10;
inline constexpr int kUnknowns = kOfLag + kLagUnknowns;
/// Of the lag's: its seconds, the share of the second stage.
inline constexpr int kLagSeconds = kOfLag, kSecondStage = kOfLag + 5;

using LawVector = Eigen::Matrix<double, kUnknowns, 1>;
using LawMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// The mean line's lag.
[[nodiscard]] Lag LagOf(const LawVector& theta);
/// A line's own lag in seconds.
/// @param drift  of the lag over the pattern, relative
/// @param along  of the pattern, -0.5 to 0.5
[[nodiscard]] double LagSecondsAt(double lag_s, double drift, double along);
/// The lag with one unknown moved by a step that stays in its range.
/// @param k  of the lag's unknowns, from 0
/// @param step  signed, is set
[[nodiscard]] Lag Moved(const Lag& lag, int k, double& step);
/// Brings unknowns into their ranges.
void Bound(LawVector& theta);

/// Normal distribution of what is known beforehand.
struct LawPrior {
  LawVector mean;
  LawMatrix information;  ///< inverse covariance; nothing is known of level and lag
};
[[nodiscard]] LawPrior PriorOfLaw();

/// Where a fit stands.
struct LawState {
  LawVector theta = LawVector::Zero();
  double lag_scatter_s = 0;
  double flow_scatter = 0;
  double place_scatter_mm = 0;
  double noise = 1;  ///< variance of the readings over what they state
};

/// A line's readings, and what a model makes of them. n readings each.
struct LawLine {
  double pressure_advance_s = 0;
  double along = 0;    ///< of the pattern, -0.5 to 0.5
  double heading = 1;  ///< of the print along its axis, 1 or -1
  std::vector<double> position_mm;
  Eigen::VectorXd tilt;      ///< position over the length, from the middle
  Eigen::VectorXd value;     ///< over the first guess of the level
  Eigen::VectorXd variance;  ///< of the readings, as they state it
  Eigen::VectorXd doubt;     ///< factor of that, >= 1
  double weight = 1;         ///< of the line beside others, 0 … 1

  Eigen::VectorXd read;      ///< areas over the nominal one
  Eigen::VectorXd mean;      ///< the same over the first guess of the level
  Eigen::MatrixXd gradient;  ///< n x unknowns
  Eigen::VectorXd own;       ///< over the line's own lag
  Eigen::VectorXd slope;     ///< over the place, 1/mm
  LineCovariance covariance;

  /// Readings less what a state says of them. @param laid  areas by the model
  [[nodiscard]] Eigen::VectorXd Off(const LawState& state, const std::vector<double>& laid) const;
};

/// An area as it is read, both over the nominal one. A swell may read too large or too small, and
/// the reading may grow as another power than the first.
[[nodiscard]] double ReadArea(double laid, double swell, double power);

/// @returns nothing where too few readings of a line can be used
[[nodiscard]] std::optional<LawLine> LawLineOf(const LineProfile& profile, const Interval& span_mm,
                                               double length_mm);

/// Lays all lines with the lags that unknowns give them, made longer by `more_s`.
[[nodiscard]] std::vector<std::vector<double>> LayAll(const LagModel& model, const LawVector& theta,
                                                      const std::vector<LawLine>& lines,
                                                      double more_s = 0);
/// Sets the mean and the gradient that a state gives to all lines.
/// @param model  of any lag, whose motion is the lines'
void Linearise(const LagModel& model, const LawState& state, std::vector<LawLine>& lines);
/// Sets how the readings of all lines go together about their mean.
void Weigh(const LawState& state, const LawOptions& options, std::vector<LawLine>& lines);

}  // namespace trammel::pressure_advance
