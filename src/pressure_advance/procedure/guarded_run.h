// Runs a procedure on a printer that it has to itself: what comes before the first step, and what
// is brought back after the last.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "session/frame_recorder.h"
#include "session/guarded_steps.h"
#include "session/printer_state_guard.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

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
  std::string run;                     ///< unique; as files::IsRunName wants it
  std::string started;                 ///< date and time, for people
  std::filesystem::path state_folder;  ///< of journals and locks; empty: files::StateFolder()
  bool prints = true;                  ///< a file of the run's own is uploaded
  bool looks = true;                   ///< through the camera
  bool for_photo = false;  ///< the printer may have no laser, and the print ends with all off
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

}  // namespace trammel::procedure
