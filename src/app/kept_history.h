// Results in a folder of recordings, as commands print them.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "measurement/history.h"
#include "measurement/outcome.h"

namespace trammel::app {

/// Reads a folder's results and which of them were applied. Prints to standard error which results
/// cannot be read, and why history.db is not used. Errors: those of files::ReadHistory,
/// files::StateFolder and files::AddApplications.
[[nodiscard]] Result<files::History> ReadKept(const std::filesystem::path& recordings,
                                              const files::HistoryQuery& query);

/// Prints the result of service::CompareWithEarlier: a single value, or of several those that
/// changed. Prints nothing on failure, since the answer is valid without it.
void PrintDrift(const std::filesystem::path& recordings, const measurement::Outcome& now);

}  // namespace trammel::app
