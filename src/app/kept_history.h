// The results beside a folder of recordings, and how a new one differs from the earlier ones.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "measurement/change.h"
#include "measurement/history.h"

namespace trammel::app {

/// Reads a folder's results through its index; from history.jsonl itself where that cannot be
/// used, which standard error is told.
/// @param path  history.jsonl, or its folder. Errors: those of files::ReadHistory.
[[nodiscard]] Result<files::History> ReadKept(const std::filesystem::path& path,
                                              const files::HistoryQuery& query);

/// Compares a result with the last 100 before it of the same instrument, printer, nozzle and
/// filament. Empty where too few of them are kept, or nothing is noted of what was measured.
/// Errors: those of ReadKept.
[[nodiscard]] Result<std::vector<measurement::Change>> DriftOf(const std::filesystem::path& path,
                                                               const measurement::Outcome& now);

/// Prints what DriftOf finds: the one answer, or of several those that changed. Says nothing where
/// it cannot: the answer stands without it.
void PrintDrift(const std::filesystem::path& recordings, const measurement::Outcome& now);

/// "+0.0017 s (95 %: -0.0004 to +0.0038 s)" and whether that is a change: of Compare.
[[nodiscard]] std::string ChangeText(const measurement::Change& change);

/// The same against the mean of how many earlier results: of Drift.
[[nodiscard]] std::string DriftText(const measurement::Change& change);

}  // namespace trammel::app
