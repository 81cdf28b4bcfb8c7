// Motion of a printed line, and its readings from a scan or a photo.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"

namespace trammel::pressure_advance {

/// Form of a pattern's candidates.
enum class PatternForm {
  kLines,    ///< straight lines, slow, fast, slow: OrcaSlicer's PA Line, Marlin's K-factor test
  kCorners,  ///< nested right angles: OrcaSlicer's PA Pattern, Ellis' test
};

/// Stretch of a line printed at one speed.
struct Segment {
  double fraction = 0;    ///< share of the line's length, (0, 1]; a line's fractions sum to 1
  double speed_mm_s = 0;  ///< commanded, > 0

  bool operator==(const Segment&) const = default;
};

/// Motion along one line. Length and acceleration may be unknown (a photo shows neither); then
/// positions along the line are fractions of its length.
struct LineMotion {
  std::vector<Segment> segments;             ///< in print order; usually slow, fast, slow
  std::optional<double> length_mm;           ///< > 0
  std::optional<double> acceleration_mm_s2;  ///< > 0
};

[[nodiscard]] bool IsSlowFastSlow(const std::vector<Segment>& segments);

/// Share of the fast segment that belongs to the acceleration if the segment has no steady middle;
/// the rest belongs to the deceleration, whose surplus drops immediately.
inline constexpr double kSplitOfFastSegment = 0.65;

/// Checks for a fast segment that is too short for its two speed changes.
///
/// The deceleration must not begin within the acceleration's share, since no steady flow would
/// separate the two. Virtual lines of shear-thinning melt then yield errors of up to 2.5 ms, and as
/// few as 57 % of their intervals contain the truth.
/// @returns the reason with a sufficient speed, acceleration and length; nothing for a segment
///   that is long enough, for other lines than slow, fast, slow, and without length or
///   acceleration.
[[nodiscard]] std::optional<std::string> FindShortFastSegment(const LineMotion& motion);

/// Unit of a profile's cross-section (width, height; area is its square).
enum class CrossSectionUnit { kMillimetre, kPixel };

/// Unit of a profile's positions along the line.
enum class PositionUnit { kMillimetre, kLineLength };

/// Quantity at one position, if visible. sigma > 0 if seen; sigma == 0 means that this reader
/// cannot see this quantity, and value is then 0.
struct Seen {
  double value = 0;
  double sigma = 0;  ///< 1 sigma of the reading's noise, same unit as value

  [[nodiscard]] bool seen() const { return sigma > 0; }
};

/// Reading that represents the amount of filament.
enum class Reading { kArea, kWidth };

struct ProfileSample {
  double position =
      0;             ///< from the printed start, in print direction, in the profile's PositionUnit
  Seen width;        ///< bead width at the plate
  Seen height;       ///< bead top above the plate
  Seen area;         ///< cross-section area
  bool gap = false;  ///< the eye looked here and could not measure; the values above are unseen
  bool cut_off = false;  ///< a gap because the bead is larger than the picture

  [[nodiscard]] const Seen& Read(Reading reading) const {
    return reading == Reading::kArea ? area : width;
  }
};

/// Readings along one printed line. A break in the filament is not a gap: its area is about 0.
struct LineProfile {
  double pressure_advance_s = 0;
  CrossSectionUnit cross_section_unit = CrossSectionUnit::kMillimetre;
  PositionUnit position_unit = PositionUnit::kMillimetre;
  std::vector<ProfileSample> samples;  ///< strictly increasing position
  double heading = 1;                  ///< print direction along its bed axis, 1 or -1
  std::optional<Interval> shown;       ///< positions that the picture shows; absent: all
  bool shows_acceleration = true;      ///< false where the picture ends beside it
  bool shows_deceleration = true;      ///< likewise
  std::string unusable;                ///< why this line must not be used; empty if usable
  int pattern = 0;                     ///< index on a plate of several
};

/// Returns the reading that most samples have; area before width. Absent if neither is seen.
[[nodiscard]] std::optional<Reading> ChooseReading(const std::vector<LineProfile>& profiles);

/// Standard uncertainty of the reader's own error of a height and of an area, as a share of it. It
/// reads virtual beads too low, by filament and plate, as light enters the filament and the plate
/// hides the bead's foot. Not corrected, since real filament may differ.
inline constexpr double kHeightReadingShare = 0.13;
inline constexpr double kAreaReadingShare = 0.16;

/// Scale of heights, by scale and laser angle, which are common to all heights and areas of a scan:
/// differences between lines do not depend on them.
struct HeightScale {
  double px_per_mm = 0;         ///< on the plate, > 0
  double height_mm_per_px = 0;  ///< of the laser line's shift, > 0
  /// Standard uncertainty of a height and an area from both, as a share of it; absent if either is
  /// unknown.
  std::optional<double> height_share;
  std::optional<double> area_share;
};

}  // namespace trammel::pressure_advance
