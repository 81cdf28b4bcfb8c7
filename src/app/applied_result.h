// What was set on which machine, noted for `trammel history`.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::app {

/// A value that is set on a machine.
struct AppliedValue {
  measurement::Instrument instrument = measurement::Instrument::kPressureAdvance;
  std::optional<measurement::Outcome> result = {};  ///< absent: it was typed
  std::string machine;                              ///< its address
  std::optional<double> value = {};  ///< in the unit of the first answer; absent: of several
};

/// Notes in the state folder, on the disk, that a value is about to be set on a machine.
/// @param before       what is in force there, in the value's unit; absent: not told.
/// @param before_each  the same for each part that gets the value, where there are several.
/// Error: it cannot be noted, with what to do; nothing must be set then.
[[nodiscard]] Result<void> NoteBegun(const AppliedValue& applied, std::optional<double> before,
                                     const std::map<std::string, double>& before_each = {});

/// Notes in the state folder that a value was set on a machine, now. Says on standard error where
/// it cannot be noted: what was set stays set.
void NoteApplied(const AppliedValue& applied);

/// What became of a value that was about to be set on a machine, or taken back, where the run ended
/// before it noted that: what is in force, and what to do. Empty where nothing is open.
/// @param now   in force on the machine; absent: not told, and then nothing is noted
/// @param note  notes what it finds, too. REQUIRES the machine's lock then.
/// Errors: kInput where it cannot be read or noted.
[[nodiscard]] Result<std::string> SettleUnfinished(measurement::Instrument instrument,
                                                   const std::string& machine,
                                                   std::optional<double> now, bool note);

/// What was in force before the last value of an instrument was set on a machine.
struct Undoing {
  double before = 0;
  std::optional<double> value = {};                ///< what was set
  std::string utc;                                 ///< when
  bool undone = false;                             ///< it was taken back
  std::string fingerprint;                         ///< of the result; empty: of none
  std::map<std::string, double> before_each = {};  ///< where the value was set on several parts
};

/// The last value that was set. One that was about to be, and is not in force while what was before
/// it is, was not set: the one before it counts then.
/// @param now  in force on the machine; absent: not told
/// Errors: kInput where nothing is noted, or not what was in force before.
[[nodiscard]] Result<Undoing> LastToUndo(measurement::Instrument instrument,
                                         const std::string& machine, std::optional<double> now);

/// Notes, on the disk, that the last value is about to be taken back. Errors: as NoteBegun.
[[nodiscard]] Result<void> NoteUndoing(measurement::Instrument instrument,
                                       const std::string& machine, const Undoing& undoing);

/// Notes that it was taken back, now. Says on standard error where it cannot be noted.
void NoteUndone(measurement::Instrument instrument, const std::string& machine,
                const Undoing& undoing);

/// Notes that the last values of an instrument with several were taken back, now. Says on standard
/// error where it cannot be noted.
void NoteLastUndone(measurement::Instrument instrument, const std::string& machine);

}  // namespace trammel::app
