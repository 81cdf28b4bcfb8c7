// Log of the values set on each machine, for `trammel history`.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::app {

/// Value set on a machine.
struct AppliedValue {
  measurement::Instrument instrument = measurement::Instrument::kPressureAdvance;
  std::optional<measurement::Outcome> result = {};  ///< absent: it was typed
  std::string machine;                              ///< machine's address
  std::optional<double> value = {};  ///< in the first answer's unit; absent: several parts
};

/// Records durably in the state folder that a value is about to be set on a machine.
/// @param before       value in force, in the value's unit; absent: unknown.
/// @param before_each  the same per part, where several parts get the value.
/// Error: it cannot be recorded, with the remedy; nothing may be set then.
[[nodiscard]] Result<void> NoteBegun(const AppliedValue& applied, std::optional<double> before,
                                     const std::map<std::string, double>& before_each = {});

/// Records in the state folder that a value was set on a machine, now. A failure is only printed to
/// standard error: the value remains set.
void NoteApplied(const AppliedValue& applied);

/// Finds the outcome of a run that ended before it noted whether it set or restored a value.
/// Returns the value in force and the next step for the user; empty if nothing is open.
/// @param now   in force on the machine; absent: unknown, and then nothing is noted
/// @param note  also notes the outcome. REQUIRES the machine's lock then.
/// Errors: kInput if it cannot be read or noted.
[[nodiscard]] Result<std::string> SettleUnfinished(measurement::Instrument instrument,
                                                   const std::string& machine,
                                                   std::optional<double> now, bool note);

/// Value in force before an instrument's last value was set on a machine.
struct Undoing {
  double before = 0;
  std::optional<double> value = {};                ///< value that was set
  std::string utc;                                 ///< time, UTC
  bool undone = false;                             ///< it was taken back
  std::string fingerprint;                         ///< of the result; empty: no result
  std::map<std::string, double> before_each = {};  ///< previous value per part, if set on several
};

/// Returns the last value that was set. A value counts as not set if it was only announced and the
/// value before it is still in force; the one before it is returned then.
/// @param now  in force on the machine; absent: unknown
/// Errors: kInput if nothing is recorded, or the value before it is not.
[[nodiscard]] Result<Undoing> LastToUndo(measurement::Instrument instrument,
                                         const std::string& machine, std::optional<double> now);

/// Records durably that the last value is about to be restored. Errors: as NoteBegun.
[[nodiscard]] Result<void> NoteUndoing(measurement::Instrument instrument,
                                       const std::string& machine, const Undoing& undoing);

/// Records that the value was restored, now. A failure is only printed to standard error.
void NoteUndone(measurement::Instrument instrument, const std::string& machine,
                const Undoing& undoing);

/// Records that the last values of an instrument with several were restored, now. A failure is only
/// printed to standard error.
void NoteLastUndone(measurement::Instrument instrument, const std::string& machine);

}  // namespace trammel::app
