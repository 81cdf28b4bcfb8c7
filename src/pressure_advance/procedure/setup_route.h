// Route of the head during the setup of laser and camera: heights over the plate, places round a
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

/// Nozzle heights, in the printer's coordinates, between which the user has checked that nothing on
/// the head collides.
struct ClearHeights {
  double low_mm = 0;
  double high_mm = 0;
};

// Takes pictures with the head at rest, in room light or by the laser alone, and reads them.

/// Light of a picture.
enum class SetupLight {
  kRoom,   ///< laser off, lights on
  kLaser,  ///< laser on, lights off
};

/// Moves only within CheckPlace. Does not restore laser and lights: the caller's PrinterStateGuard
/// does.
class SetupReader {
 public:
  /// Views are not owned and must outlive it. REQUIRES an eye with a camera.
  SetupReader(const Session& session, const OpenedCamera& reader,
              const pressure_advance::PatternConfig& config, const settings::ScanSettings& settings,
              const ClearHeights& clear, const Reach& reach, std::filesystem::path folder);

  /// Moves to the position, switches the light, waits, and returns the mean of some stable frames.
  /// Stores the last of them in the folder as NAME.jpg (or .png). Errors: those of printer, camera
  /// and disk, and a picture that does not settle; kSafety outside of the clear heights.
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

/// Approach distance to each height and position, which takes up backlash: larger than the accepted
/// backlash.
inline constexpr double kApproach_mm = 0.5;

/// Checks that the heights are within the printer's reach, contain the expected focus and suffice
/// for a sweep. Errors: kInput, kSafety outside of the reach; each with its figures.
[[nodiscard]] Result<void> CheckClearHeights(const ClearHeights& clear,
                                             const settings::ScanSettings& settings,
                                             const Reach& reach);

/// Returns heights about `middle_mm`, at most `half_mm` away and within the clear range, including
/// the approach: upwards, each reached from below, then downwards, each from above.
[[nodiscard]] std::vector<pressure_advance::HeadPlace> SweepHeights(
    const pressure_advance::HeadPlace& at, double half_mm, double step_mm,
    const ClearHeights& clear);

/// Returns positions from which the mark may become visible, nearest to the expected one first:
/// itself and two rings about it.
/// @param step_mm  between them: less than the picture shows
[[nodiscard]] std::vector<pressure_advance::HeadPlace> SearchPlaces(
    const pressure_advance::HeadPlace& expected, double step_mm_x, double step_mm_y);

/// Motion of the mark's picture with the head: px per mm of x and of y.
struct MarkMotion {
  double column_per_x = 0;
  double row_per_x = 0;
  double column_per_y = 0;
  double row_per_y = 0;

  [[nodiscard]] double determinant() const {
    return column_per_x * row_per_y - column_per_y * row_per_x;
  }
};

/// Returns the head's position that moves the mark from one pixel to another. REQUIRES a
/// determinant.
[[nodiscard]] pressure_advance::HeadPlace BringMark(const pressure_advance::HeadPlace& from,
                                                    const pressure_advance::MarkReading& seen,
                                                    double column_px, double row_px,
                                                    const MarkMotion& motion);

/// Returns the half width of the square of positions from which the whole mark is within the
/// picture, once it is centred; at most 4.5 mm, 0 or less if the picture is too small.
[[nodiscard]] double GridHalf_mm(const pressure_advance::MarkReading& seen,
                                 const pressure_advance::MarkShape& shape,
                                 const pressure_advance::PictureSize& picture);

/// Returns sixteen positions of a square about `middle`; each axis is approached from either side
/// for half of them.
[[nodiscard]] std::vector<pressure_advance::HeadPlace> GridPlaces(
    const pressure_advance::HeadPlace& middle, double half_mm);

/// Returns the head's place for the stripe on bare plate beside the mark: behind or in front of it,
/// away from its run-in if that is within reach. Errors: kSafety if neither is.
[[nodiscard]] Result<pressure_advance::HeadPlace> PlaceBesideMark(
    const pressure_advance::MarkPlan& mark, const settings::ScanSettings& settings,
    const Reach& reach);

/// Checks that the head may move there, with the approach from either side. Errors: kSafety, with
/// the place and the bounds.
[[nodiscard]] Result<void> CheckPlace(const pressure_advance::HeadPlace& place,
                                      const ClearHeights& clear, const Reach& reach);

/// Returns the moves of the approach and to the position itself, absolute; heights first.
[[nodiscard]] std::string GcodeTo(const pressure_advance::HeadPlace& place,
                                  const pressure_advance::PatternConfig& config);

}  // namespace trammel::procedure
