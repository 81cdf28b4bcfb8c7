// Correction from the measured to the ideal pose: the fixture's supports, then the work offset.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "geometry/euler.h"
#include "part_alignment/pose/measurement.h"

namespace trammel::part_alignment {

/// Computes x_machine = R x_part + translation of a pose.
[[nodiscard]] Eigen::Vector3d MachineFromPart(const geometry::Pose& machine_from_part,
                                              const Eigen::Vector3d& part_mm);

/// Support of the part on the fixture, adjustable in one direction.
struct Support {
  std::string id;
  Eigen::Vector3d part_mm = Eigen::Vector3d::Zero();             ///< contact point on the part
  Eigen::Vector3d direction_machine = Eigen::Vector3d::UnitZ();  ///< unit; positive pushes the part
};

struct SupportMove {
  std::string id;
  double shim_mm = 0;  ///< along the support's direction; negative: take away
  /// Displacement of the part's point from its present to its ideal position, in machine axes.
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
};

/// Required motion of the part on the fixture.
struct FixtureCorrection {
  /// Rotation of the part about machine axes: ideal rotation = R(rotation_rad) · measured rotation.
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
  std::vector<SupportMove> moves;
  /// Pose of the part when every support has moved without loss of contact.
  geometry::Pose machine_from_part;
  int rank = 0;  ///< number of the six degrees of freedom that the supports move
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

/// Work offset of three translations and a rotation about Z.
struct WorkOffset {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< the part's origin in the machine
  double rotation_z_rad = 0;                            ///< in -pi … pi
};

/// Error at a point of the part: position by the work offset minus actual position.
struct RemainderAt {
  std::string id;
  Eigen::Vector3d error_mm = Eigen::Vector3d::Zero();  ///< machine axes
};

struct OffsetCorrection {
  WorkOffset offset;
  /// Tilt about the part's own x and y, which the offset cannot correct (alpha and beta of the
  /// pose).
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
  std::vector<RemainderAt> remainder;
  double largest_remainder_mm = 0;
};

/// Computes the offset that corrects the part's origin. For a part without tilt it corrects every
/// point: R_p = Rz(gamma) Ry(beta) Rx(alpha) is Rz(gamma) then.
/// @param points  at which the remainder is reported
[[nodiscard]] OffsetCorrection CorrectWorkOffset(const geometry::Pose& machine_from_part,
                                                 const std::vector<PartTarget>& points);

/// Checks that an offset without rotations about X and Y suits more than the part's origin. Errors
/// (kInput): too large a tilt, as of a part on its face or of mirrored targets.
[[nodiscard]] Result<void> CheckTilt(const OffsetCorrection& correction);

}  // namespace trammel::part_alignment
