// Describes how a printed line was driven, and what a reader of a scan or a photo made of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"

namespace trammel::pressure_advance {

/// A stretch of a line printed at one speed.
struct Segment {
  double fraction = 0;    ///< of the line's length, (0, 1]; the fractions of a line sum to 1
  double speed_mm_s = 0;  ///< commanded, > 0

  bool operator==(const Segment&) const = default;
};

/// The motion along one line. Length and acceleration may be unknown (a photo tells neither); then
/// positions along the line are fractions of its length.
struct LineMotion {
  std::vector<Segment> segments;    ///< in print order; slow, fast, slow in the usual pattern
  std::optional<double> length_mm;  ///< > 0
  std::optional<double> acceleration_mm_s2;  ///< > 0
};

[[nodiscard]] bool IsSlowFastSlow(const std::vector<Segment>& segments);

/// Share of the fast segment that belongs to the acceleration where the segment has no steady
/// middle; the rest belongs to the deceleration, whose surplus drops where it happens.
inline constexpr double kSplitOfFastSegment = 0.65;

/// Finds a fast segment that is too short for its two speed changes.
///
/// The deceleration must not begin within the acceleration's share: no steady flow would part the
/// two. Virtual lines of a melt that thins under shear then come out up to 2.5 ms high, and as few
/// as 57 % of their intervals hold the truth.
/// @returns the reason with speed, acceleration and length that would do; nothing for a segment
///   that is long enough, for other lines than slow, fast, slow, and without length or
///   acceleration.
[[nodiscard]] std::optional<std::string> FindShortFastSegment(const LineMotion& motion);

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

/// Which of an eye's readings stands for the amount of filament.
enum class Reading { kArea, kWidth };

struct ProfileSample {
  double position =
      0;             ///< from the printed start, in print direction, in the profile's PositionUnit
  Seen width;        ///< of the bead at the plate
  Seen height;       ///< of the bead's top above the plate
  Seen area;         ///< of the cross-section
  bool gap = false;  ///< the eye looked here and could not measure; the values above are unseen
  bool cut_off = false;  ///< a gap because the bead is larger than the picture

  [[nodiscard]] const Seen& Read(Reading reading) const {
    return reading == Reading::kArea ? area : width;
  }
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

/// The reading that most samples have; area before width. Nothing where neither is seen.
[[nodiscard]] std::optional<Reading> ChooseReading(const std::vector<LineProfile>& profiles);

/// Standard uncertainty of what the eye itself makes of a height and of an area, as a share of it:
/// it reads virtual beads too low, by filament and plate, as light enters the filament and the
/// bead's foot is lost in the plate's. It is not taken off: real filament may do otherwise.
inline constexpr double kHeightReadingShare = 0.13;
inline constexpr double kAreaReadingShare = 0.16;

/// By scale and laser angle, which are common to all heights and areas of a scan: what is said of
/// how lines differ does not depend on them.
struct HeightScale {
  double px_per_mm = 0;         ///< on the plate, > 0
  double height_mm_per_px = 0;  ///< of the laser line's shift, > 0
  /// Standard uncertainty that both leave a height and an area, as a share of it; absent where
  /// either is not known.
  std::optional<double> height_share;
  std::optional<double> area_share;
};

}  // namespace trammel::pressure_advance
