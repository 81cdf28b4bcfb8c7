// Photos of other tools' patterns that name their values by printed numbers.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/photo/photo_labels.h"

namespace trammel::app {

/// Reads the values beside the lines or corners of a photo.
/// @param plan  without values: its form, as far as given; with values: nothing is read unless the
///     photo contradicts them
/// Errors: a file that is no picture.
[[nodiscard]] Result<pressure_advance::LabelReading> ReadPrintedNumbers(
    const std::filesystem::path& file, const PhotoPlan& plan);

/// Analysis of a photo whose values were read from it.
struct NumberedRun {
  std::optional<AnalysisRun> run;  ///< absent: no numbers were read
  std::string problem;             ///< why not
};

/// Reads the values beside the lines or corners, and measures these with them. Notices say which
/// values were read, and which motion was assumed.
/// @param plan  without values: its form and sides, as far as given
/// Errors: those of AnalysePhoto.
[[nodiscard]] Result<NumberedRun> AnalyseByNumbers(const std::filesystem::path& file,
                                                   const PhotoPlan& plan);

/// Compares the printed numbers with the values of a plan of another tool.
/// @returns both ranges, if the photo clearly shows others; else, also without readable numbers,
///     empty.
/// Errors: a file that is no picture.
[[nodiscard]] Result<std::string> ContradictingNumbers(const std::filesystem::path& file,
                                                       const PhotoPlan& plan);

}  // namespace trammel::app
