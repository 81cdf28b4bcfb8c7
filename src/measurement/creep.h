// Drift that creeps: each result within the noise of the one before, the last far from the first.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "measurement/outcome.h"

namespace trammel::measurement {

/// The fewest results through which a line says anything.
inline constexpr std::size_t kFewestForCreep = 5;

/// How often a result of a quantity that stays is called creeping, at most, where results scatter
/// independently of each other.
inline constexpr double kCreepFalseAlarm = 0.002;

/// A quantity of several results in their order.
struct Creep {
  std::string name;
  std::string unit;
  Quantity change;          ///< of the fitted line, from the first result to the last
  std::size_t results = 0;  ///< that the line goes through
  bool creeps = false;      ///< it is not level: kCreepFalseAlarm
};

/// Fits a line over their order to each quantity of results of one thing. Its uncertainty is the
/// wider of two: what the stated uncertainties allow, and what the scatter about the line shows
/// (Student's t). A line that is level by either is called so. The mean of earlier results cannot
/// show this (change.h: Drift): they scatter by the drift itself.
/// @param series  the oldest first; of the same instrument, printer, nozzle and filament.
/// Leaves out quantities that are not good in the last, or in fewer than kFewestForCreep of them.
[[nodiscard]] std::vector<Creep> FindCreep(std::span<const Outcome> series);

}  // namespace trammel::measurement
