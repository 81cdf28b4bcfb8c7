// Observations of a part by the camera in the spindle: what `trammel align solve` reads.
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
  /// Of the targets' coordinates, as SolveOptions has it.
  std::optional<Eigen::MatrixXd> target_covariance;
  part_alignment::Unknowns unknowns;
  /// What is uncertain beside the pixels, as far as the file says.
  part_alignment::InputUncertainty inputs;
  /// The picture of each view, from the file's folder; empty where the file names none. May be
  /// shorter than the views.
  std::vector<std::string> pictures;
  /// Ids that stand in the file as numbers, and are to be given back as such.
  std::set<std::string> numeric_ids;
  /// Of the camera, where its file, or the key beside it, says so.
  std::optional<part_alignment::CalibrationRecord> calibration;
};

/// Reads observations (docs/reference/formats.md). `camera` is an object, or the path of a camera
/// file, from the folder of this one; beside an object may stand the `calibration` that a camera
/// file has. `targets` are a list, with their covariance beside it, or the path of what align fit
/// left; of that the ends of scale bars are left out unless a view shows them. Where `unknowns` is
/// absent they are the pose and the clamp angle. Errors (kInput) name file and place: not JSON, a
/// number that is none or out of its range, an unknown key, a target id twice or unknown, an
/// observation outside the picture, a spindle rotation that is none.
/// @param least_views  0 where the views are yet to be planned
[[nodiscard]] Result<AlignmentInput> ReadAlignmentFile(const std::filesystem::path& path,
                                                       std::size_t least_views = 1);

/// The same as text, the camera within; ReadAlignmentFile gives every number back to the last bit.
[[nodiscard]] std::string AlignmentFileText(const AlignmentInput& input);

/// Unknowns by their names in files ("pose", "clamp_angle", "clamp_eccentricity", "clamp_tilt",
/// "focal_length", "camera_offset"). Errors (kInput): an unknown name, one twice, no pose.
[[nodiscard]] Result<part_alignment::Unknowns> ParseUnknowns(const std::vector<std::string>& names);
[[nodiscard]] std::vector<std::string> NamesOf(const part_alignment::Unknowns& unknowns);

}  // namespace trammel::files
