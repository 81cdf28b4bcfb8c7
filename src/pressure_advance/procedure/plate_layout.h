// Several patterns beside one another, wherever nozzle and camera reach all of them.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "machine/moonraker/printer.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "pressure_advance/recording/scan.h"
#include "pressure_advance/timing/sweep_timing.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Patterns that one plate may be asked for.
inline constexpr int kFewestPatterns = 2;
inline constexpr int kMostPatterns = 9;

/// Lays `count` patterns of these settings beside one another in the grid with the shortest
/// diagonal that fits: as near the middle of the bed as bed, nozzle and camera let them, or with
/// its front left corner where position_x and position_y put it.
/// @param one  valid settings of one pattern; its columns and rows are 1
/// @param option  of the command line that asks for so many
/// Errors: kInput where the settings lay a grid themselves; those of PlanSweeps, also where one
/// pattern alone does not fit; kSafety where `count` do not, with the number that does.
[[nodiscard]] Result<pressure_advance::PatternConfig> PatternsBeside(
    const pressure_advance::PatternConfig& one, int count, const settings::ScanSettings& settings,
    const Reach& reach, const std::string& option = "--repeat");

// From what was recorded of a sweep to frames with positions along the line.

/// The moves of the head as ways along a run (PathOf), which of a run of one line are
/// positions of the laser along it, on the host's clock.
/// @param gcode_origin_mm  where G-code's origin lies in the toolhead's coordinates, in which the
///                         moves are (SET_GCODE_OFFSET): lines were printed and swept in G-code's.
[[nodiscard]] std::vector<pressure_advance::LineMove> AlongLine(
    std::span<const machine::TrapezoidMove> moves, std::span<const Sweep> run,
    const machine::ClockRelation& clock, const std::array<double, 4>& gcode_origin_mm);

/// Whether the moves lead from a run's begin to its end without a gap, and the head stands there:
/// no more of them are to be told.
[[nodiscard]] bool IsWhole(std::span<const pressure_advance::LineMove> moves,
                           std::span<const Sweep> run);

/// How frames and motion are compared: when each frame came, and how much it differs from the one
/// before. Decodes every frame. Errors: a picture that cannot be decoded.
[[nodiscard]] Result<pressure_advance::SweepObservation> Observe(
    std::span<const machine::CapturedFrame> frames, std::vector<pressure_advance::LineMove> motion);

/// Positions along one line of a run, for scan.json: those of frames that certainly moved at the
/// sweep's speed, and along this line.
[[nodiscard]] std::vector<std::optional<double>> ScoredPositions(
    const pressure_advance::SweepTiming& timing, const SweptStretch& line);

/// What fraction of the pixels became at least 30 levels redder.
[[nodiscard]] Result<double> Reddened(const machine::CapturedFrame& before,
                                      const machine::CapturedFrame& after);

}  // namespace trammel::procedure
