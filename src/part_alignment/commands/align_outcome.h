// The answer of an alignment as result.json.
#pragma once

#include <string>

#include "app/output_files.h"
#include "part_alignment/report/alignment_json.h"

namespace trammel::app {

/// The alignment as a result of this program, now: part_x … part_gamma, and what was solved for of
/// the clamping and the camera.
/// @param source  the observations' file, or the measurement's folder.
[[nodiscard]] ResultFile ResultOf(const report::AlignmentOutput& output, std::string source);

}  // namespace trammel::app
