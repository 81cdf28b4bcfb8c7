#include "part_alignment/pose/caveats.h"

#include <fmt/format.h>

#include <cmath>

#include "part_alignment/camera/calibration_age.h"
#include "part_alignment/pose/solution.h"

namespace trammel::part_alignment {
namespace {

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
  if (const double sigma_mm = PlaceSigma(alignment); sigma_mm > options.weakest_limit_mm) {
    caveats.push_back(fmt::format(
        "what is stated of the inputs leaves the part's place uncertain by {:.3g} mm (95 %), "
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
