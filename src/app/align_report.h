// What `trammel align solve` and `measure` leave of an alignment.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/result.h"
#include "part_alignment/solve.h"
#include "report/alignment_json.h"
#include "store/alignment_file.h"

namespace trammel::app {

/// Solves as the input asks, and says what its camera file has to say.
/// Errors: those of part_alignment::Solve.
[[nodiscard]] Result<part_alignment::Alignment> SolveInput(
    const store::AlignmentInput& input, const part_alignment::SolveOptions& options);

[[nodiscard]] report::AlignmentOutput OutputOf(const store::AlignmentInput& input,
                                               part_alignment::Alignment alignment);

/// Where the solution has a target, (column, row) in px; absent outside the picture, and unless the
/// verdict is good.
[[nodiscard]] std::optional<Eigen::Vector2d> ProjectedIn(
    const part_alignment::View& view, const part_alignment::PartTarget& target,
    const store::AlignmentInput& input, const part_alignment::Alignment& alignment);

/// Writes result.json, report.txt, report.html and view000_residuals.png … (what was found,
/// projected and left over in each) into a folder, which is made if need be.
/// @param pictures  of the views; an empty path, or none, draws the targets on a grey ground.
/// Errors name the file: one that cannot be written, a picture that cannot be read or is not of the
/// camera's size.
[[nodiscard]] Result<void> WriteAlignmentReport(const std::filesystem::path& folder,
                                                const report::AlignmentOutput& output,
                                                const std::vector<std::filesystem::path>& pictures);

}  // namespace trammel::app
