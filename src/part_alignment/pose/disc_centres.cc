#include "part_alignment/pose/disc_centres.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/check.h"
#include "base/statistics.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/targets/eccentricity.h"

namespace trammel::part_alignment {
namespace {

/// Observation with the disc that the first solution predicts.
struct DiscObservation {
  Observation* observation = nullptr;
  ImageEllipse seen;
  std::optional<ImageEllipse> expected;  ///< image of a disc with radius 1 mm
  Eigen::Vector3d centre_mm;             ///< camera frame
  Eigen::Vector3d normal;
};

std::vector<DiscObservation> DiscObservations(const Alignment& alignment, const TargetDisc& disc,
                                              const SeenDiscs& seen, Measurement& measurement) {
  const Camera camera = SolvedCamera(measurement, alignment);
  std::vector<DiscObservation> observations;
  for (std::size_t i = 0; i < measurement.views.size(); ++i) {
    View& view = measurement.views[i];
    for (std::size_t k = 0; k < view.observations.size(); ++k) {
      const PartTarget* target = FindTarget(measurement, view.observations[k].target);
      if (target == nullptr) continue;  // Solve has refused it
      const auto in_camera = [&](const Eigen::Vector3d& part_mm) {
        return CameraFromPart(camera, alignment.clamping, view, alignment.machine_from_part,
                              part_mm);
      };
      const Eigen::Vector3d centre_mm = in_camera(target->ideal_mm);
      const Eigen::Vector3d normal =
          in_camera(target->ideal_mm + disc.normal.normalized()) - centre_mm;
      observations.push_back({&view.observations[k], seen[i][k],
                              ImageOfDisc(camera, centre_mm, normal, 1.0), centre_mm, normal});
    }
  }
  return observations;
}

double MeanRadius(const ImageEllipse& ellipse) {
  return std::sqrt(ellipse.semi_major_px * ellipse.semi_minor_px);
}

// Returns the shape, of area 1; near a circle its eigenvalues differ by the axes' ratio less 1.
Eigen::Matrix2d Shape(const ImageEllipse& ellipse) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(ellipse.angle_rad).toRotationMatrix();
  const double stretch = std::sqrt(ellipse.semi_major_px / ellipse.semi_minor_px);
  return turn * Eigen::Vector2d(stretch, 1 / stretch).asDiagonal() * turn.transpose();
}

/// Computes the median error of the axes' ratios; 1 if no rim is visible.
double ShapeError(const std::vector<DiscObservation>& observations) {
  std::vector<double> errors;
  for (const DiscObservation& one : observations) {
    errors.push_back(one.expected ? std::sqrt(2.0) * (Shape(one.seen) - Shape(*one.expected)).norm()
                                  : 1.0);
  }
  return Median(errors);
}

double LooksLike_mm(const std::vector<DiscObservation>& observations) {
  std::vector<double> radii_mm;
  for (const DiscObservation& one : observations) {
    if (one.expected) radii_mm.push_back(MeanRadius(one.seen) / MeanRadius(*one.expected));
  }
  return Median(radii_mm);
}

/// Explains why the discs contradict their description; empty if they do not.
std::string Contradiction(const std::vector<DiscObservation>& observations,
                          const TargetDisc& disc) {
  constexpr double kMaxShapeError = 0.02;  // 1 - cos(11 degrees)
  constexpr double kMaxRadiusError = 0.1;  // a fifth of the correction
  const double shape_error = ShapeError(observations);
  if (shape_error > kMaxShapeError) {
    return fmt::format(
        "the discs do not look as discs with the normal ({:.3g}, {:.3g}, {:.3g}) would (their axes "
        "differ by {:.0f} %): state the targets' normal in the part's frame, or leave the centres "
        "uncorrected",
        disc.normal.x(), disc.normal.y(), disc.normal.z(), 100 * shape_error);
  }
  const double seen_mm = LooksLike_mm(observations);
  if (disc.radius_mm > 0 && std::abs(seen_mm - disc.radius_mm) > kMaxRadiusError * seen_mm) {
    return fmt::format(
        "the discs look as if their radius were {:.2f} mm, {:.2f} is stated: state the true one or "
        "none, or check the camera's focal length and the targets' coordinates",
        seen_mm, disc.radius_mm);
  }
  return {};
}

/// Returns the number of observations that could not be corrected.
std::size_t Correct(const Camera& camera, double radius_mm,
                    std::vector<DiscObservation>& observations) {
  std::size_t uncorrected = 0;
  for (DiscObservation& one : observations) {
    const auto off = Eccentricity(camera, one.centre_mm, one.normal, radius_mm);
    if (!off) {
      ++uncorrected;
      continue;
    }
    one.observation->column_px -= off->x();
    one.observation->row_px -= off->y();
  }
  return uncorrected;
}

Result<void> Check(const TargetDisc& disc) {
  constexpr double kMin = 1e-6;
  if (!(disc.normal.norm() >= kMin) || !disc.normal.allFinite()) {
    return Fail(fmt::format("the targets' normal ({}, {}, {}) is no direction", disc.normal.x(),
                            disc.normal.y(), disc.normal.z()));
  }
  if (!(disc.radius_mm >= 0) || !std::isfinite(disc.radius_mm)) {
    return Fail(fmt::format("the discs' radius is {} mm, it must be 0 or more", disc.radius_mm));
  }
  return {};
}

}  // namespace

Result<Alignment> SolveByDiscs(const SolveOptions& options, const TargetDisc& disc,
                               const SeenDiscs& seen, Measurement& measurement) {
  TRY(Check(disc));
  TRAMMEL_CHECK(seen.size() == measurement.views.size(), "{} of {}", seen.size(),
                measurement.views.size());
  auto first = Solve(measurement, options);
  if (!first || first->verdict != Verdict::kGood) return first;
  std::vector<DiscObservation> observations = DiscObservations(*first, disc, seen, measurement);
  if (std::string reason = Contradiction(observations, disc); !reason.empty()) {
    first->verdict = Verdict::kRefused;
    first->reason = std::move(reason);
    return first;
  }
  const double radius_mm = disc.radius_mm > 0 ? disc.radius_mm : LooksLike_mm(observations);
  const std::size_t uncorrected =
      Correct(SolvedCamera(measurement, *first), radius_mm, observations);
  auto second = Solve(measurement, options);
  if (second && uncorrected > 0) {
    second->notices.push_back(fmt::format(
        "{} of {} centres could not be corrected for perspective: their discs' rims cannot be seen "
        "whole by this answer",
        uncorrected, observations.size()));
  }
  return second;
}

}  // namespace trammel::part_alignment
