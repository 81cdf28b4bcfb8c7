// Observations of a part by the camera in the spindle, the input of `trammel align solve`.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"

namespace trammel::files {

struct AlignmentInput {
  part_alignment::Measurement measurement;
  /// Covariance of the targets' coordinates, as in SolveOptions.
  std::optional<Eigen::MatrixXd> target_covariance;
  part_alignment::Unknowns unknowns;
  /// Uncertainties beside the pixels', as far as the file states them.
  part_alignment::InputUncertainty inputs;
  /// Picture of each view, relative to the file's folder; empty if the file names none. May be
  /// shorter than the views.
  std::vector<std::string> pictures;
  /// Ids that are numbers in the file, and are written as numbers again.
  std::set<std::string> numeric_ids;
  /// Calibration record of the camera, if its file, or the key beside it, has one.
  std::optional<part_alignment::CalibrationRecord> calibration;
};

/// Reads observations (docs/reference/formats.md). `camera` is an object, or the path of a camera
/// file relative to this one's folder; an object may have a camera file's `calibration` beside it.
/// `targets` are a list with its covariance beside it, or the path of a file that align fit wrote.
/// Of that file, ends of scale bars are skipped unless a view shows them. The default of `unknowns`
/// is the pose and the clamp angle. Errors (kInput) name file and place: not JSON, an invalid
/// number or one out of its range, an unknown key, a target id twice or unknown, an observation
/// outside the picture, an invalid spindle rotation.
/// @param least_views  0 where the views are yet to be planned
[[nodiscard]] Result<AlignmentInput> ReadAlignmentFile(const std::filesystem::path& path,
                                                       std::size_t min_views = 1);

/// Writes an alignment file as text, with the camera in it; ReadAlignmentFile reads every number
/// back to the last bit.
[[nodiscard]] std::string AlignmentFileText(const AlignmentInput& input);

/// Parses the names of unknowns in files ("pose", "clamp_angle", "clamp_eccentricity",
/// "clamp_tilt", "focal_length", "camera_offset"). Errors (kInput): an unknown name, one twice, no
/// pose.
[[nodiscard]] Result<part_alignment::Unknowns> ParseUnknowns(const std::vector<std::string>& names);
[[nodiscard]] std::vector<std::string> NamesOf(const part_alignment::Unknowns& unknowns);

}  // namespace trammel::files
