// Takes the pictures of a part from the planned places, and reads the targets in them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/pose/disc_centres.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/procedure/align_route.h"
#include "part_alignment/procedure/view_drive.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/ring_finder.h"

namespace trammel::procedure {

/// The outside of a measurement.
struct MeasurementHooks : ViewHooks {
  /// Keeps the views that were taken so far, with what was seen in them.
  std::function<Result<void>(const part_alignment::Measurement& so_far)> keep_observations;
  std::function<void(const std::string& line)> tell;  ///< progress
};

struct MeasureOptions {
  part_alignment::CodeBook book;
  part_alignment::FinderOptions finder;  ///< `mirrored` is set by the camera of the plan
  RouteOptions route;
  /// Added to the detector's own, in quadrature: what it cannot know of (lens, vibration). >= 0
  double extra_sigma_px = 0.005;
  /// Before the number of the code in the ids of the plan, as in "T7".
  std::string id_prefix;
};

struct MeasureOutcome {
  part_alignment::Measurement measurement;          ///< the plan's, with what was seen
  std::vector<part_alignment::FoundTargets> found;  ///< by view, clutter and all
  part_alignment::SeenDiscs discs;                  ///< of the observations
  std::vector<std::string>
      notices;  ///< views without targets, targets that are none of the part's …
};

/// Drives through the views of the plan (whose own observations are not looked at), takes a picture
/// in each and reads it. Ids and the whole way are checked before anything moves; after each
/// picture, that the spindle still stands where it was driven.
/// REQUIRES every function of the shop but `move_to`, `stands_at`.
/// Errors: kInput for an id that no code has; the route's; the shop's, with the view at which it
/// happened; kMachine where the spindle moved meanwhile; kMeasurement for a picture of another size
/// than the camera's, and where no picture shows a target of the plan.
[[nodiscard]] Result<MeasureOutcome> MeasurePart(const part_alignment::Measurement& plan,
                                                 const MeasureOptions& options,
                                                 const MeasurementHooks& shop);

}  // namespace trammel::procedure
