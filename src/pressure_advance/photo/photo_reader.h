// Photo reader: from one picture of a printed pattern to a width profile per line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/photo/photo_segments.h"
#include "pressure_advance/profile/line_profile.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// Side of the picture, as a person sees it.
enum class PhotoSide { kBottom, kTop, kLeft, kRight };

/// "bottom", "top", "left" or "right".
[[nodiscard]] std::string ToString(PhotoSide side);

struct PhotoOptions {
  /// Pressure advances, s, in the order of the lines on the plate; as many as there are lines, at
  /// least 2.
  std::vector<double> pressure_advance_s;
  /// Side of the picture at the first value's line. Must be one of the two sides across the lines;
  /// the other two are rejected. Absent: found from the trend of width with PA; if that is unclear,
  /// the bottom, if the lines are stacked towards it.
  std::optional<PhotoSide> from;
  /// Side of the picture at all lines' printed starts (patterns printed in alternating directions
  /// are not supported). Absent: found from the trend of width with PA, and rejected if that is
  /// unclear.
  std::optional<PhotoSide> start;
  /// True if the pattern was printed with a mark in the corner where the first line starts
  /// (PatternConfig::corner_mark). It determines both sides if they are not set. Otherwise no mark
  /// is searched, since a blob of filament may resemble one.
  bool corner_mark = false;
  /// False for patterns of other tools, which have no bar beside their outer lines: bars at the
  /// lines' ends are enough, and no outer line is taken for a bar.
  bool framed = true;
  /// Length of a line in distances between neighbours, of a pattern that is not framed. Absent: not
  /// known.
  std::optional<double> length_pitches;
  double slow_before = 0.1;  ///< planned fraction of a line before its fast segment, (0, 1)
  double slow_after = 0.3;   ///< planned fraction of a line behind its fast segment, (0, 1)
};

/// Line traced in the rectified picture. Vectors of one length, same order as the samples of the
/// line's profile.
struct TracedLine {
  double pressure_advance_s = 0;
  std::vector<double> x_px;       ///< along the line
  std::vector<double> centre_px;  ///< y of the bead's middle
  std::vector<double> width_px;   ///< 0 where the filament broke
};

/// Pattern rectified to a top view, print direction to the right, first line at the bottom.
struct PhotoView {
  Frame rectified;                ///< 0 x 0 where none was found
  std::vector<TracedLine> lines;  ///< per profile
};

/// Profiles from a photo. `refusal` is empty exactly when they may be used.
struct PhotoMeasurement {
  std::string refusal;                ///< problem with its figures, and the remedy
  std::vector<LineProfile> profiles;  ///< in the order of the PA list; width only, in px of the
                                      ///< rectified picture; positions in line lengths, 0 at the
                                      ///< inner edge of the frame at the printed start
  std::optional<FoundSegments> segments;  ///< where the speed changes, found from the lines; absent
                                          ///< where they do not show it
  PhotoView view;
  double blur = 0;  ///< of line edges (1 sigma), relative to the line width
  PhotoSide first_line = PhotoSide::kBottom;  ///< side of the photo at which it lies
  bool marked = false;                        ///< true if the corner mark identified the sides
  std::vector<std::string> notices;           ///< for the user, although the photo is used
};

/// Computes the uncertainty of an answer from a photo's blur, relative to the tested range. A
/// blurred edge moves no filament, but fills necks and gaps: to second order of the blur over a
/// line's width. Assumed, so that a copy of fewer pixels or less sharp never claims more than its
/// original.
[[nodiscard]] double PictureSigma(double blur);

struct PhotoLines;

/// Measures the width of lines along their length.
///
/// Assumes a rectangular printed frame whose two long bars the lines connect, and lines of equal
/// spacing between two further bars. The filament must differ from the plate in colour or
/// brightness. The pattern may be rotated, tilted and mirrored in any way. The frame and the lines'
/// ends may leave the photo: one of the two long bars must be visible beside some of the lines, and
/// both speed changes in enough of them.
/// @param lines    as FindPhotoLines returns them, with the same options but for values and sides;
/// a
///     problem is refused
/// Accuracy: photo_eye_test and photo_comb_test have the bounds on synthetic patterns.
[[nodiscard]] PhotoMeasurement MeasurePhotoLines(PhotoLines&& lines, const PhotoOptions& options);

/// Empty if a photo of this size can be measured with the options; else the problem: the field, the
/// value and the bound.
[[nodiscard]] std::string CheckPhotoInput(int width_px, int height_px, const PhotoOptions& options);

}  // namespace trammel::pressure_advance
