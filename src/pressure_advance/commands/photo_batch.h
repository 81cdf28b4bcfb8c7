// Photos of several patterns of corners from one file: a table over flow and acceleration.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/commands/photo_analysis.h"
#include "pressure_advance/files/slicer_gcode.h"

namespace trammel::app {

/// Returns a slicer's pattern as the plan of its photo.
[[nodiscard]] PhotoPlan PhotoPlanOf(const files::SlicerPattern& pattern,
                                    const std::optional<gcode::PrintedBy>& printed_by);

/// Measures all patterns in one photo, which are named by their places on the plate, or one in each
/// photo, in the order of `print`. Prints each answer, and the table of the good ones.
/// @returns the exit code: good if every pattern yields an answer.
/// @param file  of the patterns, for messages
/// Errors (kInput): patterns of lines, with their plates and values, or more than 50 patterns;
/// another number of photos; a file that is no picture.
[[nodiscard]] Result<int> RunPhotoBatch(const std::vector<std::string>& photos,
                                        const std::string& file, const files::SlicerPrint& print,
                                        bool json);

}  // namespace trammel::app
