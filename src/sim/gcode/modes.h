// Modes and shifts that turn the coordinates of G-code into a machine's.
#pragma once

#include <array>
#include <cstddef>

#include "base/result.h"
#include "sim/gcode/command.h"

namespace trammel::sim {

using Axes = std::array<double, 4>;  ///< x, y, z and filament, mm

inline constexpr std::array<const char*, 4> kAxisKeys = {"X", "Y", "Z", "E"};
inline constexpr std::size_t kMaxMoves = 1'000'000;

/// State of Klipper's SAVE_GCODE_STATE. The machine's position is a coordinate plus `base`, plus
/// the caller's shift if it has one.
struct Modes {
  bool absolute = true;
  bool absolute_filament = true;
  Axes base{};
  Axes machine{};
  double extrude_factor = 1;
};

/// Returns the destination of G0 or G1; F is not read. Errors as NumberOf's; within +-10 m, of
/// filament +-1 km.
[[nodiscard]] Result<Axes> TargetOf(const Command& command, const Modes& modes, const Axes& shift,
                                    bool absolute_filament);

/// G92: without a parameter all axes are 0.
[[nodiscard]] Result<void> SetPosition(const Command& command, const Axes& shift, Modes& modes);

/// G28: the named axes, or all, are at 0 then.
void Home(const Command& command, Modes& modes);

/// Takes over what was saved; the machine and its filament stay where they are.
void Restore(const Modes& saved, Modes& modes);

/// Error: a place out of reach, or more moves than a file may have.
[[nodiscard]] Result<void> CheckMove(const Axes& target, std::size_t moves, int line);

}  // namespace trammel::sim
