// Pressure advance on a real printer: check, print, cool, scan; analysis and verdict follow.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

struct CalibrationRequest {
  pressure_advance::PatternConfig pattern;
  settings::ScanSettings settings;
  std::filesystem::path folder;        ///< is there and empty; receives everything that is recorded
  std::string started;                 ///< date and time, for the recording
  std::string run;                     ///< unique; as files::IsRunName wants it
  std::filesystem::path state_folder;  ///< of journals and locks; empty: files::StateFolder()
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

struct CalibrationOutcome {
  Result<void> done;                    ///< good: `folder` holds a whole recording
  std::vector<std::string> unrestored;  ///< what could not be brought back to how it was
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
