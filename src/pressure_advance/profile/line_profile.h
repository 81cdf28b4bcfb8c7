// Where both eyes end and scoring begins: one profile per printed line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"

namespace trammel::pressure_advance {

/// Unit of a profile's cross-section (width, height; area is its square).
enum class CrossSectionUnit { kMillimetre, kPixel };

/// Unit of a profile's positions along the line.
enum class PositionUnit { kMillimetre, kLineLength };

/// A quantity at one position, as far as the eye sees it. sigma > 0 where seen; sigma == 0 means
/// that this eye does not see this quantity, and value is then 0.
struct Seen {
  double value = 0;
  double sigma = 0;  ///< 1 sigma of the reading's noise, same unit as value

  [[nodiscard]] bool seen() const { return sigma > 0; }
};

struct ProfileSample {
  double position =
      0;             ///< from the printed start, in print direction, in the profile's PositionUnit
  Seen width;        ///< of the bead at the plate
  Seen height;       ///< of the bead's top above the plate
  Seen area;         ///< of the cross-section
  bool gap = false;  ///< the eye looked here and could not measure; the values above are unseen
  bool cut_off = false;  ///< a gap because the bead is larger than the picture
};

/// What an eye saw of one printed line. A break in the filament is not a gap: there the eye sees
/// an area of about 0.
struct LineProfile {
  double pressure_advance_s = 0;
  CrossSectionUnit cross_section_unit = CrossSectionUnit::kMillimetre;
  PositionUnit position_unit = PositionUnit::kMillimetre;
  std::vector<ProfileSample> samples;  ///< strictly increasing position
  double heading = 1;                  ///< of the print along its axis of the bed, 1 or -1
  std::optional<Interval> shown;       ///< positions that the picture shows; absent: all
  bool shows_acceleration = true;      ///< false where the picture ends beside it
  bool shows_deceleration = true;      ///< likewise
  std::string unusable;                ///< why this line must not be used; empty where it may be
  int pattern = 0;                     ///< of several on one plate
};

}  // namespace trammel::pressure_advance
