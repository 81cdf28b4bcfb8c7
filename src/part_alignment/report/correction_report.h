// Report of a part's correction to its ideal pose, as JSON and in words.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "part_alignment/correction/control_text.h"
#include "part_alignment/correction/part_correction.h"

namespace trammel::report {

struct CorrectionOutput {
  geometry::Pose measured;
  /// Uncertainty, k = 1, of x, y, z (mm), alpha, beta, gamma (rad); absent: unknown.
  std::optional<Eigen::Matrix<double, 6, 1>> standard_uncertainty;
  std::optional<part_alignment::FixtureCorrection> fixture;
  part_alignment::Control control = part_alignment::Control::kLinuxCnc;
  part_alignment::OffsetSlot slot;
  bool tilts = false;        ///< the control takes rotations about X and Y
  bool after_shims = false;  ///< the offset is of the part as the fixture will have moved it
  part_alignment::OffsetCorrection offset;
  part_alignment::ControlText text;
  std::vector<part_alignment::PartTarget> points;  ///< where the remainder is stated
  std::vector<std::string> notices;                ///< from the measurement

  /// Returns the pose for the work offset.
  [[nodiscard]] const geometry::Pose& pose() const {
    return after_shims && fixture ? fixture->machine_from_part : measured;
  }
};

/// Returns one object (docs/reference/formats.md), ended by a newline.
[[nodiscard]] std::string ToJson(const CorrectionOutput& output);

/// Returns several lines, for the operator.
[[nodiscard]] std::string CorrectionText(const CorrectionOutput& output);

}  // namespace trammel::report
