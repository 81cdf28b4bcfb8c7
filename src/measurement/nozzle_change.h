// When a printer's nozzle was changed: a file of JSON lines that only grows. What was measured with
// the nozzle before says nothing of this one.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::files {

/// Beside history.jsonl.
inline constexpr std::string_view kNozzlesFile = "nozzles.jsonl";

struct NozzleChange {
  std::string utc;      ///< ISO 8601 to the second, ending in Z
  std::string printer;  ///< as measurement::Subject has it
};

/// Adds a line to nozzles.jsonl. Errors: those of AppendLine.
[[nodiscard]] Result<void> NoteNozzleChange(const std::filesystem::path& path,
                                            const NozzleChange& change);

/// The time of a printer's last change at or before `until_utc`; empty where none is noted, or the
/// file is not there. Lines that are no change are passed over. Errors: those of ReadHistory.
/// Memory: a line of at most 1 MiB, however large the file.
[[nodiscard]] Result<std::string> LastNozzleChange(const std::filesystem::path& path,
                                                   std::string_view printer,
                                                   std::string_view until_utc);

}  // namespace trammel::files
