// Compares what a print takes for granted with what the printer states of itself.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer_facts.h"
#include "session/checks.h"
#include "session/session.h"
#include "settings/printer.h"

namespace trammel::procedure {

/// A speed and an acceleration that a print needs; 0: any will do.
struct NeededMotion {
  double speed_mm_s = 0;
  double acceleration_mm_s2 = 0;
};

/// What a print takes for granted. What is at its default takes nothing for granted.
struct PrintNeeds {
  std::vector<NeededMotion> motions;
  std::string motion_settings = "segments and acceleration of [pressure_advance_pattern]";
  /// It was printed before: then the limits of printer.cfg may have been in force.
  bool printed_before = false;
  double filament_diameter_mm = 0;
  double nozzle_diameter_mm = 0;
  double bead_mm2 = 0;           ///< cross-section of its beads
  double pushed_alone_mm = 0;    ///< the longest piece of filament that moves without the head
  double pushed_alone_mm_s = 0;  ///< and its speed; 0: any will do
  bool rectangular_bed = false;
  /// It changes the pressure advance, of these motors as EXTRUDER= names them; none: of the active
  /// extruder's own.
  bool sets_pressure_advance = false;
  std::vector<std::string> advance_motors;
};

/// Asks the printer. Errors: kMachine, kInterrupted.
/// @param extruder  whose facts; empty: the active one's
[[nodiscard]] Result<machine::PrinterFacts> ReadFacts(const Session& session,
                                                      const std::string& extruder = {});

/// One check for each thing that the print needs and the printer states; all that is not passed is
/// unsafe, and names the printer's value, the print's and the remedy. A printer that does not state
/// what every Klipper does (limits, nozzle, filament) is refused, too.
[[nodiscard]] std::vector<Check> CompareFacts(const machine::PrinterFacts& facts,
                                              const PrintNeeds& needs);

/// That there is one pressure advance that can be measured and set, on which motors it acts, and
/// that `motors` are these where there are several.
[[nodiscard]] Check ComparePressureAdvance(const machine::PrinterFacts& facts,
                                           const std::vector<std::string>& motors);

/// That the printer can heat to what the filament asks for: no less than its extruder needs to push
/// filament, and no more than nozzle and bed may have. Without a material it is advice.
[[nodiscard]] Check CompareTemperatures(const machine::PrinterFacts& facts,
                                        const settings::FilamentSettings& filament);

/// "extruder", "extruder and extruder_stepper belted": the sections of printer.cfg that keep the
/// pressure advance.
[[nodiscard]] std::string AdvanceSections(const machine::PrinterFacts& facts);

}  // namespace trammel::procedure
