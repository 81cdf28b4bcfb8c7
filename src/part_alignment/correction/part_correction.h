// From where the part is to where it should be: the fixture's supports, then the work offset.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "geometry/euler.h"
#include "part_alignment/pose/measurement.h"

namespace trammel::part_alignment {

/// x_machine = R x_part + translation of a pose.
[[nodiscard]] Eigen::Vector3d MachineFromPart(const geometry::Pose& machine_from_part,
                                              const Eigen::Vector3d& part_mm);

/// A place at which the part rests on the fixture, and the one direction in which it adjusts.
struct Support {
  std::string id;
  Eigen::Vector3d part_mm = Eigen::Vector3d::Zero();             ///< where it touches the part
  Eigen::Vector3d direction_machine = Eigen::Vector3d::UnitZ();  ///< unit; positive pushes the part
};

struct SupportMove {
  std::string id;
  double shim_mm = 0;  ///< along the support's direction; negative: take away
  /// How far the ideal place of the part's point lies from where it is now, in machine axes.
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
};

/// The motion of the part that the fixture is asked for.
struct FixtureCorrection {
  /// Of the part about machine axes: ideal rotation = R(rotation_rad) · measured rotation.
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
  std::vector<SupportMove> moves;
  /// Where the part is when every support has been moved and has kept its contact.
  geometry::Pose machine_from_part;
  int rank = 0;  ///< of the six freedoms, how many the supports' directions move
};

/// @param ideal_rotation_rad  where the part's frame should point, as RotationFromAngles takes it.
/// @param ideal_translation_mm  where its origin should be. Absent: wherever the supports move
/// least
///                            on the average; the work offset takes what is left.
/// Model of the contact: each support's point of the part moves along the support's direction by
/// the shim and slides freely across it; what the supports leave free does not move (the least
/// motion that the shims ask for). Exact for any angle.
/// Errors (kInput): no supports, an id twice, a direction that is no unit vector, a number that is
/// not finite; a part that lies so far from its ideal that no motion follows the shims.
[[nodiscard]] Result<FixtureCorrection> CorrectFixture(
    const geometry::Pose& machine_from_part, const std::vector<Support>& supports,
    const Eigen::Vector3d& ideal_rotation_rad,
    const std::optional<Eigen::Vector3d>& ideal_translation_mm);

/// What a work offset of three translations and a rotation about Z can take.
struct WorkOffset {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< the part's origin in the machine
  double rotation_z_rad = 0;                            ///< in -pi … pi
};

/// A point of the part where the work offset puts it, less where it is.
struct RemainderAt {
  std::string id;
  Eigen::Vector3d error_mm = Eigen::Vector3d::Zero();  ///< machine axes
};

struct OffsetCorrection {
  WorkOffset offset;
  /// About the part's own x and y: what the offset cannot take (alpha and beta of the pose).
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
  std::vector<RemainderAt> remainder;
  double largest_remainder_mm = 0;
};

/// The offset that puts the part's origin right, and is right for every point of a part that is not
/// tilted: R_p = Rz(gamma) Ry(beta) Rx(alpha) is Rz(gamma) then.
/// @param points  where the remainder is to be stated
[[nodiscard]] OffsetCorrection CorrectWorkOffset(const geometry::Pose& machine_from_part,
                                                 const std::vector<PartTarget>& points);

/// Errors (kInput): a part that is tilted so far that an offset without rotations about X and Y
/// would be right for its origin alone: one that lies on its face, or targets that are mirrored.
[[nodiscard]] Result<void> CheckTilt(const OffsetCorrection& correction);

}  // namespace trammel::part_alignment
