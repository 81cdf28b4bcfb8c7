// snoozed.jsonl: what is not to be said to be due for a while.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::files {

/// In the state folder: a line of each snooze; the last one that means a thing holds.
inline constexpr std::string_view kSnoozedFile = "snoozed.jsonl";

struct Snooze {
  std::string until_utc;                                   ///< ISO 8601, ending in Z
  std::optional<measurement::Instrument> instrument = {};  ///< absent: of any
  measurement::Subject subject = {};  ///< its texts that are not empty; others are any
};

/// Adds a line. Errors: those of AppendLine.
[[nodiscard]] Result<void> NoteSnooze(const std::filesystem::path& path, const Snooze& snooze);

/// The time until which a thing is snoozed; empty: it is not, or the file is not there. Lines that
/// are no snooze are passed over. Errors: those of ForEachLine.
[[nodiscard]] Result<std::string> SnoozedUntil(const std::filesystem::path& path,
                                               measurement::Instrument instrument,
                                               const measurement::Subject& subject);

}  // namespace trammel::files
