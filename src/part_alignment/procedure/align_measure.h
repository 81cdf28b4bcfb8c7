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

/// Reads a live camera continuously, so that a frame from a move is never mistaken for one after
/// it.
class StillPictures {
 public:
  /// @param source    must outlive this
  /// @param settle_s  >= 0, between the call and the beginning of a live picture, or its arrival
  ///                  where the camera does not say when it was taken; a recording's are not timed
  StillPictures(machine::FrameSource& source, double settle_s);

  /// Takes a picture. Errors: the camera's; kMeasurement for a recording that has ended or whose
  /// picture is damaged; kMachine if no sound picture arrives for 10 s; kInterrupted.
  [[nodiscard]] Result<machine::CapturedFrame> Take(const std::stop_token& stop);

 private:
  machine::FrameSource& source_;
  double settle_s_;
  std::optional<FrameRecorder> reader_;  ///< live camera only
  bool times_are_told_ = false;          ///< times from this camera, on our clock
};

/// Hooks of a measurement.
struct MeasurementHooks : ViewHooks {
  /// Stores the views taken so far, with their observations.
  std::function<Result<void>(const part_alignment::Measurement& so_far)> keep_observations;
  std::function<void(const std::string& line)> tell;  ///< progress
};

struct MeasureOptions {
  part_alignment::CodeBook book;
  part_alignment::FinderOptions finder;  ///< `mirrored` is set by the camera of the plan
  RouteOptions route;
  /// Added to the detector's own sigma, in quadrature: errors that it cannot detect (lens,
  /// vibration). >= 0
  double extra_sigma_px = 0.005;
  /// Prefix of the code's number in the plan's ids, as in "T7".
  std::string id_prefix;
};

struct MeasureOutcome {
  part_alignment::Measurement measurement;          ///< the plan's, with what was seen
  std::vector<part_alignment::FoundTargets> found;  ///< by view, including clutter
  part_alignment::SeenDiscs discs;                  ///< as observed
  std::vector<std::string>
      notices;  ///< views without targets, targets that are none of the part's …
};

/// Drives through the views of the plan (whose own observations are ignored), takes a picture in
/// each and reads it. Ids and the whole way are checked before anything moves. After each picture,
/// checks that the spindle is still where it was driven.
/// REQUIRES every function of the shop but `move_to`, `stands_at`.
/// Errors: kInput for an id that no code has; the route's; the shop's, with the view at which it
/// happened; kMachine if the spindle moved meanwhile; kMeasurement for a picture of another size
/// than the camera's, and if no picture shows a target of the plan.
[[nodiscard]] Result<MeasureOutcome> MeasurePart(const part_alignment::Measurement& plan,
                                                 const MeasureOptions& options,
                                                 const MeasurementHooks& shop);

/// Returns a line for each target that the solution expects in a view and that was not read, with
/// the reason if a candidate there was rejected. None unless the verdict is good.
[[nodiscard]] std::vector<std::string> MissingTargets(const MeasureOutcome& outcome,
                                                      const part_alignment::Alignment& alignment);

}  // namespace trammel::procedure
