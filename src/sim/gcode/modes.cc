#include "sim/gcode/modes.h"

#include <fmt/format.h>

namespace trammel::sim {
namespace {

const Bound& BoundOf(std::size_t axis) {
  static constexpr Bound kPositionMm{-1e4, 1e4};
  static constexpr Bound kFilamentMm{-1e6, 1e6};
  return axis < 3 ? kPositionMm : kFilamentMm;
}

}  // namespace

Result<Axes> TargetOf(const Command& command, const Modes& modes, const Axes& shift,
                      bool absolute_filament) {
  Axes target = modes.machine;
  for (std::size_t axis = 0; axis < target.size(); ++axis) {
    const auto number = TRY(NumberOf(command, kAxisKeys[axis], BoundOf(axis)));
    if (!number.has_value()) continue;
    const bool absolute = axis < 3 ? modes.absolute : absolute_filament;
    target[axis] = *number * (axis < 3 ? 1 : modes.extrude_factor) +
                   (absolute ? modes.base[axis] + shift[axis] : target[axis]);
  }
  return target;
}

Result<void> SetPosition(const Command& command, const Axes& shift, Modes& modes) {
  const bool all = command.parameters.empty();
  for (std::size_t axis = 0; axis < modes.base.size(); ++axis) {
    const auto number = TRY(NumberOf(command, kAxisKeys[axis], BoundOf(axis)));
    if (!number.has_value() && !all) continue;
    const double factor = axis == 3 ? modes.extrude_factor : 1;
    modes.base[axis] = modes.machine[axis] - shift[axis] - number.value_or(0) * factor;
  }
  return {};
}

void Home(const Command& command, Modes& modes) {
  const bool all = !command.has("X") && !command.has("Y") && !command.has("Z");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!all && !command.has(kAxisKeys[axis])) continue;
    modes.machine[axis] = 0;
    modes.base[axis] = 0;
  }
}

void Restore(const Modes& saved, Modes& modes) {
  const Axes here = modes.machine;
  modes = saved;
  modes.machine = here;
  modes.base[3] += here[3] - saved.machine[3];
}

Result<void> CheckMove(const Axes& target, std::size_t moves, int line) {
  for (std::size_t axis = 0; axis < target.size(); ++axis) {
    const Bound& bound = BoundOf(axis);
    if (!(target[axis] >= bound.lo && target[axis] <= bound.hi)) {
      return Fail(fmt::format("G-code line {}: {} goes to {} mm; it must lie within {} … {}", line,
                              kAxisKeys[axis], target[axis], bound.lo, bound.hi));
    }
  }
  if (moves < kMaxMoves) return {};
  return Fail(
      fmt::format("G-code line {}: more than {} moves; print a shorter file", line, kMaxMoves));
}

}  // namespace trammel::sim
