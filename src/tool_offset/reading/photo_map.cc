#include "tool_offset/reading/photo_map.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "tool_offset/reading/leg_reader.h"

namespace trammel::tool_offset {
namespace {

constexpr double kFilmDiagonal_mm = 43.27;

/// Axes of the sheet and its middle for a camera of this focal length, in one scale.
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

/// Returns the squared difference of the axes' lengths, and of their angle from a right one.
double Misfit(const PageMap& map, PagePoint centre, double focal_px) {
  const Columns columns = ColumnsOf(map, centre, focal_px);
  const double length = std::log(columns.u.norm() / columns.v.norm());
  const double angle = columns.u.normalized().dot(columns.v.normalized());
  return length * length + angle * angle;
}

/// Sets the focal length, as stated or from the map.
void FindFocalLength(const PageMap& map, const PhotoSource& source, PhotoPose& pose) {
  constexpr double kStated = 0.03;      // EXIF has whole mm, of nominal lenses
  constexpr double kUsual_mm = 36;      // 26 ("1x") … 50 ("2x")
  constexpr double kUsualSpread = 0.4;  // sigma of its logarithm
  constexpr double kAxes = 0.004;       // scale difference of a printer's two axes
  constexpr double kStep = 0.01;
  if (source.film_focal_mm) {
    pose.focal_px = *source.film_focal_mm / kFilmDiagonal_mm * 2 * pose.corner_px;
    pose.focal_uncertainty = kStated;
    pose.focal_stated = true;
    return;
  }
  // Weights of all possible focal lengths.
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

/// Sets the uncertainty of the lens's axis, and of a stated focal length after cropping.
void JudgeSize(const PageView& page, PhotoPose& pose) {
  constexpr double kLens = 0.005;    // of the centre-corner distance: 20 px of 2520, uniform
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
  // Nearest right angle in the plane of both.
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
  const auto colour = [&](SheetPoint at) {
    const LocalMap local = map.Near(at);
    return Along(axis, local.ToSheet((1 / pose.corner_px) * (local.at - pose.centre)));
  };
  const auto aside = [&](double mm) { return point + PointAt(axis, mm, 0); };
  RadialLever lever;
  lever.height = (Along(axis, point) - Along(axis, pose.foot)) / pose.height_mm;
  lever.height_per_mm = 1 / pose.height_mm;
  lever.colour_mm_px = colour(point);
  lever.colour_per_px = (colour(aside(kStep_mm)) - colour(aside(-kStep_mm))) / (2 * kStep_mm);
  return lever;
}

namespace {

/// Observed feature of the plan: it determines the position across its own line.
struct LandmarkObservation {
  SheetPoint planned;
  Axis axis = Axis::kX;  ///< measured axis
  PagePoint seen;
};

constexpr Eigen::Index kUnknowns = 13;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

/// Returns steps that move the box's corners by about 0.01 to 0.1 mm.
Unknowns StepsOf(const PageMap& map) {
  const double px_mm = Length(map.u_px_mm);
  const double reach_mm = std::hypot(map.half_width_mm, map.half_height_mm);
  Unknowns step;
  step << Unknowns::Constant(0.02 * px_mm);
  step.segment<4>(2).setConstant(0.02 * px_mm / reach_mm);
  step.segment<2>(6).setConstant(0.02 / (reach_mm * reach_mm));
  step[8] = 2e-3;
  step[9] = 1e-2;
  step.segment<3>(10).setConstant(0.05);
  return step;
}

/// Returns the unknowns' priors without the photo, 1 sigma in steps; 0: none.
Unknowns PriorsOf(const Unknowns& step) {
  constexpr double kRadial = 0.1;
  constexpr double kRadial4 = 0.3;
  constexpr double kBow_mm = 2;
  Unknowns prior = Unknowns::Zero();
  prior[8] = kRadial / step[8];
  prior[9] = kRadial4 / step[9];
  prior.segment<3>(10) = kBow_mm * step.segment<3>(10).cwiseInverse();
  return prior;
}

PageMap Moved(const PageMap& map, const Unknowns& by) {
  PageMap moved = map;
  moved.middle = map.middle + PagePoint{by[0], by[1]};
  moved.u_px_mm = map.u_px_mm + PagePoint{by[2], by[3]};
  moved.v_px_mm = map.v_px_mm + PagePoint{by[4], by[5]};
  moved.lean_per_mm.u_mm += by[6];
  moved.lean_per_mm.v_mm += by[7];
  moved.camera->radial[0] += by[8];
  moved.camera->radial[1] += by[9];
  for (std::size_t i = 0; i < 3; ++i) {
    moved.camera->bow_mm[i] += by[10 + static_cast<Eigen::Index>(i)];
  }
  return moved;
}

/// Returns an observation's distance from its position by the map, across its line; mm.
double Beyond_mm(const PageMap& map, const LandmarkObservation& sighting) {
  const LocalMap local = map.Near(sighting.planned);
  return Along(sighting.axis, local.ToSheet(sighting.seen - local.at));
}

Eigen::VectorXd Residuals(const PageMap& map, const std::vector<LandmarkObservation>& sightings) {
  Eigen::VectorXd residual(static_cast<Eigen::Index>(sightings.size()));
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    residual[static_cast<Eigen::Index>(i)] = Beyond_mm(map, sightings[i]);
  }
  return residual;
}

void TakePose(const PageView& page, const PhotoSource& source, PageMap& map, PhotoPose& pose) {
  pose = FindPose(page, map, source);
  map.camera->foot = pose.foot;
  map.camera->height_mm = pose.height_mm;
  // Radii retain their unit, or the distortion would change with it.
  const double k = map.camera->focal_px / pose.focal_px;
  map.camera->radial[0] /= k * k;
  map.camera->radial[1] /= k * k * k * k;
  map.camera->focal_px = pose.focal_px;
}

/// Fits by Gauss and Newton's steps with Huber's weights.
void Fit(const PageView& page, const PhotoSource& source,
         const std::vector<LandmarkObservation>& sightings, PageMap& map, PhotoPose& pose) {
  constexpr int kPasses = 8;
  constexpr double kHuber = 2;
  constexpr double kFinest_mm = 0.005;
  for (int pass = 0; pass < kPasses; ++pass) {
    const Unknowns step = StepsOf(map);
    const Unknowns prior = PriorsOf(step);
    const Eigen::VectorXd residual = Residuals(map, sightings);
    Eigen::MatrixXd slope(residual.size(), kUnknowns);
    for (Eigen::Index k = 0; k < kUnknowns; ++k) {
      Unknowns by = Unknowns::Zero();
      by[k] = step[k];
      slope.col(k) = residual - Residuals(Moved(map, by), sightings);
    }
    std::vector<double> size(residual.data(), residual.data() + residual.size());
    for (double& r : size) r = std::abs(r);
    const double scale_mm = std::max(kFinest_mm, 1.4826 * Median(size));
    const Eigen::VectorXd weight = residual.unaryExpr([&](double r) {
      const double far = std::abs(r) / (kHuber * scale_mm);
      return (far <= 1 ? 1 : 1 / far) / (scale_mm * scale_mm);
    });
    Eigen::MatrixXd normal = slope.transpose() * weight.asDiagonal() * slope;
    Eigen::VectorXd right = slope.transpose() * weight.cwiseProduct(residual);
    const std::array<double, 5> now{map.camera->radial[0], map.camera->radial[1],
                                    map.camera->bow_mm[0], map.camera->bow_mm[1],
                                    map.camera->bow_mm[2]};
    for (Eigen::Index k = 8; k < kUnknowns; ++k) {
      const double pull = 1 / (prior[k] * prior[k]);
      normal(k, k) += pull;
      right[k] -= pull * now[static_cast<std::size_t>(k - 8)] / step[k];
    }
    const Unknowns change = geometry::SolveSymmetric(normal, right);
    if (!change.allFinite()) return;
    map = Moved(map, change.cwiseProduct(step));
    TakePose(page, source, map, pose);
  }
}

void AddBox(const SheetOnPage& sheet, std::vector<LandmarkObservation>& sightings) {
  for (const SidePoint& point : sheet.box_places) {
    sightings.push_back({sheet.map.OnSide(point.side, point.along_mm),
                         IsUpright(point.side) ? Axis::kX : Axis::kY, point.place});
  }
}

/// Returns the part of a finger that extends beyond the other comb.
FingerSite OuterSite(const SheetPlan& plan, const Structure& structure, std::size_t comb,
                     int finger) {
  constexpr double kClear_mm = 0.3;  // from the other comb's ends, wherever its tool prints
  FingerSite site;
  site.axis = structure.axis;
  site.middle = OuterMiddle(plan, structure, comb, finger);
  const double outer_mm = plan.settings.leg_length_mm - plan.settings.overlap_mm;
  const double half_mm = std::max(0.3, outer_mm / 2 - kClear_mm);
  site.low_mm = site.clear_low_mm = -half_mm;
  site.high_mm = site.clear_high_mm = half_mm;
  return site;
}

/// @returns how many fingers the reference tool has.
int AddFingers(const PageView& page, const SheetPlan& plan, const SheetOnPage& sheet,
               double reach_mm, std::vector<LandmarkObservation>& sightings) {
  ReaderWorkspace workspace;
  int all = 0;
  for (const Structure& structure : plan.structures) {
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      if (structure.combs[comb].tool != plan.settings.reference_tool) continue;
      for (int finger = 0; finger < plan.settings.teeth; ++finger) {
        ++all;
        const FingerSite site = OuterSite(plan, structure, comb, finger);
        const auto found = LocateFinger(page, sheet.reference_mix, sheet.map, plan.settings, site,
                                        reach_mm, workspace);
        if (!found) continue;
        const LocalMap local = sheet.map.Near(site.middle);
        sightings.push_back({site.middle, site.axis, local.ToPage(PointAt(site.axis, *found, 0))});
      }
    }
  }
  return all;
}

double SmallestScale(const PageMap& map) {
  double least = 1e300;
  for (const double s : {-1.0, 0.0, 1.0}) {
    for (const double t : {-1.0, 0.0, 1.0}) {
      const LocalMap local = map.Near({s * map.half_width_mm, t * map.half_height_mm});
      least = std::min({least, Length(local.u_px_mm), Length(local.v_px_mm)});
    }
  }
  return least;
}

}  // namespace

SheetPoint OuterMiddle(const SheetPlan& plan, const Structure& structure, std::size_t comb,
                       int finger) {
  const SheetSettings& settings = plan.settings;
  const auto legs = FingerLegs(plan, structure, comb, finger);
  const Axis axis = structure.axis;
  const double side = structure.FromLowSide(comb) ? -1 : 1;
  return PointAt(axis, (Along(axis, legs[0].start) + Along(axis, legs[1].start)) / 2,
                 Across(axis, structure.middle) + side * settings.leg_length_mm / 2);
}

Result<PhotoOnPage> FitPhotoMap(const PageView& page, const SheetPlan& plan,
                                const PhotoSource& source, SheetOnPage& sheet) {
  constexpr std::array<double, 3> kReach_mm{0.6, 0.4, 0.3};
  constexpr double kMax_mm = 0.12;
  PhotoOnPage photo;
  photo.spread = source.spread;
  SheetOnPage fitted = sheet;
  for (std::size_t pass = 0; pass < kReach_mm.size(); ++pass) {
    std::vector<LandmarkObservation> sightings;
    const int fingers = AddFingers(page, plan, fitted, kReach_mm[pass], sightings);
    photo.fingers = static_cast<int>(sightings.size());
    if (3 * photo.fingers < fingers) {
      return Fail(fmt::format("of the {} fingers of T{}, the reference tool, only {} were found "
                              "where box and code put them: look for what covers them; a photo "
                              "from nearly straight above, of flat paper, shows them best",
                              fingers, plan.settings.reference_tool, photo.fingers),
                  ErrorKind::kMeasurement);
    }
    AddBox(sheet, sightings);
    if (pass == 0) {
      fitted.map.bend_mm = {};
      fitted.map.camera.emplace();
      photo.pose = FindPose(page, fitted.map, source);
      fitted.map.camera->centre = photo.pose.centre;
      fitted.map.camera->focal_px = photo.pose.focal_px;
      fitted.map.camera->reach_mm = std::hypot(fitted.map.half_width_mm, fitted.map.half_height_mm);
      TakePose(page, source, fitted.map, photo.pose);
    }
    Fit(page, source, sightings, fitted.map, photo.pose);
    const Eigen::VectorXd residual = Residuals(fitted.map, sightings);
    const std::vector<double> sizes(residual.data(), residual.data() + residual.size());
    photo.rms_mm = RobustStandardDeviation(sizes);
  }
  if (!(photo.rms_mm < kMax_mm)) {
    return Fail(fmt::format("lines of T{} lie {:.2f} mm (1 sigma) from where lens and paper can "
                            "have put them: take the photo with the main or the 2x camera, not the "
                            "ultra-wide one, and of flat paper",
                            plan.settings.reference_tool, photo.rms_mm),
                ErrorKind::kMeasurement);
  }
  sheet.map = fitted.map;
  photo.px_per_mm = SmallestScale(sheet.map);
  return photo;
}

}  // namespace trammel::tool_offset
