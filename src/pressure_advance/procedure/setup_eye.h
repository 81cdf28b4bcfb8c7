// Takes pictures of a standing head, lit or by the laser alone, and reads them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/guarded_run.h"
#include "pressure_advance/procedure/setup_route.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

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

}  // namespace trammel::procedure
