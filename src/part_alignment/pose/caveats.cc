#include "part_alignment/pose/caveats.h"

#include <fmt/format.h>

#include <cmath>

#include "part_alignment/camera/calibration_age.h"
#include "part_alignment/pose/solution.h"

namespace trammel::part_alignment {
namespace {

/// Of the views that have a part in the answer.
bool OneOrientation(const std::vector<View>& views, const Alignment& alignment) {
  // Eccentricity shows by twice the sine of half the angle: a tenth leaves it all but hidden.
  constexpr double kAlike = 0.1;
  const View* first = nullptr;
  for (const AlignmentResidual& residual : alignment.residuals) {
    if (residual.weight == 0) continue;
    const View& view = views[residual.view];
    if (first == nullptr) first = &view;
    if ((view.spindle_rotation - first->spindle_rotation).norm() >= kAlike) return false;
  }
  return true;
}

constexpr const char* kUnseen =
    "all views that count have one orientation of the spindle, so that an eccentric clamping moves "
    "the part across the spindle as much and no residual shows it; state "
    "input_uncertainty.clamp_eccentricity_mm, or add views with the spindle turned by 180 degrees "
    "and the unknown clamp_eccentricity";
constexpr const char* kUnasked =
    "the views turn the spindle and could tell it; add the unknown clamp_eccentricity, or state "
    "input_uncertainty.clamp_eccentricity_mm";

/// The largest standard uncertainty of x, y and z.
double PlaceSigma(const Alignment& alignment) {
  if (alignment.covariance.rows() < 3) return 0;
  return std::sqrt(alignment.covariance.diagonal().head<3>().maxCoeff());
}

}  // namespace

std::vector<std::string> Caveats(const Measurement& measurement, const SolveOptions& options,
                                 const Alignment& alignment,
                                 const std::optional<CalibrationRecord>& calibration,
                                 std::string_view today) {
  std::vector<std::string> caveats;
  if (alignment.verdict != Verdict::kGood) return caveats;
  if (!options.unknowns.clamp_eccentricity && options.inputs.clamp_eccentricity_mm == 0) {
    caveats.push_back(
        fmt::format("the stated uncertainty takes the camera for clamped without eccentricity: {}",
                    OneOrientation(measurement.views, alignment) ? kUnseen : kUnasked));
  }
  if (const double sigma_mm = PlaceSigma(alignment); sigma_mm > options.weakest_limit_mm) {
    caveats.push_back(fmt::format(
        "what is stated of the inputs leaves the part's place uncertain by {:.3g} mm (k = 2), "
        "however well the views tell it: look at input_uncertainty, its units and the camera's "
        "covariance",
        2 * sigma_mm));
  }
  if (!calibration) return caveats;
  const DistanceRange seen = SeenDistances(measurement, alignment);
  if (seen.nearest_mm < calibration->nearest_mm || seen.farthest_mm > calibration->farthest_mm) {
    caveats.push_back(fmt::format(
        "targets were seen from {:.0f} … {:.0f} mm, but the camera was calibrated ({}) from {:.0f} "
        "to {:.0f} mm: its figures are extrapolated",
        seen.nearest_mm, seen.farthest_mm, calibration->date, calibration->nearest_mm,
        calibration->farthest_mm));
  }
  if (auto old = NoticeOfAge(calibration->date, today)) caveats.push_back(std::move(*old));
  return caveats;
}

}  // namespace trammel::part_alignment
