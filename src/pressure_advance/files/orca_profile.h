// Filament profile of OrcaSlicer, with a measured pressure advance.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "pressure_advance/flow/flow_table.h"

namespace trammel::files {

struct OrcaProfile {
  std::string text;                  ///< JSON, its keys in the order of the original
  std::vector<std::string> notices;  ///< other necessary changes
};

/// Returns the rows of OrcaSlicer's adaptive pressure advance, a line each: value in s, flow in
/// mm³/s, acceleration in mm/s². The slicer accepts a wrong order silently.
[[nodiscard]] std::string AdaptiveModel(std::span<const pressure_advance::FlowPoint> rows);

/// Sets `enable_pressure_advance` and `pressure_advance` in a filament profile exported by
/// OrcaSlicer (JSON; each value a text or a list of texts), for each extruder of the profile.
/// Adaptive pressure advance, which would override the value, is switched off with a notice; with
/// rows it is switched on and they become its model. All else is unchanged, so that the slicer's
/// import behaves as before.
/// @param file                name in messages.
/// @param pressure_advance_s  0 … 2 s, the slicer's range; written to 0.1 ms.
/// @param rows                over flow and acceleration, at least two flows for each: the slicer
///                            silently drops others. Empty: only the one value.
/// Errors (kInput): rows of an acceleration with one flow; no JSON object, no filament profile, a
/// value that is no text; the number.
[[nodiscard]] Result<OrcaProfile> WithPressureAdvance(
    std::string_view profile, const std::string& file, double pressure_advance_s,
    std::span<const pressure_advance::FlowPoint> rows = {});

}  // namespace trammel::files
