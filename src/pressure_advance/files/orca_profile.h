// A filament profile of OrcaSlicer, with a measured pressure advance.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::files {

struct OrcaProfile {
  std::string text;                  ///< JSON, its keys in the order of the original
  std::vector<std::string> notices;  ///< what else had to change
};

/// Takes a filament profile as OrcaSlicer exports it (JSON; each value a text or a list of texts)
/// and sets `enable_pressure_advance` and `pressure_advance`, for each extruder that the profile
/// has values for. Adaptive pressure advance, which would override the value, is switched off, with
/// a notice. Nothing else changes, so that the slicer imports it as it would have before.
/// @param file                how messages name it.
/// @param pressure_advance_s  0 … 2 s, which is what the slicer takes; written to 0.1 ms.
/// Errors (kInput): no JSON object, no filament profile, a value that is no text; the number.
[[nodiscard]] Result<OrcaProfile> WithPressureAdvance(std::string_view profile,
                                                      const std::string& file,
                                                      double pressure_advance_s);

}  // namespace trammel::files
