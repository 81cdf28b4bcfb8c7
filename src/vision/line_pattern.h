// Finds parallel lines in a rectified picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vision/image.h"

namespace trammel::vision {

/// Slightly curved line: value = c0 + c1 u + c2 u^2, u = (s - centre) / half of the span. Lenses
/// bend straight lines by about 1 % of their length; a parabola follows that to a tenth of it.
struct Curve {
  double centre = 0;
  double half_span = 1;
  double c0 = 0, c1 = 0, c2 = 0;

  [[nodiscard]] double operator()(double s) const {
    const double u = (s - centre) / half_span;
    return c0 + u * (c1 + u * c2);
  }
};

/// Fits a curve robust against about a third of outliers; a straight line or a constant for fewer
/// than 6 or 3 points. REQUIRES at least one point and lists of one length.
[[nodiscard]] Curve FitCurve(const std::vector<double>& s, const std::vector<double>& value,
                             double centre, double half_span);

/// Range of columns, both ends included.
struct Columns {
  int from_px = 0;
  int to_px = -1;

  [[nodiscard]] bool Hold(double x_px) const { return x_px >= from_px && x_px <= to_px; }
};

struct LinePattern {
  std::string problem;       ///< why this is no line pattern, with figures; empty if it is one
  std::vector<Curve> rungs;  ///< y_px of each line's middle over x_px, top to bottom
  std::vector<int> steps;  ///< pitches between neighbouring rungs, whole; above 1 rungs are missing
  double pitch_px = 0;     ///< between neighbouring rungs
  double bead_px = 0;      ///< median width of the rungs at half contrast
  Curve left_inner;        ///< x_px over y_px: where the left rail ends
  Curve right_inner;       ///< x_px over y_px: where the right rail begins
  bool left_seen =
      true;  ///< the rail; where it is not, `left_inner` is where lines leave the photo
  bool right_seen = true;     ///< likewise
  bool first_cut = false;     ///< the photo ends before the place above the first rung
  bool last_cut = false;      ///< likewise below the last rung
  bool first_closed = false;  ///< the frame is seen to close above the first rung: no other line
                              ///< lies there; known where lines were found without the whole frame
  bool last_closed = false;   ///< likewise below the last rung
  int doubtful = 0;  ///< outer stripes left out though they may be lines: the photo does not show
                     ///< whether they are bars of the frame
  std::vector<Columns> seen;  ///< per rung, what the photo shows of it; empty: all of every rung
  double ended =
      1;  ///< share of the lines that end side by side with the others, of both sides seen
  double irregularity = 0;  ///< largest deviation of a spacing from whole pitches, in pitches
};

/// Computes the ratio of a picture's changes from row to row and from column to column: above 1 if
/// the rungs run along the rows.
[[nodiscard]] double RowsOverColumns(const GrayImage& contrast, int margin_px);

/// Finds the rungs of a frame with rails on the left and right.
/// @param contrast     filament higher than the plate beside it; light may be uneven.
/// @param margin_px    distance of the frame's outer edges from the picture's edge.
/// @param rungs_hint   expected number, for the scale only: another number is found as well.
[[nodiscard]] LinePattern FindLinePattern(const GrayImage& contrast, int margin_px,
                                          std::size_t rungs_hint);

/// Returns means over up to `half` values on either side.
[[nodiscard]] std::vector<double> BoxMean(const std::vector<double>& values, int half);

/// Bright section across a line, averaged over some columns.
struct RungSection {
  double middle_px = 0;  ///< y
  double width_px = 0;   ///< width at half maximum
  double height = 0;     ///< contrast above the plate beside
};

/// Returns the mean section over the columns x_begin … x_end within half a pitch of a position.
/// @returns nothing if no rung stands out, or less than 4 px are visible.
[[nodiscard]] std::optional<RungSection> SectionOfRung(const GrayImage& image, int x_begin,
                                                       int x_end, double y_near, double pitch_px);

/// Returns the mean brightness along the middle between two rungs, one per column.
[[nodiscard]] std::vector<double> BetweenRungs(const GrayImage& image, const Curve& above,
                                               const Curve& below, double pitch_px);

}  // namespace trammel::vision
