// Models one line's readings: unknowns of the storage model, gradient and covariance.
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
/// next reading, a wandering flow with exponentially decaying correlation, and causes common to the
/// line. Every operation takes time linear in the number of readings.
class LineCovariance {
 public:
  struct Terms {
    Eigen::VectorXd own;          ///< variance of each reading, > 0
    Eigen::VectorXd between;      ///< variance of what moves to the next reading; n - 1 values
    Eigen::VectorXd wander;       ///< flow noise at each reading, 1 sigma
    Eigen::VectorXd correlation;  ///< of that with the next reading, [0, 1); n - 1 values
    Eigen::MatrixXd common;       ///< per common cause, 1 sigma; n x causes, at least one
  };
  LineCovariance() = default;
  explicit LineCovariance(const Terms& terms);

  /// @returns the inverse covariance times columns, n x any
  [[nodiscard]] Eigen::MatrixXd Solve(const Eigen::MatrixXd& columns) const;
  [[nodiscard]] double LogDeterminant() const { return log_determinant_; }
  [[nodiscard]] Eigen::VectorXd InverseDiagonal() const;

 private:
  // Terms of a reading and of its flow's variation.
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

  std::vector<Block> inverse_pivot_;  // of the block-tridiagonal matrix (see the constructor)
  std::vector<Pair> beside_;          // diagonals of the blocks beside the diagonal
  // Column for each common cause u, added one after the other: C⁻¹ u / (1 + u C⁻¹ u)^1/2 of those
  // before.
  Eigen::MatrixXd weighed_;
  double log_determinant_ = 0;
};

/// Unknowns of a fit: level, tilt, drift, excess reading of a swell, the exponent of the area's
/// reading minus one, the shift of readings along the bed's axis, then those of the lag.
inline constexpr int kLevel = 0, kTilt = 1, kDrift = 2, kSwell = 3, kPower = 4, kPlace = 5,
                     kOfLag = 6;
inline constexpr int kLagUnknowns = 10;
inline constexpr int kUnknowns = kOfLag + kLagUnknowns;
/// Indices of the lag's: its seconds, the share of the second stage.
inline constexpr int kLagSeconds = kOfLag, kSecondStage = kOfLag + 5;

using StorageVector = Eigen::Matrix<double, kUnknowns, 1>;
using StorageMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// Returns the mean line's lag.
[[nodiscard]] Lag LagOf(const StorageVector& theta);
/// Returns a line's own lag in seconds.
/// @param drift  of the lag over the pattern, relative
/// @param along  of the pattern, -0.5 to 0.5
[[nodiscard]] double LagSecondsAt(double lag_s, double drift, double along);
/// Returns the lag with one unknown moved by a step within its range.
/// @param k  of the lag's unknowns, from 0
/// @param step  signed, output
[[nodiscard]] Lag Moved(const Lag& lag, int k, double& step);
/// Clamps unknowns to their ranges.
void Bound(StorageVector& theta);

/// Normal prior distribution.
struct StoragePrior {
  StorageVector mean;
  StorageMatrix information;  ///< inverse covariance; nothing is known of level and lag
};
[[nodiscard]] StoragePrior StoragePriorOf();

/// State of a fit.
struct StorageState {
  StorageVector theta = StorageVector::Zero();
  double lag_scatter_s = 0;
  double flow_scatter = 0;
  double place_scatter_mm = 0;
  double noise = 1;  ///< variance of the readings over what they state
};

/// Readings of a line, and a model's prediction. n readings each.
struct StorageLine {
  double pressure_advance_s = 0;
  double along = 0;    ///< position in the pattern, -0.5 to 0.5
  double heading = 1;  ///< print direction along its axis, 1 or -1
  std::vector<double> position_mm;
  Eigen::VectorXd tilt;      ///< position over the length, from the middle
  Eigen::VectorXd value;     ///< over the first guess of the level
  Eigen::VectorXd variance;  ///< per reading, as stated
  Eigen::VectorXd doubt;     ///< factor of that, >= 1
  double weight = 1;         ///< relative to other lines, 0 … 1

  Eigen::VectorXd read;      ///< areas over the nominal one
  Eigen::VectorXd mean;      ///< the same over the first guess of the level
  Eigen::MatrixXd gradient;  ///< n x unknowns
  Eigen::VectorXd own;       ///< over the line's own lag
  Eigen::VectorXd slope;     ///< over the place, 1/mm
  LineCovariance covariance;

  /// Returns readings minus a state's prediction. @param laid  areas by the model
  [[nodiscard]] Eigen::VectorXd Off(const StorageState& state,
                                    const std::vector<double>& laid) const;
};

/// Returns the reading of an area, both relative to the nominal one. A swell may read too large or
/// too small, and the reading may have an exponent other than one.
[[nodiscard]] double ReadArea(double laid, double swell, double power);

/// @returns nothing where too few readings of a line can be used
[[nodiscard]] std::optional<StorageLine> StorageLineOf(const LineProfile& profile,
                                                       const Interval& span_mm, double length_mm);

/// Lays all lines with the lags of the unknowns, lengthened by `more_s`.
[[nodiscard]] std::vector<std::vector<double>> LayAll(const LagModel& model,
                                                      const StorageVector& theta,
                                                      const std::vector<StorageLine>& lines,
                                                      double more_s = 0);
/// Sets the mean and the gradient of all lines for a state.
/// @param model  of any lag, with the lines' motion
void Linearise(const LagModel& model, const StorageState& state, std::vector<StorageLine>& lines);
/// Sets the covariance of all lines' readings about their mean.
void Weigh(const StorageState& state, const StorageOptions& options,
           std::vector<StorageLine>& lines);

}  // namespace trammel::pressure_advance
