// Drives through the planned views, takes and reads their pictures.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "part_alignment/pose/disc_centres.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/procedure/align_route.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/ring_finder.h"
#include "session/frame_recorder.h"

namespace trammel::procedure {

/// A live camera is read all the time, so that what it took during a move is never mistaken for
/// what it took after it.
class StillPictures {
 public:
  /// @param source    must outlive this
  /// @param settle_s  >= 0, between the call and the beginning of a live picture, or its arrival
  ///                  where the camera does not say when it was taken; a recording's are not timed
  StillPictures(machine::FrameSource& source, double settle_s);

  /// Errors: the camera's; kMeasurement for a recording that has come to its end or whose picture
  /// is damaged; kMachine where no sound picture comes for 10 s; kInterrupted.
  [[nodiscard]] Result<machine::CapturedFrame> Take(const std::stop_token& stop);

 private:
  machine::FrameSource& source_;
  double settle_s_;
  std::optional<FrameRecorder> reader_;  ///< of a live camera
  bool times_are_told_ = false;          ///< by this camera, on our clock
};

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

/// One line for each target that a view should show by the solution and that was not read, with why
/// what is there was rejected, if it was; none unless the verdict is good.
[[nodiscard]] std::vector<std::string> MissingTargets(const MeasureOutcome& outcome,
                                                      const part_alignment::Alignment& alignment);

}  // namespace trammel::procedure
