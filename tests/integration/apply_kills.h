// trammel pa apply, killed at moments of its whole run.
#pragma once

#include <cstdint>
#include <filesystem>

#include "measurement/outcome_file.h"

namespace trammel::test {

/// A good answer of 1 ms uncertainty.
/// @param minute  of the day, by which results are told apart
[[nodiscard]] measurement::Outcome FoundPressureAdvance(double value_s, int minute = 0);
/// Makes the folder, with this result in it.
void KeepIn(const std::filesystem::path& folder, const measurement::Outcome& outcome);

/// State of the printer after the killed runs.
struct KilledApplies {
  int unnoted = 0;   ///< nothing was begun
  int open = 0;      ///< noted as begun, and not what became of it
  int finished = 0;  ///< noted to its end
};

/// Kills an apply with SIGKILL at moments drawn over its run time, one in each of `kills` equal
/// parts of it, in any order; values that are typed, kept results and --undo in turns. Expects
/// after each that the old value or the new one is in force, that what is in force was noted, that
/// no line is torn for those that follow, and that the next apply says what the killed one left
/// open.
KilledApplies KillApplies(int kills, std::uint64_t seed);

}  // namespace trammel::test
