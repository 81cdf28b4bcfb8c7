// Several patterns beside one another, where nozzle and camera reach all of them.
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

/// Minimum number of patterns on one plate.
inline constexpr int kFewestPatterns = 2;
inline constexpr int kMaxPatterns = 9;

/// Arranges `count` patterns of these settings in the grid with the shortest diagonal that fits: as
/// near to the bed's centre as bed, nozzle and camera allow, or with its front left corner at
/// position_x and position_y.
/// @param one  valid settings of one pattern; its columns and rows are 1
/// @param option  of the command line that sets the count
/// Errors: kInput if the settings define a grid themselves; those of PlanSweeps, also if one
/// pattern alone does not fit; kSafety if `count` do not fit, with the number that does.
[[nodiscard]] Result<pressure_advance::PatternConfig> PatternsBeside(
    const pressure_advance::PatternConfig& one, int count, const settings::ScanSettings& settings,
    const Reach& reach, const std::string& option = "--repeat");

// Positions of a sweep's frames along the line, from the recording.

/// Converts the head's moves to distances along a run (PathOf), which for a run of one line are
/// positions of the laser along it, on the host's clock.
/// @param gcode_origin_mm  G-code's origin in the toolhead's coordinates, which the moves use
///                         (SET_GCODE_OFFSET): lines were printed and swept in G-code's.
[[nodiscard]] std::vector<pressure_advance::LineMove> AlongLine(
    std::span<const machine::TrapezoidMove> moves, std::span<const Sweep> run,
    const machine::ClockRelation& clock, const std::array<double, 4>& gcode_origin_mm);

/// True if the moves lead from a run's start to its end without a gap, and the head has stopped
/// there: no more of them will be reported.
[[nodiscard]] bool IsWhole(std::span<const pressure_advance::LineMove> moves,
                           std::span<const Sweep> run);

/// Measures when each frame came, and how much it differs from the one before, for comparison with
/// the motion. Decodes every frame. Errors: a picture that cannot be decoded.
[[nodiscard]] Result<pressure_advance::SweepObservation> Observe(
    std::span<const machine::CapturedFrame> frames, std::vector<pressure_advance::LineMove> motion);

/// Returns the positions along one line of a run, for scan.json: those of frames that certainly
/// moved at the sweep's speed, and along this line.
[[nodiscard]] std::vector<std::optional<double>> ScoredPositions(
    const pressure_advance::SweepTiming& timing, const SweptStretch& line);

/// Computes the fraction of pixels at least 30 levels redder.
[[nodiscard]] Result<double> Reddened(const machine::CapturedFrame& before,
                                      const machine::CapturedFrame& after);

}  // namespace trammel::procedure
