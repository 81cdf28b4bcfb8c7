#include "part_alignment/pose/caveats.h"

#include <fmt/format.h>

#include <algorithm>

#include "part_alignment/camera/calibration_age.h"
#include "part_alignment/pose/solution.h"

namespace trammel::part_alignment {
namespace {

bool OneOrientation(const std::vector<View>& views) {
  // Eccentricity shows by twice the sine of half the angle: a tenth leaves it all but hidden.
  constexpr double kAlike = 0.1;
  return std::all_of(views.begin(), views.end(), [&](const View& view) {
    return (view.spindle_rotation - views.front().spindle_rotation).norm() < kAlike;
  });
}

}  // namespace

std::vector<std::string> Caveats(const Measurement& measurement, const SolveOptions& options,
                                 const Alignment& alignment,
                                 const std::optional<CalibrationRecord>& calibration,
                                 std::string_view today) {
  std::vector<std::string> caveats;
  if (alignment.verdict != Verdict::kGood) return caveats;
  if (!options.unknowns.clamp_eccentricity && options.inputs.clamp_eccentricity_mm == 0 &&
      OneOrientation(measurement.views)) {
    caveats.emplace_back(
        "the stated uncertainty takes the camera for clamped without eccentricity: all views have "
        "one orientation of the spindle, so that an eccentric clamping moves the part across the "
        "spindle as much and no residual shows it; state input_uncertainty.clamp_eccentricity_mm, "
        "or add views with the spindle turned by 180 degrees and the unknown clamp_eccentricity");
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
