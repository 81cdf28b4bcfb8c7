// Results in a folder of recordings, and how a new result differs from earlier ones.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "measurement/change.h"
#include "measurement/history.h"

namespace trammel::app {

/// Reads a folder's results and which of them were applied. Prints to standard error which results
/// cannot be read, and why history.db is not used. Errors: those of files::ReadHistory,
/// files::StateFolder and files::AddApplications.
[[nodiscard]] Result<files::History> ReadKept(const std::filesystem::path& recordings,
                                              const files::HistoryQuery& query);

/// True if a result was set on the machine that it was measured on.
[[nodiscard]] bool WasApplied(const files::HistoryEntry& entry);

/// Returns the last nozzle change of a printer before a result; null: none is recorded.
[[nodiscard]] const files::NozzleChange* NozzleChangeBefore(const files::History& history,
                                                            const std::string& printer,
                                                            std::int64_t order);

/// Compares a result with the mean of the last 100 earlier ones of the same instrument, printer,
/// nozzle and filament, since the last nozzle change. Empty if there are too few, or the measured
/// object is not recorded.
/// @param now  of the history, or not in it yet
[[nodiscard]] std::vector<measurement::Change> CompareWithEarlier(const files::History& history,
                                                                  const files::HistoryEntry& now);

/// Prints the result of CompareWithEarlier: a single value, or of several those that changed.
/// Prints nothing on failure, since the answer is valid without it.
void PrintDrift(const std::filesystem::path& recordings, const measurement::Outcome& now);

/// "+0.0017 s (95 %: -0.0004 to +0.0038 s)" and whether that is a change: of Compare.
[[nodiscard]] std::string ChangeText(const measurement::Change& change);

/// Describes the change against the mean of earlier results and their number: of Drift.
[[nodiscard]] std::string DriftText(const measurement::Change& change);

}  // namespace trammel::app
