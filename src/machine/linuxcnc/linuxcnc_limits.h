// Bounds of what LinuxCNC tells and is told: where a machine can be, and in how many pieces it
// goes.
#pragma once

#include <Eigen/Core>
#include <string>

#include "base/result.h"

namespace trammel::machine {

/// No machine's axis is longer.
inline constexpr double kFarthest_mm = 1e5;

/// Least and most machine coordinates of X, Y and Z.
struct LinuxCncTravel {
  Eigen::Vector3d low_mm = Eigen::Vector3d::Constant(-kFarthest_mm);
  Eigen::Vector3d high_mm = Eigen::Vector3d::Constant(kFarthest_mm);
};

/// Reads least and most of X, of Y and of Z, as a message of LinuxCNC shows them: "######" where
/// its INI file has none. Error (kMachine): anything else, or a travel that is none.
[[nodiscard]] Result<LinuxCncTravel> ParseTravel(const std::string& shown);

/// Error (kMachine): a place that the controller tells and where its machine cannot be. An axis at
/// its limit may overshoot by a millimetre.
[[nodiscard]] Result<void> CheckToldPlace(const Eigen::Vector3d& machine_mm,
                                          const LinuxCncTravel& travel);

/// Error (kSafety): a place that is not within the travel.
[[nodiscard]] Result<void> CheckTarget(const Eigen::Vector3d& machine_mm,
                                       const LinuxCncTravel& travel);

/// Into how many pieces of equal length, none longer than `piece_mm`, a way is cut.
/// REQUIRES 0 <= way_mm <= 4 kFarthest_mm, piece_mm >= 0.01.
[[nodiscard]] int PiecesOf(double way_mm, double piece_mm);

/// The beginning of what a controller said, for messages.
[[nodiscard]] std::string Clipped(const std::string& said);

}  // namespace trammel::machine
