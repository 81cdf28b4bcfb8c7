// What `trammel align solve` and `measure` leave of an alignment.
#pragma once

#include <filesystem>
#include <vector>

#include "app/output_files.h"
#include "base/result.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/report/alignment_json.h"

namespace trammel::app {

/// As the input asks.
[[nodiscard]] part_alignment::SolveOptions SolveOptionsOf(const files::AlignmentInput& input);

/// With what the stated uncertainty does not hold among its notices
/// (part_alignment/pose/caveats.h).
[[nodiscard]] report::AlignmentOutput OutputOf(const files::AlignmentInput& input,
                                               part_alignment::Alignment alignment);

/// Writes result.json, report.txt, report.html and view-01_residuals.png … (what was found,
/// projected and left over in each) into a folder, which is made if need be. The page holds the
/// pictures of the six views with the largest residuals.
/// @param result  of the same output; absent: no result.json.
/// @param pictures  of the views; an empty path, or none, draws the targets on a grey ground.
/// Errors name the file: one that cannot be written or, unless `force`, is there already, a picture
/// that cannot be read or is not of the camera's size.
[[nodiscard]] Result<void> WriteAlignmentReport(const std::filesystem::path& folder,
                                                const report::AlignmentOutput& output,
                                                const ResultFile* result,
                                                const std::vector<std::filesystem::path>& pictures,
                                                bool force);

}  // namespace trammel::app
