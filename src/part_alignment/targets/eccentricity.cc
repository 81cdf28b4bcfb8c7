#include "part_alignment/targets/eccentricity.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

namespace {

/// Computes the ellipse of the disc's image about the image of its centre.
std::optional<DiscModel> AboutCentre(const Camera& camera, const Eigen::Vector3d& centre_mm,
                                     const Eigen::Vector3d& normal, double radius_mm) {
  constexpr int kPoints = 48;
  const double length = normal.norm();
  if (!(length > 0) || !std::isfinite(length) || !(radius_mm > 0)) return std::nullopt;
  const auto centre = Project(camera, centre_mm);
  if (!centre) return std::nullopt;
  const Eigen::Vector3d n = normal / length;
  const Eigen::Vector3d u = n.unitOrthogonal() * radius_mm;
  const Eigen::Vector3d v = n.cross(u);
  std::vector<Offset> rim;
  rim.reserve(kPoints);
  double farthest = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    const auto point = Project(camera, centre_mm + std::cos(angle) * u + std::sin(angle) * v);
    if (!point) return std::nullopt;
    const Eigen::Vector2d offset = *point - *centre;
    farthest = std::max(farthest, offset.norm());
    rim.push_back({offset.x(), offset.y()});
  }
  if (!(farthest > 0) || !std::isfinite(farthest)) return std::nullopt;
  return EllipseThrough(rim, farthest);
}

}  // namespace

std::optional<ImageEllipse> ImageOfDisc(const Camera& camera, const Eigen::Vector3d& centre_mm,
                                        const Eigen::Vector3d& normal, double radius_mm) {
  const auto model = AboutCentre(camera, centre_mm, normal, radius_mm);
  if (!model) return std::nullopt;
  ImageEllipse ellipse = EllipseOf(*model);
  const Eigen::Vector2d centre = *Project(camera, centre_mm);
  ellipse.column_px += centre.x();
  ellipse.row_px += centre.y();
  return ellipse;
}

std::optional<Eigen::Vector2d> Eccentricity(const Camera& camera, const Eigen::Vector3d& centre_mm,
                                            const Eigen::Vector3d& normal, double radius_mm) {
  const auto ellipse = AboutCentre(camera, centre_mm, normal, radius_mm);
  if (!ellipse) return std::nullopt;
  return Eigen::Vector2d(ellipse->column_px, ellipse->row_px);
}

}  // namespace trammel::part_alignment
