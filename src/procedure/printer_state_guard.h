// Leaves the printer as it was found, whatever happens in between.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "machine/printer.h"
#include "pressure_advance/scan_settings.h"
#include "procedure/session.h"

namespace trammel::procedure {

/// Remembers pressure advance, velocity limits, heater targets and G-code state, and brings them
/// back: on purpose by Restore(), or by the destructor where something went wrong before. The laser
/// goes off first.
class Keeper {
 public:
  /// Reads what has to come back, and saves the G-code state under a name of its own.
  [[nodiscard]] static Result<Keeper> Remember(const Session& session,
                                               const pressure_advance::ScanSettings& settings);

  Keeper(Keeper&& other) noexcept;
  Keeper& operator=(Keeper&&) = delete;
  ~Keeper();

  /// Cancels a print that still runs (nobody else's: the printer was idle) and brings everything
  /// back once; a second call does nothing. Ignores the session's stop: a stopped calibration ends
  /// safe too. Waits `kReturn_s` for a lost connection, and begins anew where it is lost again
  /// meanwhile. A printer that was restarted keeps its heaters off. Where the laser cannot be
  /// switched off, the printer is stopped.
  /// @returns one sentence for each thing that could not be brought back; empty: all is as it was.
  [[nodiscard]] std::vector<std::string> Restore();

  [[nodiscard]] const machine::PrinterState& before() const { return before_; }

  /// How long a lost connection or a restart may take to come back.
  static constexpr double kReturn_s = 120;

 private:
  Keeper(const Session& session, const pressure_advance::ScanSettings& settings,
         machine::PrinterState before);

  [[nodiscard]] std::vector<std::string> BringBack();
  [[nodiscard]] std::vector<std::string> LaserStaysOn(const std::string& why);
  [[nodiscard]] std::vector<std::string> Script(bool restarted) const;

  machine::Printer* printer_;  // nullptr once restored
  std::function<void(const Progress&)> tell_;
  std::string laser_off_gcode_;
  std::string lights_on_gcode_;
  bool has_limit_ = false;
  machine::PrinterState before_;
};

}  // namespace trammel::procedure
