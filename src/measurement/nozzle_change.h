// When a printer's nozzle was changed: a file of JSON lines that only grows. What was measured with
// the nozzle before says nothing of this one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::files {

/// Beside history.jsonl.
inline constexpr std::string_view kNozzlesFile = "nozzles.jsonl";

struct NozzleChange {
  std::string utc;      ///< ISO 8601 to the second, ending in Z
  std::string printer;  ///< as measurement::Subject has it
  /// Lines that history.jsonl had then: what was measured before stands in them, whatever the clock
  /// of a computer without a battery made of `utc`. Absent: not noted (earlier programs), or read
  /// from a history that has none.
  std::optional<std::size_t> results = {};
};

inline constexpr std::size_t kStillToCome = std::numeric_limits<std::size_t>::max();

/// When something was measured.
struct MeasuredAt {
  std::string utc;
  /// Of history.jsonl, from 1; kStillToCome: it has none yet; absent: not known.
  std::optional<std::size_t> line = {};
};

/// Whether a change came after a measurement: by their order in the files where it is known.
[[nodiscard]] bool IsAfter(const NozzleChange& change, const MeasuredAt& measured);

/// The changes of a printer that are noted in a day at most, and lines of the file at most: the
/// oldest go.
inline constexpr std::size_t kMostChangesADay = 20;
inline constexpr std::size_t kMostChanges = 1000;

/// Adds a line to nozzles.jsonl, with the number of lines of history.jsonl beside it. Errors: those
/// of AppendLine and WriteWholeFile; kMeasurement: kMostChangesADay are noted of that day.
[[nodiscard]] Result<void> NoteNozzleChange(const std::filesystem::path& path,
                                            const NozzleChange& change);

/// A printer's last change that is not after a measurement, by the order of the lines; absent where
/// none is noted, or the file is not there. Lines that are no change are passed over. Errors: those
/// of ReadHistory. Memory: a line of at most 1 MiB, however large the file.
[[nodiscard]] Result<std::optional<NozzleChange>> LastNozzleChange(
    const std::filesystem::path& path, std::string_view printer, const MeasuredAt& before);

}  // namespace trammel::files
