#include "tool_offset/reading/photo_map.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "tool_offset/reading/leg_reader.h"

namespace trammel::tool_offset {
namespace {

/// Something of the plan that was seen: it tells where it lies across its own line.
struct Sighting {
  SheetPoint planned;
  bool along_u = true;  ///< the direction that it tells
  PagePoint seen;
};

constexpr Eigen::Index kUnknowns = 13;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

/// Steps that move the box's corners by about 0.01 to 0.1 mm.
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

/// What is known of them without the photo, 1 sigma in steps; 0: nothing.
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

/// How far from its place by the map something is seen, across its line; mm.
double Beyond_mm(const PageMap& map, const Sighting& sighting) {
  const LocalMap local = map.Near(sighting.planned);
  const PagePoint d = sighting.seen - local.at;
  const PagePoint u = local.u_px_mm;
  const PagePoint v = local.v_px_mm;
  const double determinant = u.x_px * v.y_px - u.y_px * v.x_px;
  return sighting.along_u ? (d.x_px * v.y_px - d.y_px * v.x_px) / determinant
                          : (u.x_px * d.y_px - u.y_px * d.x_px) / determinant;
}

Eigen::VectorXd Residuals(const PageMap& map, const std::vector<Sighting>& sightings) {
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
  // Radii stay counted in the same unit, or the distortion would change with it.
  const double k = map.camera->focal_px / pose.focal_px;
  map.camera->radial[0] /= k * k;
  map.camera->radial[1] /= k * k * k * k;
  map.camera->focal_px = pose.focal_px;
}

/// Gauss and Newton's steps with Huber's weights.
void Fit(const PageView& page, const PhotoSource& source, const std::vector<Sighting>& sightings,
         PageMap& map, PhotoPose& pose) {
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

void AddBox(const SheetOnPage& sheet, std::vector<Sighting>& sightings) {
  const PageMap& map = sheet.map;
  for (const SidePoint& point : sheet.box_places) {
    const bool upright = point.side == kLeft || point.side == kRight;
    const double outward = point.side == kRight || point.side == kTop ? 1 : -1;
    sightings.push_back({upright ? SheetPoint{outward * map.half_width_mm, point.along_mm}
                                 : SheetPoint{point.along_mm, outward * map.half_height_mm},
                         upright, point.place});
  }
}

/// The part of a finger that reaches beyond the other comb.
FingerSite OuterSite(const SheetPlan& plan, const Structure& structure, std::size_t comb,
                     int finger) {
  constexpr double kClear_mm = 0.3;  // of the other comb's ends, wherever its tool prints
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
               double reach_mm, std::vector<Sighting>& sightings) {
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
        const bool is_x = site.axis == Axis::kX;
        const LocalMap local = sheet.map.Near(site.middle);
        sightings.push_back(
            {site.middle, is_x, is_x ? local.ToPage(*found, 0) : local.ToPage(0, *found)});
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
  const bool is_x = structure.axis == Axis::kX;
  const double side = structure.FromLowSide(comb) ? -1 : 1;
  const double across_mm =
      (is_x ? structure.middle.v_mm : structure.middle.u_mm) + side * settings.leg_length_mm / 2;
  const double along_mm = is_x ? (legs[0].start.u_mm + legs[1].start.u_mm) / 2
                               : (legs[0].start.v_mm + legs[1].start.v_mm) / 2;
  return is_x ? SheetPoint{along_mm, across_mm} : SheetPoint{across_mm, along_mm};
}

Result<PhotoOnPage> FitPhotoMap(const PageView& page, const SheetPlan& plan,
                                const PhotoSource& source, SheetOnPage& sheet) {
  constexpr std::array<double, 3> kReach_mm{0.6, 0.4, 0.3};
  constexpr double kMost_mm = 0.12;
  PhotoOnPage photo;
  photo.spread = source.spread;
  SheetOnPage fitted = sheet;
  for (std::size_t pass = 0; pass < kReach_mm.size(); ++pass) {
    std::vector<Sighting> sightings;
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
  if (!(photo.rms_mm < kMost_mm)) {
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
