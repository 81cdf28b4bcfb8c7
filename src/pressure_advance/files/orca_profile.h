// A filament profile of OrcaSlicer, with a measured pressure advance.
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
  std::vector<std::string> notices;  ///< what else had to change
};

/// Rows as OrcaSlicer's adaptive pressure advance has them, a line each: value in s, flow in mm³/s,
/// acceleration in mm/s². It takes another order without a word.
[[nodiscard]] std::string AdaptiveModel(std::span<const pressure_advance::FlowPoint> rows);

/// Takes a filament profile as OrcaSlicer exports it (JSON; each value a text or a list of texts)
/// and sets `enable_pressure_advance` and `pressure_advance`, for each extruder that the profile
/// has values for. Adaptive pressure advance, which would override the value, is switched off, with
/// a notice; with rows it is switched on with them in its model. Nothing else changes, so that the
/// slicer imports it as it would have before.
/// @param file                how messages name it.
/// @param pressure_advance_s  0 … 2 s, which is what the slicer takes; written to 0.1 ms.
/// @param rows                over flow and acceleration, at least two flows for each: the slicer
///                            drops others without a word. Empty: the one value alone.
/// Errors (kInput): rows of an acceleration with one flow; no JSON object, no filament profile, a
/// value that is no text; the number.
[[nodiscard]] Result<OrcaProfile> WithPressureAdvance(
    std::string_view profile, const std::string& file, double pressure_advance_s,
    std::span<const pressure_advance::FlowPoint> rows = {});

}  // namespace trammel::files
