#include "part_alignment/part_fit/part_fit_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace trammel::part_alignment {
namespace {

constexpr double kMost_mm = 1e6;

bool Sound(const Eigen::Vector3d& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMost_mm;
}

Result<void> CheckMesh(const IdealSurface& surface) {
  if (surface.mesh == nullptr) return Fail(fmt::format("surface {} has no mesh", surface.id));
  if (!(std::abs(surface.stock_allowance_mm) < kMost_mm)) {
    return Fail(
        fmt::format("surface {}: overstock_mm is {}", surface.id, surface.stock_allowance_mm));
  }
  if (surface.most_facet_error_mm && !(*surface.most_facet_error_mm > 0)) {
    return Fail(fmt::format("surface {}: most_facet_error_mm is {}; it must be above 0", surface.id,
                            *surface.most_facet_error_mm));
  }
  return {};
}

// A surface that wants less material than every point must have would never get it.
Result<void> CheckWanted(const IdealSurface& surface, const PartFitOptions& options) {
  if (!(surface.stock_allowance_mm < std::min(0.0, options.least_stock_allowance_mm))) return {};
  return Fail(fmt::format(
      "surface {}: overstock_mm is {}, and every point must have {} mm: material outside of the "
      "ideal surface counts as positive",
      surface.id, surface.stock_allowance_mm, options.least_stock_allowance_mm));
}

Result<std::set<std::string>> CheckSurfaces(PartFitInput& input, const PartFitOptions& options) {
  std::set<std::string> ids;
  for (IdealSurface& surface : input.surfaces) {
    if (!ids.insert(surface.id).second) {
      return Fail(fmt::format("surface {} stands there twice", surface.id));
    }
    TRY(CheckWanted(surface, options));
    if (surface.kind == SurfaceKind::kMesh) {
      TRY(CheckMesh(surface));
      continue;
    }
    const double length = surface.direction.norm();
    if (!Sound(surface.middle_mm) || !(length > 1e-9 && length < kMost_mm)) {
      return Fail(fmt::format("surface {}: its middle or its direction cannot be", surface.id));
    }
    surface.direction /= length;
    if (surface.kind != SurfaceKind::kPlane &&
        !(surface.radius_mm > 0 && surface.radius_mm < kMost_mm)) {
      return Fail(fmt::format("surface {}: radius_mm is {}; it must be above 0", surface.id,
                              surface.radius_mm));
    }
    if (!(std::abs(surface.stock_allowance_mm) < kMost_mm)) {
      return Fail(
          fmt::format("surface {}: overstock_mm is {}", surface.id, surface.stock_allowance_mm));
    }
  }
  return ids;
}

Result<std::set<std::string>> CheckPoints(const PartFitInput& input,
                                          const std::set<std::string>& surfaces) {
  std::set<std::string> ids;
  std::set<std::string> touched;
  std::size_t targets = 0;
  for (const MeasuredPoint& point : input.points) {
    if (!ids.insert(point.id).second) {
      return Fail(fmt::format("point {} stands there twice", point.id));
    }
    if (!Sound(point.at_mm) || !(point.sigma_mm > 0 && point.sigma_mm < kMost_mm)) {
      return Fail(
          fmt::format("point {}: {} {} {} mm, sigma {} mm; numbers must be finite, sigma "
                      "above 0",
                      point.id, point.at_mm.x(), point.at_mm.y(), point.at_mm.z(), point.sigma_mm));
    }
    if (point.surface.empty()) {
      ++targets;
      continue;
    }
    if (!surfaces.contains(point.surface)) {
      return Fail(fmt::format("point {}: the surface {} is none of the ideal part's ({})", point.id,
                              point.surface, fmt::join(surfaces, ", ")));
    }
    touched.insert(point.surface);
  }
  constexpr std::size_t kMostTargets = 1000;  // their covariance has nine numbers for each pair
  if (targets > kMostTargets) {
    return Fail(
        fmt::format("{} points without a surface; at most {} can be targets: name the "
                    "surface of measured points",
                    targets, kMostTargets));
  }
  for (const std::string& surface : surfaces) {
    if (!touched.contains(surface)) {
      return Fail(fmt::format(
          "surface {} has no measured point: measure it, or leave it out of the file", surface));
    }
  }
  return ids;
}

}  // namespace

Result<PartFitInput> CheckedPartFit(const PartFitInput& input, const PartFitOptions& options) {
  PartFitInput checked = input;
  if (options.most_uneven_mm && !(*options.most_uneven_mm > 0)) {
    return Fail(fmt::format("most_uneven_mm is {}; it must be above 0", *options.most_uneven_mm));
  }
  if (!std::isfinite(options.least_stock_allowance_mm) ||
      !(options.guard_sigmas >= 0 && options.guard_sigmas <= 10) ||
      !(options.most_scale_change >= 0 && options.most_scale_change <= 0.1)) {
    return Fail(fmt::format(
        "least stock allowance {} mm, guard {} sigmas (0 … 10), scale change {} "
        "(0 … 0.1)",
        options.least_stock_allowance_mm, options.guard_sigmas, options.most_scale_change));
  }
  constexpr double kThickest_mm = 10;
  if (!(options.target_thickness_mm >= 0 && options.target_thickness_mm <= kThickest_mm) ||
      !(options.target_thickness_sigma_mm >= 0 &&
        options.target_thickness_sigma_mm <= kThickest_mm)) {
    return Fail(
        fmt::format("targets {} mm thick, sigma {} mm; 0 … {} are possible, in mm (100 µm are 0.1)",
                    options.target_thickness_mm, options.target_thickness_sigma_mm, kThickest_mm));
  }
  const auto surfaces = TRY(CheckSurfaces(checked, options));
  const auto points = TRY(CheckPoints(checked, surfaces));
  std::set<std::pair<std::string, std::string>> bar_ends;
  for (const ScaleBar& bar : checked.bars) {
    if (!bar_ends.insert(std::minmax(bar.from, bar.to)).second) {
      return Fail(fmt::format(
          "scale bar {}-{} stands there twice: it would count as two; of a bar that was calibrated "
          "several times give the mean",
          bar.from, bar.to));
    }
    for (const std::string& end : {bar.from, bar.to}) {
      if (!points.contains(end)) {
        return Fail(
            fmt::format("scale bar {}-{}: {} is none of the points", bar.from, bar.to, end));
      }
    }
    if (bar.from == bar.to || !(bar.length_mm > 0 && bar.length_mm < kMost_mm) ||
        !(bar.sigma_mm >= 0 && bar.sigma_mm < kMost_mm)) {
      return Fail(fmt::format("scale bar {}-{}: {} mm, sigma {} mm; its length must be above 0",
                              bar.from, bar.to, bar.length_mm, bar.sigma_mm));
    }
  }
  return checked;
}

BarScale ScaleOf(const PartFitInput& input, const PartFitOptions& options) {
  if (input.bars.empty()) {
    BarScale as_it_is;
    as_it_is.unchecked =
        "the scale is that of the measurement, without a scale bar: its error is not in the "
        "covariance; add two bars";
    return as_it_is;
  }
  const auto count = std::ssize(input.bars);
  FoundBars found{input.bars, Eigen::VectorXd(count), {}};
  std::map<std::string, Eigen::Index> columns;  // three for each end
  Eigen::MatrixXd by_sigma = Eigen::MatrixXd::Zero(count, 6 * count);
  const auto end_of = [&](const std::string& id) {
    return *std::find_if(input.points.begin(), input.points.end(),
                         [&id](const MeasuredPoint& point) { return point.id == id; });
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const ScaleBar& bar = input.bars[static_cast<std::size_t>(i)];
    const MeasuredPoint from = end_of(bar.from);
    const MeasuredPoint to = end_of(bar.to);
    const Eigen::Vector3d along = to.at_mm - from.at_mm;
    found.lengths[i] = along.norm();
    if (!(found.lengths[i] > 0)) {
      BarScale none;
      none.fault = fmt::format("the scale bar {}-{} has both of its ends at one place: check them",
                               bar.from, bar.to);
      return none;
    }
    const Eigen::RowVector3d share = (along / along.squaredNorm()).transpose();
    for (const auto& [end, signed_share] :
         {std::pair(&to, share), std::pair(&from, Eigen::RowVector3d(-share))}) {
      const auto column = columns.emplace(end->id, 3 * std::ssize(columns)).first->second;
      by_sigma.block<1, 3>(i, column) += end->sigma_mm * signed_share;
    }
  }
  found.covariance = by_sigma * by_sigma.transpose();
  BarScale result = TestBars(found);
  if (result.fault.empty() && !(std::abs(result.scale - 1) <= options.most_scale_change)) {
    result.fault = fmt::format(
        "the scale bars ask for a scale of {:.6f}, at most {:g} from 1 is accepted: a bar's "
        "length, its ends or the unit of the table are wrong",
        result.scale, options.most_scale_change);
  }
  return result;
}

}  // namespace trammel::part_alignment
