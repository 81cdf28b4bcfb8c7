// Bounds what clients of a service can have it keep on the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace trammel::service {

struct RunBudget {
  std::size_t most_runs_a_day = 200;                           ///< that left a folder
  std::uintmax_t most_copied_bytes = std::uintmax_t{2} << 30;  ///< of uploads, in all runs
};

/// Looks whether one more run may begin, and removes copies of uploads, the oldest first, until all
/// of them fit the budget: photo.jpg, scan-2.pdf. Looks at folders with the names of runs alone,
/// and follows no link.
/// @param utc_now  ISO 8601, ending in Z
/// Errors (kMeasurement): the day's runs have begun.
[[nodiscard]] Result<void> MakeRoomForRun(const std::filesystem::path& recordings,
                                          const std::string& utc_now, const RunBudget& budget = {});

}  // namespace trammel::service
