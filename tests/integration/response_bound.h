// What no method does better that does not know the law of the lag, on the worlds of
// extruder_world (docs/pressure-advance.md).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "extruder_world.h"

namespace trammel::test {

/// What has to be learnt of the same lines beside the mean line's lag.
enum class Nuisance { kExponent, kSecondStage, kSlip, kDrift, kLostGaps };
inline constexpr int kNuisances = 5;

[[nodiscard]] const char* ToString(Nuisance nuisance);

/// Readings that are looked at: up to 65 % of the fast stretch, from there on, or all.
enum class Part { kWhole, kAcceleration, kDeceleration };

/// A melt that stores in two ways: of a power of the flow, and with a second stage behind it.
struct LawPoint {
  double k_star_s = 0.036;
  double exponent = 1;
  double second_share = 0;
  double slip = 0;
  double drift = 0;
  double lost_gaps = 0;  ///< share of the filament that gaps lose

  [[nodiscard]] ExtruderWorld In(ExtruderWorld world) const;
};

/// Lines as a Gaussian sees them, at one point: what each reads on average, how that changes, and
/// how it scatters.
struct LineModel {
  Eigen::VectorXd mean;
  Eigen::MatrixXd gradient;  ///< over level, lag and nuisances, in this order
  Eigen::MatrixXd root;      ///< lower Cholesky factor of the covariance
};

struct PatternModel {
  std::vector<LineModel> lines;
  Eigen::VectorXd truth_gradient;  ///< of the pressure advance that is right, over the same
  double truth_s = 0;
};

[[nodiscard]] PatternModel ModelOf(const ExtruderWorld& world, const LawPoint& law, Part part);

/// Information on the unknowns beforehand: none on level and lag, on a nuisance that of a normal
/// distribution as wide as half the range of laws, or endlessly much where it is not `learnt`.
[[nodiscard]] Eigen::MatrixXd PriorOf(const std::vector<Nuisance>& learnt);

/// The least rms error, s.
[[nodiscard]] double BoundOf(const PatternModel& model, const std::vector<Nuisance>& learnt);

/// How far two laws stand apart for the best test that knows neither the lag nor the other
/// nuisances: in standard deviations.
/// @param from  the model that is tested for
[[nodiscard]] double ApartOf(const PatternModel& from, const PatternModel& to,
                             const std::vector<Nuisance>& learnt);

}  // namespace trammel::test
