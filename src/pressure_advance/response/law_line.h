// One line's readings as a fit of the lag's law sees them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/law_options.h"
#include "pressure_advance/response/law_unknowns.h"
#include "pressure_advance/response/line_covariance.h"

namespace trammel::pressure_advance {

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
