// Room on the disk: which raw data of old recordings may go.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace trammel::files {

/// The raw data of one recording: videos, and pictures under the names that recordings give them.
/// Nothing else: neither its result, report and plan, nor what somebody else put there; a picture
/// that was written after the result, or a day before it, is somebody else's whatever its name.
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
  int without_result = 0;  ///< folders that were left alone
};

/// Chooses raw data, the oldest first, until the recordings take at most `budget_bytes` together.
/// Looks at folders right below `recordings` that hold a result.json of ours, at ordinary files in
/// them and in their folders, and follows no link. The newest `keep_last` recordings stay whole,
/// and so does one without a result: it may be at work.
/// Errors (kInput): no such folder, not readable.
[[nodiscard]] Result<PruningPlan> PlanPruning(const std::filesystem::path& recordings,
                                              std::uintmax_t budget_bytes, std::size_t keep_last);

/// Removes what the plan names. A file that has gone by itself is no error; one that cannot be
/// removed is, when all others are gone.
[[nodiscard]] Result<void> Prune(const PruningPlan& plan);

}  // namespace trammel::files
