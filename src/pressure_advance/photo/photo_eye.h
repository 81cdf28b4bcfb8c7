// The photo eye: from one picture of a printed pattern to a width profile per line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/photo/photo_segments.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// A side of the picture, as a person sees it.
enum class PhotoSide { kBottom, kTop, kLeft, kRight };

/// "bottom", "top", "left" or "right".
[[nodiscard]] std::string ToString(PhotoSide side);

struct PhotoOptions {
  /// s, in the order of the lines as they lie on the plate; as many as there are lines, at least 2.
  std::vector<double> pressure_advance_s;
  /// The side of the picture at which the first value's line lies. Must be one of the two sides
  /// that the lines follow each other towards; the other two are refused. Absent: found from how
  /// widths go with PA; where they do not show it the bottom, as long as lines follow each other
  /// towards it.
  std::optional<PhotoSide> from;
  /// The side of the picture at which all lines' printed starts lie (patterns printed in
  /// alternating directions are not read); absent: found from how widths go with PA, and refused
  /// where they do not show it.
  std::optional<PhotoSide> start;
  /// Whether the pattern was printed with a mark in the corner where the first line starts
  /// (PatternConfig::corner_mark): it tells both sides where they are not given. Nothing is looked
  /// for where there is none, since a blob of filament may look like one.
  bool corner_mark = false;
  double slow_before = 0.1;  ///< planned fraction of a line before its fast segment, (0, 1)
  double slow_after = 0.3;   ///< planned fraction of a line behind its fast segment, (0, 1)
};

/// One line as traced in the rectified picture. Vectors of one length, same order as the samples of
/// the line's profile.
struct TracedLine {
  double pressure_advance_s = 0;
  std::vector<double> x_px;       ///< along the line
  std::vector<double> centre_px;  ///< y of the bead's middle
  std::vector<double> width_px;   ///< 0 where the filament broke
};

/// The pattern seen straight from above, print direction to the right, first line at the bottom.
struct PhotoView {
  Frame rectified;                ///< 0 x 0 where none was found
  std::vector<TracedLine> lines;  ///< per profile
};

/// What the eye saw. `refusal` is empty exactly when the profiles may be used.
struct PhotoMeasurement {
  std::string refusal;                ///< what is wrong, with its figures, and what to do
  std::vector<LineProfile> profiles;  ///< in the order of the PA list; width only, in px of the
                                      ///< rectified picture; positions in line lengths, 0 at the
                                      ///< inner edge of the frame at the printed start
  std::optional<FoundSegments> segments;  ///< where the speed changes, found from the lines; absent
                                          ///< where they do not show it
  PhotoView view;
  double blur = 0;  ///< of the lines' edges (1 sigma) over the lines' width
  PhotoSide first_line = PhotoSide::kBottom;  ///< side of the photo at which it lies
  bool marked = false;                        ///< whether the corner mark told the sides
  std::vector<std::string> notices;  ///< what a user should know although the photo is used
};

/// What the blur of a photo leaves open of an answer, as a part of the tested range. A blurred edge
/// moves no filament, but fills necks and gaps: to second order of the blur over a line's width.
/// Assumed, so that a copy of fewer pixels or less sharp never claims more than its original.
[[nodiscard]] double PictureSigma(double blur);

/// Largest photo that is measured, in pixels: at twice a 100-megapixel camera.
inline constexpr long long kLargestPhotoPx = 200'000'000;

/// Finds the printed lines, looks at them straight from above, and measures how wide each is all
/// along.
///
/// Assumes a rectangular printed frame whose two long bars the lines connect, lines of equal
/// spacing between two further bars, and filament that differs from the plate in colour or
/// brightness. The pattern may be turned, tilted and mirrored in any way. The frame may leave the
/// photo, and so may the lines' ends, as long as one of the two long bars is seen beside some of
/// the lines and both speed changes in enough of them.
/// @param photo    8-bit BGR, shape (height, width, 3). May be empty or without a pattern: refused.
/// @param options  Checked; what cannot be is refused with the field, the value and the bound.
/// Accuracy: photo_eye_test and photo_comb_test have the bounds on drawn patterns.
/// Cost: about 1 s of one core for 2 megapixels, 5 s for 100, twice as much without a whole frame;
/// about 40 bytes of memory per pixel, and no more than 0.5 GB beside the photo, since larger ones
/// are shrunk to 12 megapixels.
[[nodiscard]] PhotoMeasurement MeasurePhoto(const BgrView& photo, const PhotoOptions& options);

}  // namespace trammel::pressure_advance
