// Room on the disk: which raw data of old recordings may go.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace trammel::files {

/// The raw data of one recording: videos, frames, samples. Never its result, report, plan or
/// settings.
struct RawData {
  std::filesystem::path folder;
  std::string utc;  ///< of its result
  std::vector<std::filesystem::path> files;
  std::uintmax_t bytes = 0;
};

struct PruningPlan {
  std::vector<RawData> gone;        ///< the oldest first
  std::uintmax_t bytes_before = 0;  ///< of all recordings that have a result
  std::uintmax_t bytes_after = 0;
};

/// Chooses raw data, the oldest first, until the recordings take at most `budget_bytes` together.
/// Looks at folders right below `recordings` that hold a result.json of ours, at ordinary files in
/// them and in their folders, and follows no link. The newest `keep_last` recordings stay whole,
/// and so does one without a result: it may be at work.
/// Errors (kInput): no such folder, not readable.
[[nodiscard]] Result<PruningPlan> PlanPruning(const std::filesystem::path& recordings,
                                              std::uintmax_t budget_bytes, std::size_t keep_last);

/// Removes what the plan names. A file that has gone by itself is no error; the first that cannot
/// be removed is one, and those before it are gone.
[[nodiscard]] Result<void> Prune(const PruningPlan& plan);

}  // namespace trammel::files
