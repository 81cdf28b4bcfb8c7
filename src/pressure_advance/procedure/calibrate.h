// Pressure advance on a real printer: check, print, cool, scan; analysis and verdict follow.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "session/frame_recorder.h"
#include "session/guarded_steps.h"
#include "session/printer_state_guard.h"
#include "session/session.h"
#include "session/uploads.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

// Runs a procedure with exclusive use of a printer: preparation before the first step, and
// restoration after the last.

/// Camera that delivers pictures. Both are absent if none is used.
struct OpenedCamera {
  std::unique_ptr<machine::FrameSource> camera;
  std::unique_ptr<FrameRecorder> recorder;

  /// Returns the camera's own description; empty without one.
  [[nodiscard]] std::string Describe() const;
};

/// Views are not owned.
struct GuardedRun {
  const pressure_advance::PatternConfig* pattern = nullptr;  ///< REQUIRED: where the head parks
  const settings::ScanSettings* settings = nullptr;          ///< REQUIRED
  RunIdentity identity;                                      ///< as in GuardedSteps
  bool looks = true;                                         ///< through the camera
  /// Moves nothing; an error ends the run before any change.
  std::function<Result<void>(const Session&)> check;
  /// Procedure's own steps, on a homed printer.
  std::function<Result<void>(const Session&, PrinterStateGuard&, const OpenedCamera&)> steps;
};

/// Runs the checks, claims the printer, opens the camera and homes unhomed axes, then runs the
/// steps. Nothing moves before every check has passed and the camera has sent a picture. In any
/// case restores laser, lights, pressure advance, limits, heater targets and G-code state
/// (PrinterStateGuard).
/// @param session  receives the run's name at the printer (PrinterStateGuard::Take).
[[nodiscard]] GuardedOutcome RunGuarded(Session& session, const GuardedRun& run);

/// Opens the camera of the settings, or the webcam in the printer server's list.
[[nodiscard]] Result<std::unique_ptr<machine::FrameSource>> OpenCamera(
    const Session& session, const settings::ScanSettings& settings);

// Nozzle before a scan: it must not ooze over the pattern.

/// Cools the active extruder to a temperature and waits for it; does nothing if it is colder
/// already. 0: switches it off without waiting.
[[nodiscard]] Result<void> CoolForScan(const Session& session, const machine::PrinterState& state,
                                       double nozzle_c, double time_limit_s);

// Photo of the printed pattern, uploaded by the user.

struct PatternPhoto {
  std::string name;  ///< file name, without a folder
  std::string bytes;
  /// Time when the file was stored, by ServerTime_s' clock; absent if it was named, or not
  /// reported.
  std::optional<double> stored_s = {};
};

/// Returns the clock of the printer server's file dates, s since 1970, at most some two seconds
/// late; absent if unknown.
[[nodiscard]] std::optional<double> ServerTime_s(const Session& session);

/// Downloads a photo from the folder beside the printer's configuration.
/// @param name  in it; empty: the picture (JPEG, PNG, WebP, HEIC) that was stored last
/// @param is_result  whether a name is that of a result's picture, which is no photo
/// Errors: kInput: there is none, or it is larger than 64 MiB; kMachine.
[[nodiscard]] Result<PatternPhoto> DownloadPhoto(
    const Session& session, const std::string& name,
    const std::function<bool(const std::string&)>& is_result);

/// Returns a picture file's extension, in lower case with the dot; empty: not a picture's.
[[nodiscard]] std::string PictureEnding(const std::string& name);

struct CalibrationRequest {
  pressure_advance::PatternConfig pattern;
  settings::ScanSettings settings;
  std::filesystem::path folder;  ///< is there and empty; receives everything that is recorded
  RunIdentity identity;          ///< its run, started and state_folder are asked for
  bool print = true;
  bool scan = true;
  /// True if the print is for a photo, not for a scan: no laser is needed, and the end G-code
  /// switches everything off. REQUIRES that nothing is scanned.
  bool for_photo = false;
  std::string filament;  ///< that is printed, as its owner calls it; empty: nobody named it
  /// Called right before the print begins, when hot, and after its success; an error ends the run.
  std::function<Result<void>(bool ended)> note_print = {};
  /// Pattern on the plate; absent: as in `pattern`. REQUIRES that nothing is printed.
  std::optional<pressure_advance::PatternPlan> plan;
  std::optional<int> only;  ///< of the plan's patterns; absent: all of them are scanned
  /// Existing empty folders, one for each of the pattern's conditions: each pattern is scanned into
  /// its own as if alone on the plate, with a plan beside it. Empty: all lines are recorded in
  /// `folder`. REQUIRES that `pattern` is printed and scanned.
  std::vector<std::filesystem::path> folders = {};
};

/// Good: the request's folder holds a whole recording.
struct CalibrationOutcome : GuardedOutcome {
  double bed_c = 0;  ///< bed temperature while an unscanned pattern remains on it
};

/// Runs the steps of the request. Nothing moves before every check has passed and the camera has
/// sent a picture. In any case restores laser, lights, pressure advance, limits, heater targets and
/// G-code state (PrinterStateGuard); recorded data remain in the folder. If a pattern with its own
/// folder cannot be assigned to its motion (kMeasurement), the others are still scanned; the last
/// such error is the outcome if all failed. The bed remains warm only for a pattern printed for a
/// later scan, which it holds.
[[nodiscard]] CalibrationOutcome Calibrate(const Session& session,
                                           const CalibrationRequest& request);

}  // namespace trammel::procedure
