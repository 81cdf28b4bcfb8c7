#include "tool_offset/reading/photo_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace trammel::tool_offset {
namespace {

constexpr double kFilmDiagonal_mm = 43.27;

/// Axes of the sheet and its middle as a camera of this focal length sees them, in one scale.
struct Columns {
  Eigen::Vector3d u;
  Eigen::Vector3d v;
  Eigen::Vector3d middle;
};

Columns ColumnsOf(const PageMap& map, PagePoint centre, double focal_px) {
  const PagePoint middle = map.middle - centre;
  const auto column = [&](PagePoint along, double lean) {
    const PagePoint at = along + lean * middle;
    return Eigen::Vector3d(at.x_px / focal_px, at.y_px / focal_px, lean);
  };
  return {column(map.u_px_mm, map.lean_per_mm.u_mm),
          column(map.v_px_mm, map.lean_per_mm.v_mm),
          {middle.x_px / focal_px, middle.y_px / focal_px, 1}};
}

/// By how much the axes differ in length, and from a right angle, squared.
double Misfit(const PageMap& map, PagePoint centre, double focal_px) {
  const Columns columns = ColumnsOf(map, centre, focal_px);
  const double length = std::log(columns.u.norm() / columns.v.norm());
  const double angle = columns.u.normalized().dot(columns.v.normalized());
  return length * length + angle * angle;
}

/// Fills in the focal length, as stated or from the map.
void FindFocalLength(const PageMap& map, const PhotoSource& source, PhotoPose& pose) {
  constexpr double kStated = 0.03;      // EXIF has whole mm, of nominal lenses
  constexpr double kUsual_mm = 36;      // 26 ("1x") … 50 ("2x")
  constexpr double kUsualSpread = 0.4;  // of its logarithm
  constexpr double kAxes = 0.004;       // how unlike the scales of a printer's two axes are
  constexpr double kStep = 0.01;
  if (source.film_focal_mm) {
    pose.focal_px = *source.film_focal_mm / kFilmDiagonal_mm * 2 * pose.corner_px;
    pose.focal_uncertainty = kStated;
    pose.focal_stated = true;
    return;
  }
  // Weights of all focal lengths that there may be.
  double sum = 0;
  double moment = 0;
  double square = 0;
  for (double deviation = -4 * kUsualSpread; deviation <= 4 * kUsualSpread; deviation += kStep) {
    const double focal_px = kUsual_mm * std::exp(deviation) / kFilmDiagonal_mm * 2 * pose.corner_px;
    const double weight = std::exp(-0.5 * (Misfit(map, pose.centre, focal_px) / (kAxes * kAxes) +
                                           deviation * deviation / (kUsualSpread * kUsualSpread)));
    sum += weight;
    moment += weight * deviation;
    square += weight * deviation * deviation;
  }
  const bool any = sum > 0;
  const double mean = any ? moment / sum : 0;
  pose.focal_px = kUsual_mm * std::exp(mean) / kFilmDiagonal_mm * 2 * pose.corner_px;
  pose.focal_uncertainty =
      any ? std::max(kStated, std::sqrt(std::max(0.0, square / sum - mean * mean))) : kUsualSpread;
}

/// What is known of the lens's axis, and what cropping does to the focal length that the file
/// states.
void JudgeSize(const PageView& page, PhotoPose& pose) {
  constexpr double kLens = 0.005;    // of the way to the corner: 20 px of 2520, evenly
  constexpr double kCropped = 0.25;  // half a side away is 0.4
  constexpr double kCroppedFocal = 0.4;
  pose.as_stored = IsStoredSize(page.width, page.height);
  pose.centre_uncertainty_px = (pose.as_stored ? kLens : kCropped) * pose.corner_px;
  if (!pose.as_stored && pose.focal_stated) {
    pose.focal_uncertainty = std::max(pose.focal_uncertainty, kCroppedFocal);
  }
}

}  // namespace

bool IsStoredSize(int width_px, int height_px) {
  constexpr int kBlock_px = 4;
  constexpr double kSame = 0.01;
  if (width_px % kBlock_px != 0 || height_px % kBlock_px != 0) return false;
  const double ratio = static_cast<double>(std::max(width_px, height_px)) /
                       std::max(1, std::min(width_px, height_px));
  const std::array<double, 4> ratios{1, 4.0 / 3, 3.0 / 2, 16.0 / 9};
  return std::any_of(ratios.begin(), ratios.end(),
                     [&](double stored) { return std::abs(ratio / stored - 1) < kSame; });
}

PhotoPose FindPose(const PageView& page, const PageMap& map, const PhotoSource& source) {
  PhotoPose pose;
  pose.centre = {(page.width - 1) / 2.0, (page.height - 1) / 2.0};
  pose.corner_px = std::hypot(page.width, page.height) / 2;
  FindFocalLength(map, source, pose);
  JudgeSize(page, pose);
  const Columns columns = ColumnsOf(map, pose.centre, pose.focal_px);
  const double scale = 1 / std::sqrt(columns.u.norm() * columns.v.norm());
  const Eigen::Vector3d u = columns.u.normalized();
  // The nearest right angle in the plane of both.
  const Eigen::Vector3d normal = u.cross(columns.v).normalized();
  const Eigen::Vector3d v = normal.cross(u);
  const Eigen::Vector3d middle = scale * columns.middle;
  pose.foot = {-u.dot(middle), -v.dot(middle)};
  pose.height_mm = std::abs(normal.dot(middle));
  pose.tilt_rad = std::acos(std::clamp(std::abs(normal.z()), 0.0, 1.0));
  const double along = normal.dot(middle) / normal.z();
  const Eigen::Vector3d aim = along * Eigen::Vector3d::UnitZ() - middle;
  pose.aim = {u.dot(aim), v.dot(aim)};
  return pose;
}

RadialLever LeverAt(const PhotoPose& pose, const PageMap& map, Axis axis, SheetPoint point) {
  constexpr double kStep_mm = 20;
  const bool is_x = axis == Axis::kX;
  const auto colour = [&](SheetPoint at) {
    const LocalMap local = map.Near(at);
    const PagePoint out = (1 / pose.corner_px) * (local.at - pose.centre);
    const PagePoint u = local.u_px_mm;
    const PagePoint v = local.v_px_mm;
    const double determinant = u.x_px * v.y_px - u.y_px * v.x_px;
    return is_x ? (out.x_px * v.y_px - out.y_px * v.x_px) / determinant
                : (u.x_px * out.y_px - u.y_px * out.x_px) / determinant;
  };
  const auto aside = [&](double mm) {
    return is_x ? SheetPoint{point.u_mm + mm, point.v_mm} : SheetPoint{point.u_mm, point.v_mm + mm};
  };
  RadialLever lever;
  lever.height =
      (is_x ? point.u_mm - pose.foot.u_mm : point.v_mm - pose.foot.v_mm) / pose.height_mm;
  lever.height_per_mm = 1 / pose.height_mm;
  lever.colour_mm_px = colour(point);
  lever.colour_per_px = (colour(aside(kStep_mm)) - colour(aside(-kStep_mm))) / (2 * kStep_mm);
  return lever;
}

}  // namespace trammel::tool_offset
