// The results of a folder of recordings, and how a new one differs from the earlier ones.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "measurement/change.h"
#include "measurement/history.h"

namespace trammel::app {

/// Reads a folder's results, with what was applied of them. Names on standard error results that
/// cannot be read, and why history.db is not used. Errors: those of files::ReadHistory,
/// files::StateFolder and files::AddApplications.
[[nodiscard]] Result<files::History> ReadKept(const std::filesystem::path& recordings,
                                              const files::HistoryQuery& query);

/// Whether a result was set on the machine that it was measured on.
[[nodiscard]] bool WasApplied(const files::HistoryEntry& entry);

/// The last change of a printer's nozzle before a result; null: none is noted.
[[nodiscard]] const files::NozzleChange* NozzleChangeBefore(const files::History& history,
                                                            const std::string& printer,
                                                            std::int64_t order);

/// Compares a result with the mean of the last 100 earlier ones of the same instrument, printer,
/// nozzle and filament, none from before the nozzle was changed. Empty where too few of them are
/// kept, or nothing is noted of what was measured.
/// @param now  of the history, or not in it yet
[[nodiscard]] std::vector<measurement::Change> CompareWithEarlier(const files::History& history,
                                                                  const files::HistoryEntry& now);

/// Prints what CompareWithEarlier finds: the one answer, or of several those that changed. Says
/// nothing where it cannot: the answer stands without it.
void PrintDrift(const std::filesystem::path& recordings, const measurement::Outcome& now);

/// "+0.0017 s (95 %: -0.0004 to +0.0038 s)" and whether that is a change: of Compare.
[[nodiscard]] std::string ChangeText(const measurement::Change& change);

/// The same against the mean of how many earlier results: of Drift.
[[nodiscard]] std::string DriftText(const measurement::Change& change);

}  // namespace trammel::app
