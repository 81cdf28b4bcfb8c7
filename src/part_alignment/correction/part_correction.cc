#include "part_alignment/correction/part_correction.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Pose;

constexpr double kUnitTolerance = 1e-6;
constexpr double kFollowed_mm = 1e-3;
// Tolerance of singular values relative to the largest, lengths scaled by the supports' spread:
// directions that a workshop calls parallel.
constexpr double kRankTolerance = 1e-6;

Result<void> Check(const Pose& pose, const std::vector<Support>& supports,
                   const Vector3d& ideal_rotation_rad,
                   const std::optional<Vector3d>& ideal_translation_mm) {
  if (!pose.translation_mm.allFinite() || !pose.angles_rad.allFinite() ||
      !ideal_rotation_rad.allFinite() ||
      (ideal_translation_mm && !ideal_translation_mm->allFinite())) {
    return Fail("the part's pose, measured or ideal, has a number that is not finite");
  }
  if (supports.empty()) return Fail("there is no support: name the points that adjust the part");
  std::set<std::string> ids;
  for (const Support& support : supports) {
    if (!ids.insert(support.id).second) {
      return Fail(fmt::format("support {} is given twice", support.id));
    }
    if (!support.part_mm.allFinite()) {
      return Fail(fmt::format("support {}: its place is not finite", support.id));
    }
    const double length = support.direction_machine.norm();
    if (!(std::abs(length - 1) <= kUnitTolerance)) {
      return Fail(fmt::format("support {}: its direction has the length {:.6g}; it must be 1",
                              support.id, length));
    }
  }
  return {};
}

// Computes the ideal place of the part's origin that moves the supports least on average.
Vector3d LeastTranslation(const Pose& measured, const Matrix3d& ideal,
                          const std::vector<Support>& supports) {
  Vector3d sum = Vector3d::Zero();
  for (const Support& support : supports) {
    sum += MachineFromPart(measured, support.part_mm) - ideal * support.part_mm;
  }
  return sum / static_cast<double>(supports.size());
}

// Response of supports to a small motion of the part about `centre`: shim = n · (t + w × arm).
struct SupportRows {
  Eigen::MatrixXd rows;  // one a support; columns t, then w · scale_mm
  double scale_mm = 1;
};

SupportRows RowsOf(const std::vector<Support>& supports, const std::vector<Vector3d>& places,
                   const Vector3d& centre) {
  SupportRows result;
  for (const Vector3d& place : places) {
    result.scale_mm = std::max(result.scale_mm, (place - centre).norm());
  }
  result.rows.resize(static_cast<Eigen::Index>(supports.size()), 6);
  for (std::size_t i = 0; i < supports.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Vector3d& n = supports[i].direction_machine;
    result.rows.block<1, 3>(row, 0) = n.transpose();
    result.rows.block<1, 3>(row, 3) = (places[i] - centre).cross(n).transpose() / result.scale_mm;
  }
  return result;
}

// Moves the part until every support's point has moved by its shim along the support's direction.
Result<void> ApplyShims(const std::vector<Support>& supports, FixtureCorrection& correction) {
  constexpr int kMaxSteps = 50;
  constexpr double kSettled_mm = 1e-10;
  std::vector<Vector3d> before;
  for (const Support& support : supports) {
    before.push_back(MachineFromPart(correction.machine_from_part, support.part_mm));
  }
  Matrix3d rotation = geometry::RotationFromAngles(correction.machine_from_part.angles_rad);
  Vector3d translation_mm = correction.machine_from_part.translation_mm;
  Eigen::VectorXd missing_mm(static_cast<Eigen::Index>(supports.size()));
  for (int step = 0; step < kMaxSteps; ++step) {
    std::vector<Vector3d> places;
    Vector3d centre = Vector3d::Zero();
    for (const Support& support : supports) {
      places.push_back(rotation * support.part_mm + translation_mm);
      centre += places.back() / static_cast<double>(supports.size());
    }
    for (std::size_t i = 0; i < supports.size(); ++i) {
      missing_mm(static_cast<Eigen::Index>(i)) =
          correction.moves[i].shim_mm - supports[i].direction_machine.dot(places[i] - before[i]);
    }
    const SupportRows linear = RowsOf(supports, places, centre);
    const geometry::SingularValues of = geometry::DecomposeSingular(linear.rows);
    const auto rank = (of.values.array() > kRankTolerance * of.values[0]).count();
    correction.rank = static_cast<int>(rank);
    const Eigen::VectorXd along =
        (of.u.leftCols(rank).transpose() * missing_mm).cwiseQuotient(of.values.head(rank));
    const Eigen::VectorXd motion = of.v.leftCols(rank) * along;
    const Matrix3d turn = geometry::RotationFromVector(motion.tail<3>() / linear.scale_mm);
    translation_mm = turn * (translation_mm - centre) + centre + motion.head<3>();
    rotation = turn * rotation;
    if (motion.norm() < kSettled_mm) break;
  }
  if (missing_mm.cwiseAbs().maxCoeff() > kFollowed_mm) {
    return Fail(fmt::format(
        "no motion of the part follows the shims, {:.4f} mm is left at a support: the part is "
        "turned "
        "too far from its ideal ({:.1f} degrees) to be shimmed; set it down anew",
        missing_mm.cwiseAbs().maxCoeff(), correction.rotation_rad.norm() * 180 / std::numbers::pi));
  }
  correction.machine_from_part = {translation_mm, geometry::AnglesFromRotation(rotation)};
  return {};
}

}  // namespace

Vector3d MachineFromPart(const Pose& machine_from_part, const Vector3d& part_mm) {
  return geometry::RotationFromAngles(machine_from_part.angles_rad) * part_mm +
         machine_from_part.translation_mm;
}

Result<FixtureCorrection> CorrectFixture(const Pose& machine_from_part,
                                         const std::vector<Support>& supports,
                                         const Vector3d& ideal_rotation_rad,
                                         const std::optional<Vector3d>& ideal_translation_mm) {
  TRY(Check(machine_from_part, supports, ideal_rotation_rad, ideal_translation_mm));
  const Matrix3d ideal = geometry::RotationFromAngles(ideal_rotation_rad);
  const Matrix3d measured = geometry::RotationFromAngles(machine_from_part.angles_rad);
  const Vector3d origin_mm = ideal_translation_mm
                                 ? *ideal_translation_mm
                                 : LeastTranslation(machine_from_part, ideal, supports);
  FixtureCorrection correction;
  correction.rotation_rad = geometry::AnglesFromRotation(ideal * measured.transpose());
  correction.machine_from_part = machine_from_part;
  for (const Support& support : supports) {
    const Vector3d displacement_mm =
        ideal * support.part_mm + origin_mm - MachineFromPart(machine_from_part, support.part_mm);
    correction.moves.push_back(
        {support.id, support.direction_machine.dot(displacement_mm), displacement_mm});
  }
  TRY(ApplyShims(supports, correction));
  return correction;
}

OffsetCorrection CorrectWorkOffset(const Pose& machine_from_part,
                                   const std::vector<PartTarget>& points) {
  OffsetCorrection correction;
  const Vector3d& angles_rad = machine_from_part.angles_rad;
  correction.offset = {machine_from_part.translation_mm, angles_rad.z()};
  correction.tilt_rad = angles_rad.head<2>();
  const Matrix3d taken = geometry::RotationFromAngles({0, 0, angles_rad.z()});
  for (const PartTarget& point : points) {
    const Vector3d error_mm = taken * point.ideal_mm + correction.offset.origin_mm -
                              MachineFromPart(machine_from_part, point.ideal_mm);
    correction.largest_remainder_mm = std::max(correction.largest_remainder_mm, error_mm.norm());
    correction.remainder.push_back({point.id, error_mm});
  }
  return correction;
}

Result<void> CheckTilt(const OffsetCorrection& correction) {
  const double alpha_rad = correction.tilt_rad.x();
  const double beta_rad = correction.tilt_rad.y();
  const double tilt_rad =
      std::acos(std::clamp(std::cos(alpha_rad) * std::cos(beta_rad), -1.0, 1.0));
  constexpr double kMax_rad = 0.1;  // beyond any shim
  if (tilt_rad <= kMax_rad) return {};
  return Fail(
      fmt::format(
          "the part's Z leans by {:.1f} degrees from the machine's (alpha {:.1f}, beta "
          "{:.1f} mm/m): an offset with a rotation about Z alone would put its points up to "
          "{:.1f} mm wrong, and at most {:.0f} mm/m are taken: is it the part of these "
          "targets, the right side up, and are their coordinates not mirrored? --tilts is "
          "for controls that turn about X and Y",
          tilt_rad * 180 / std::numbers::pi, 1000 * alpha_rad, 1000 * beta_rad,
          correction.largest_remainder_mm, 1000 * kMax_rad),
      ErrorKind::kInput);
}

}  // namespace trammel::part_alignment
