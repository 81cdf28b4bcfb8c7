// Compares a print's requirements with the printer's stated configuration.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer_facts.h"
#include "session/checks.h"
#include "session/session.h"
#include "settings/printer.h"

namespace trammel::procedure {

/// Speed and acceleration that a print needs; 0: no requirement.
struct NeededMotion {
  double speed_mm_s = 0;
  double acceleration_mm_s2 = 0;
};

/// Requirements of a print on the printer. Default values require nothing.
struct PrintNeeds {
  std::vector<NeededMotion> motions;
  std::string motion_settings = "segments and acceleration of [pressure_advance_pattern]";
  /// True if it was printed before: then the limits of printer.cfg may have been in force.
  bool printed_before = false;
  double filament_diameter_mm = 0;
  double nozzle_diameter_mm = 0;
  double bead_mm2 = 0;           ///< cross-section of its beads
  double pushed_alone_mm = 0;    ///< the longest piece of filament that moves without the head
  double pushed_alone_mm_s = 0;  ///< and its speed; 0: any will do
  bool rectangular_bed = false;
  /// True if it changes the pressure advance, of these motors by their EXTRUDER= names; none: of
  /// the active extruder's own.
  bool sets_pressure_advance = false;
  std::vector<std::string> advance_motors;
};

/// Queries the printer. Errors: kMachine, kInterrupted.
/// @param extruder  whose facts; empty: the active one's
[[nodiscard]] Result<machine::PrinterFacts> ReadFacts(const Session& session,
                                                      const std::string& extruder = {});

/// Returns one check for each requirement that the printer states; a failed one is unsafe, and
/// names the printer's value, the print's and the remedy. Also fails a printer without the facts of
/// every Klipper (limits, nozzle, filament).
[[nodiscard]] std::vector<Check> CompareFacts(const machine::PrinterFacts& facts,
                                              const PrintNeeds& needs);

/// Checks that one pressure advance can be measured and set, on which motors it acts, and that
/// `motors` are these if there are several.
[[nodiscard]] Check ComparePressureAdvance(const machine::PrinterFacts& facts,
                                           const std::vector<std::string>& motors);

/// Checks that the printer can heat to the filament's temperatures: at least its extruder's minimum
/// to push filament, at most the limits of nozzle and bed. Without a material it is advice.
[[nodiscard]] Check CompareTemperatures(const machine::PrinterFacts& facts,
                                        const settings::FilamentSettings& filament);

/// "extruder", "extruder and extruder_stepper belted": the sections of printer.cfg that keep the
/// pressure advance.
[[nodiscard]] std::string AdvanceSections(const machine::PrinterFacts& facts);

}  // namespace trammel::procedure
