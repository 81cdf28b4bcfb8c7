#include "part_alignment/part_fit/part_fit_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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
    if (auto wanted = CheckWanted(surface, options); !wanted) {
      return tl::unexpected(wanted.error());
    }
    if (surface.kind == SurfaceKind::kMesh) {
      if (auto read = CheckMesh(surface); !read) return tl::unexpected(read.error());
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
  const auto surfaces = CheckSurfaces(checked, options);
  if (!surfaces) return tl::unexpected(surfaces.error());
  const auto points = CheckPoints(checked, *surfaces);
  if (!points) return tl::unexpected(points.error());
  std::set<std::pair<std::string, std::string>> bar_ends;
  for (const ScaleBar& bar : checked.bars) {
    if (!bar_ends.insert(std::minmax(bar.from, bar.to)).second) {
      return Fail(fmt::format(
          "scale bar {}-{} stands there twice: it would count as two; of a bar that was calibrated "
          "several times give the mean",
          bar.from, bar.to));
    }
    for (const std::string& end : {bar.from, bar.to}) {
      if (!points->contains(end)) {
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
  BarScale result;
  if (input.bars.empty()) {
    result.notice =
        "no scale bar: the scale of the measurement is taken as it is, and its error is not in the "
        "covariance";
    return result;
  }
  const auto point = [&input](const std::string& id) {
    return *std::find_if(input.points.begin(), input.points.end(),
                         [&id](const MeasuredPoint& p) { return p.id == id; });
  };
  struct Read {
    double measured_mm;
    double sigma_mm;
  };
  std::vector<Read> reads;
  double top = 0;
  double bottom = 0;
  for (const ScaleBar& bar : input.bars) {
    const MeasuredPoint from = point(bar.from);
    const MeasuredPoint to = point(bar.to);
    const Read read{(from.at_mm - to.at_mm).norm(),
                    std::hypot(bar.sigma_mm, from.sigma_mm, to.sigma_mm)};
    reads.push_back(read);
    const double weight = 1 / (read.sigma_mm * read.sigma_mm);
    top += weight * read.measured_mm * bar.length_mm;
    bottom += weight * read.measured_mm * read.measured_mm;
  }
  result.scale = top / bottom;
  result.sigma = 1 / std::sqrt(bottom);
  if (!(std::abs(result.scale - 1) <= options.most_scale_change)) {
    result.fault = fmt::format(
        "the scale bars ask for a scale of {:.6f}, at most {:g} from 1 is accepted: a bar's "
        "length, "
        "its ends or the unit of the table are wrong",
        result.scale, options.most_scale_change);
    return result;
  }
  constexpr double kAgree = 4;
  for (std::size_t i = 0; i < reads.size(); ++i) {
    const ScaleBar& bar = input.bars[i];
    const double off_mm = reads[i].measured_mm * result.scale - bar.length_mm;
    if (std::abs(off_mm) > kAgree * reads[i].sigma_mm) {
      result.fault = fmt::format(
          "scale bar {}-{} is {:+.3f} mm off what the bars say together, {:.1f} of its sigmas: the "
          "bars contradict one another",
          bar.from, bar.to, off_mm, std::abs(off_mm) / reads[i].sigma_mm);
    }
  }
  return result;
}

}  // namespace trammel::part_alignment
