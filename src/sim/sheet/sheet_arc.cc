// Arcs of RepRapFirmware, as the chords that a machine makes of them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/sheet/sheet_interpreter.h"

namespace trammel::sim::sheet {
namespace {

constexpr Bound kCentreMm{-1e4, 1e4};
constexpr double kSagMm = 0.0005;      // of a chord below its arc
constexpr double kOffCircleMm = 0.05;  // by which an arc's two radii may differ
constexpr double kSmallestMm = 0.01;
constexpr double kLongestChordRad = 0.35;

}  // namespace

Result<void> Interpreter::Arc(const Command& command) {
  if (setup_.firmware != SheetFirmware::kRepRapFirmware || command.has("R")) return Refuse(command);
  const Axes start = state_.machine;
  Axes target = start;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto number = TRY(NumberOf(command, kAxisKeys[axis], kCentreMm));
    if (!number.has_value()) continue;
    target[axis] =
        *number + (state_.modes.absolute ? state_.origin[axis] + ShiftOf(axis) : start[axis]);
  }
  const auto filament = NumberOf(command, "E", {-1e6, 1e6});
  const auto i = NumberOf(command, "I", kCentreMm);
  const auto j = NumberOf(command, "J", kCentreMm);
  for (const auto* number : {&filament, &i, &j}) {
    if (!*number) return tl::unexpected(number->error());
  }
  if (filament->has_value()) {
    target[3] = **filament * state_.extrude_factor +
                (state_.modes.absolute_filament ? state_.origin[3] : start[3]);
  }
  const double centre_x = start[0] + i->value_or(0);
  const double centre_y = start[1] + j->value_or(0);
  const double radius = std::hypot(start[0] - centre_x, start[1] - centre_y);
  const double end_radius = std::hypot(target[0] - centre_x, target[1] - centre_y);
  if (radius < kSmallestMm || std::abs(radius - end_radius) > kOffCircleMm) {
    return Fail(
        fmt::format("G-code line {}: {} has radii of {:.4f} and {:.4f} mm at its ends; "
                    "they must agree within {} mm",
                    command.line, command.name, radius, end_radius, kOffCircleMm));
  }
  const double from = std::atan2(start[1] - centre_y, start[0] - centre_x);
  double sweep = std::atan2(target[1] - centre_y, target[0] - centre_x) - from;
  constexpr double kTurn = 2 * std::numbers::pi;
  if (command.name == "G3") {
    while (sweep <= 1e-9) sweep += kTurn;
  } else {
    while (sweep >= -1e-9) sweep -= kTurn;
  }
  const double chord_rad =
      std::min(kLongestChordRad, 2 * std::acos(std::max(0.0, 1 - kSagMm / radius)));
  const int chords = std::max(2, static_cast<int>(std::ceil(std::abs(sweep) / chord_rad)));
  for (int chord = 1; chord <= chords; ++chord) {
    const double share = static_cast<double>(chord) / chords;
    const double angle = from + share * sweep;
    const double r = radius + share * (end_radius - radius);
    Axes next = target;
    if (chord < chords) {
      next = {centre_x + r * std::cos(angle), centre_y + r * std::sin(angle),
              start[2] + share * (target[2] - start[2]), start[3] + share * (target[3] - start[3])};
    }
    const std::size_t before = program_.moves.size();
    TRY(GoTo(next, command.line));
    if (program_.moves.size() > before) program_.moves.back().arc = true;
  }
  return {};
}

}  // namespace trammel::sim::sheet
