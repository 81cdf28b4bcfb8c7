// Where the head goes while laser and camera are set up: heights over the plate, places round a
// printed mark.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/calibrate.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "pressure_advance/setup/mark_reading.h"
#include "pressure_advance/setup/printed_mark.h"
#include "pressure_advance/setup/solve_setup.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Heights of the nozzle, in the printer's coordinates, between which its user has seen that
/// nothing on the head touches anything.
struct ClearHeights {
  double low_mm = 0;
  double high_mm = 0;
};

// Takes pictures of a standing head, lit or by the laser alone, and reads them.

/// Light in which a picture is taken.
enum class SetupLight {
  kRoom,   ///< laser off, lights on
  kLaser,  ///< laser on, lights off
};

/// Moves only where CheckPlace lets it. Leaves laser and lights as they are: the caller's
/// PrinterStateGuard switches the one off and brings the others back.
class SetupEye {
 public:
  /// Views are not owned and outlive it. REQUIRES an eye with a camera.
  SetupEye(const Session& session, const Eye& eye, const pressure_advance::PatternConfig& config,
           const settings::ScanSettings& settings, const ClearHeights& clear, const Reach& reach,
           std::filesystem::path folder);

  /// Goes there, switches the light, waits, and takes the mean of some frames that show the same.
  /// The last of them is kept in the folder as NAME.jpg (or .png). Errors: those of printer, camera
  /// and disk, and a picture that goes on moving; kSafety outside of what is clear.
  [[nodiscard]] Result<Frame> Look(const pressure_advance::HeadPlace& place, SetupLight light,
                                   const std::string& name);

  /// Switches the laser off and the lights on.
  [[nodiscard]] Result<void> LightRoom();

  [[nodiscard]] const Reach& reach() const { return reach_; }
  [[nodiscard]] const ClearHeights& clear() const { return clear_; }
  [[nodiscard]] const Session& session() const { return session_; }

 private:
  [[nodiscard]] Result<void> Switch(SetupLight light);
  [[nodiscard]] Result<void> Run(const std::string& gcode);
  [[nodiscard]] Result<std::optional<Frame>> MeanPicture(const std::string& name);

  const Session& session_;
  FrameRecorder& recorder_;
  const pressure_advance::PatternConfig& config_;
  const settings::ScanSettings& settings_;
  ClearHeights clear_;
  Reach reach_;
  std::filesystem::path folder_;
};

/// Each height and place is approached from this far, so that play shows: more than is borne.
inline constexpr double kApproach_mm = 0.5;

/// That the heights lie within the printer's reach, hold the expected focus and are enough for a
/// sweep. Errors: kInput, kSafety outside of the reach; each with its figures.
[[nodiscard]] Result<void> CheckClearHeights(const ClearHeights& clear,
                                             const settings::ScanSettings& settings,
                                             const Reach& reach);

/// Heights about `middle_mm`, at most `half_mm` away and within what is clear: upwards, each
/// reached from below, then downwards, each from above; so that the approach is clear, too.
[[nodiscard]] std::vector<pressure_advance::HeadPlace> SweepHeights(
    const pressure_advance::HeadPlace& at, double half_mm, double step_mm,
    const ClearHeights& clear);

/// Places from which the mark may come into view, nearest to where the settings expect it first:
/// itself and two rings about it.
/// @param step_mm  between them: less than the picture shows
[[nodiscard]] std::vector<pressure_advance::HeadPlace> SearchPlaces(
    const pressure_advance::HeadPlace& expected, double step_mm_x, double step_mm_y);

/// How the mark's picture follows the head: px per mm of x and of y.
struct MarkMotion {
  double column_per_x = 0;
  double row_per_x = 0;
  double column_per_y = 0;
  double row_per_y = 0;

  [[nodiscard]] double determinant() const {
    return column_per_x * row_per_y - column_per_y * row_per_x;
  }
};

/// The head's place that brings the mark from one pixel to another. REQUIRES a determinant.
[[nodiscard]] pressure_advance::HeadPlace BringMark(const pressure_advance::HeadPlace& from,
                                                    const pressure_advance::MarkReading& seen,
                                                    double column_px, double row_px,
                                                    const MarkMotion& motion);

/// Half of the square of places from which the whole mark stays in the picture, once it stands in
/// its middle; at most 4.5 mm, 0 or less where the picture is too small.
[[nodiscard]] double GridHalf_mm(const pressure_advance::MarkReading& seen,
                                 const pressure_advance::MarkShape& shape,
                                 const pressure_advance::PictureSize& picture);

/// Sixteen places of a square about `middle`, each axis of half of them approached from either
/// side.
[[nodiscard]] std::vector<pressure_advance::HeadPlace> GridPlaces(
    const pressure_advance::HeadPlace& middle, double half_mm);

/// Where the head stands for the stripe on bare plate beside the mark: behind it, or in front of
/// it, away from its run-in where that can be reached. Errors: kSafety where neither can.
[[nodiscard]] Result<pressure_advance::HeadPlace> PlaceBesideMark(
    const pressure_advance::MarkPlan& mark, const settings::ScanSettings& settings,
    const Reach& reach);

/// That the head may go there, with the approach from either side. Errors: kSafety, with the place
/// and the bounds.
[[nodiscard]] Result<void> CheckPlace(const pressure_advance::HeadPlace& place,
                                      const ClearHeights& clear, const Reach& reach);

/// The approach to a place and the place itself, absolute; heights first.
[[nodiscard]] std::string GcodeTo(const pressure_advance::HeadPlace& place,
                                  const pressure_advance::PatternConfig& config);

}  // namespace trammel::procedure
