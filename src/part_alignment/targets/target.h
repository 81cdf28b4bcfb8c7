// Targets found in a picture.
#pragma once

#include <optional>
#include <vector>

#include "part_alignment/targets/image_ellipse.h"
#include "part_alignment/targets/reject_reason.h"

namespace trammel::part_alignment {

struct FoundTarget {
  std::optional<int> number;  ///< in the code book, from 1; absent for a plain disc
  /// The disc's image. Its centre is not the image of the disc's centre where the view is oblique:
  /// see eccentricity.h.
  ImageEllipse disc;
  double sigma_column_px = 0;  ///< k = 1, from the pixels' own scatter about the model
  double sigma_row_px = 0;
  double contrast = 0;         ///< grey levels, disc less surroundings: negative for dark discs
  double noise = 0;            ///< scatter of the pixels about the model, grey levels
  double blur_px = 0;          ///< standard deviation of the edge's profile
  double ring_start_rad = 0;   ///< where bit 0 of the word begins, in the ellipse's own angle
  double saturated_share = 0;  ///< of the samples, 0 … 1
};

struct RejectedTarget {
  RejectReason reason = RejectReason::kWrongCode;
  double column_px = 0;
  double row_px = 0;
  double radius_px = 0;
  std::optional<int> number;  ///< where it was read
};

struct FoundTargets {
  std::vector<FoundTarget> targets;      ///< ascending by number, then from the top
  std::vector<RejectedTarget> rejected;  ///< from the top
};

}  // namespace trammel::part_alignment
