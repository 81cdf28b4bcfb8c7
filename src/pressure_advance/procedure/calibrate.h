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

// Runs a procedure on a printer that it has to itself: what comes before the first step, and what
// is brought back after the last.

/// A camera that sends pictures. Both are absent where none is looked through.
struct Eye {
  std::unique_ptr<machine::FrameSource> camera;
  std::unique_ptr<FrameRecorder> recorder;

  /// As the camera describes itself; empty without one.
  [[nodiscard]] std::string Describe() const;
};

/// Views are not owned.
struct GuardedRun {
  const pressure_advance::PatternConfig* pattern = nullptr;  ///< REQUIRED: where the head parks
  const settings::ScanSettings* settings = nullptr;          ///< REQUIRED
  RunIdentity identity;                                      ///< as in GuardedSteps
  bool looks = true;                                         ///< through the camera
  /// Moves nothing; an error ends the run before anything was changed.
  std::function<Result<void>(const Session&)> check;
  /// The procedure's own steps, on a homed printer.
  std::function<Result<void>(const Session&, PrinterStateGuard&, const Eye&)> steps;
};

/// Checks, takes the printer, opens the camera and homes where an axis is not, then runs the steps.
/// Nothing moves before every check has passed and the camera has sent a picture. Whatever happens,
/// laser, lights, pressure advance, limits, heater targets and G-code state come back
/// (PrinterStateGuard).
/// @param session  receives what the run is called at the printer (PrinterStateGuard::Take).
[[nodiscard]] GuardedOutcome RunGuarded(Session& session, const GuardedRun& run);

/// The camera that the settings name, or the webcam that the printer's server lists.
[[nodiscard]] Result<std::unique_ptr<machine::FrameSource>> OpenCamera(
    const Session& session, const settings::ScanSettings& settings);

// The nozzle before a scan: it must not ooze over the pattern.

/// Cools the active extruder to a temperature and waits for it; one that is colder already stays
/// as it is. 0: switches it off and waits for nothing.
[[nodiscard]] Result<void> CoolForScan(const Session& session, const machine::PrinterState& state,
                                       double nozzle_c, double time_limit_s);

// A photo of the printed pattern, from where its owner left it.

struct PatternPhoto {
  std::string name;  ///< of the file, without a folder
  std::string bytes;
  /// When the file was stored, by ServerTime_s' clock; absent where it was named, or not told.
  std::optional<double> stored_s = {};
};

/// The clock by which the printer's server dates its files, s since 1970, at most some two seconds
/// late; absent where it is not told.
[[nodiscard]] std::optional<double> ServerTime_s(const Session& session);

/// Downloads a photo from the folder beside the printer's configuration.
/// @param name  in it; empty: the picture (JPEG, PNG, WebP, HEIC) that was stored last
/// @param is_result  whether a name is that of a result's picture, which is no photo
/// Errors: kInput: there is none, or it is larger than 64 MiB; kMachine.
[[nodiscard]] Result<PatternPhoto> DownloadPhoto(
    const Session& session, const std::string& name,
    const std::function<bool(const std::string&)>& is_result);

/// What a file's name ends in, in small letters with the dot; empty: not that of a picture.
[[nodiscard]] std::string PictureEnding(const std::string& name);

struct CalibrationRequest {
  pressure_advance::PatternConfig pattern;
  settings::ScanSettings settings;
  std::filesystem::path folder;  ///< is there and empty; receives everything that is recorded
  RunIdentity identity;          ///< its run, started and state_folder are asked for
  bool print = true;
  bool scan = true;
  /// The print is for a photo, not for a scan: no laser is asked for, and the end G-code switches
  /// everything off. REQUIRES that nothing is scanned.
  bool for_photo = false;
  std::string filament;  ///< that is printed, as its owner calls it; empty: nobody named it
  /// Called right before the print begins, when it is hot, and once it has ended well; an error
  /// ends the run.
  std::function<Result<void>(bool ended)> note_print = {};
  /// What lies on the plate; absent: what `pattern` describes. REQUIRES that nothing is printed.
  std::optional<pressure_advance::PatternPlan> plan;
  std::optional<int> only;  ///< of the plan's patterns; absent: all of them are scanned
  /// One for each of the pattern's conditions, there and empty: each pattern is scanned into its
  /// own as if no other lay on the plate, with a plan beside it. Empty: all lines go into `folder`.
  /// REQUIRES that `pattern` is printed and scanned.
  std::vector<std::filesystem::path> folders = {};
};

/// Good: the request's folder holds a whole recording.
struct CalibrationOutcome : GuardedOutcome {
  double bed_c =
      0;  ///< at which the bed is kept, because the pattern lies on it and is not scanned
};

/// Runs the steps that the request names. Nothing moves before every check has passed and the
/// camera has sent a picture. Whatever happens, laser, lights, pressure advance, limits, heater
/// targets and G-code state come back (PrinterStateGuard), and what was recorded stays in the
/// folder. Of patterns with folders of their own one that cannot be tied to its motion
/// (kMeasurement) does not keep the others from being scanned; the last such error is the outcome
/// where none was. Only a pattern that was printed for a later scan keeps the bed warm, which holds
/// it.
[[nodiscard]] CalibrationOutcome Calibrate(const Session& session,
                                           const CalibrationRequest& request);

}  // namespace trammel::procedure
