// Points on a scanned page, its map to the sheet, and parts of it as samples: it is never copied as
// a whole.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/page.h"
#include "base/result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Checks a page; the error names the fault.
[[nodiscard]] Result<void> CheckPage(const PageView& page);

/// Point on the page; (0, 0) is the centre of the first pixel, y runs down.
struct PagePoint {
  double x_px = 0;
  double y_px = 0;

  friend PagePoint operator+(PagePoint a, PagePoint b) {
    return {a.x_px + b.x_px, a.y_px + b.y_px};
  }
  friend PagePoint operator-(PagePoint a, PagePoint b) {
    return {a.x_px - b.x_px, a.y_px - b.y_px};
  }
  friend PagePoint operator*(double k, PagePoint a) { return {k * a.x_px, k * a.y_px}; }
};

[[nodiscard]] double Length(PagePoint a);

/// Weights of the channels, whose sum is one number per pixel. Grey pages use the first weight
/// only.
using ChannelMix = std::array<float, 3>;

/// Grid of points on the page: row r, column c is at origin + r * row_step + c * column_step.
struct Strip {
  PagePoint origin;
  PagePoint row_step;
  PagePoint column_step;
  int rows = 0;
  int columns = 0;
};

/// Samples the mix at every point of the strip, linearly between pixels (which preserves areas and
/// first moments, and is symmetric to left and right).
/// @param out  rows * columns values, row by row; resized.
/// @returns false, with `out` unchanged, if a part of the strip is outside the page.
[[nodiscard]] bool SampleStrip(const PageView& page, const ChannelMix& mix, const Strip& strip,
                               std::vector<float>& out);

/// Sides of the box, by the sheet's coordinates.
enum Side : std::size_t { kLeft, kRight, kBottom, kTop };
inline constexpr std::size_t kSides = 4;
/// True if a side runs along v.
[[nodiscard]] inline bool IsUpright(Side side) { return side == kLeft || side == kRight; }
/// Returns the sign of its coordinate outwards: 1 or -1.
[[nodiscard]] inline double Outward(Side side) { return side == kRight || side == kTop ? 1 : -1; }

/// Linear map near one point.
struct LocalMap {
  PagePoint at;
  PagePoint u_px_mm;  ///< page pixels per mm along u
  PagePoint v_px_mm;

  [[nodiscard]] PagePoint ToPage(SheetPoint beside) const {
    return at + beside.u_mm * u_px_mm + beside.v_mm * v_px_mm;
  }
  /// Converts a step on the page to mm on the sheet.
  [[nodiscard]] SheetPoint ToSheet(PagePoint step) const {
    const double determinant = u_px_mm.x_px * v_px_mm.y_px - u_px_mm.y_px * v_px_mm.x_px;
    return {(step.x_px * v_px_mm.y_px - step.y_px * v_px_mm.x_px) / determinant,
            (u_px_mm.x_px * step.y_px - u_px_mm.y_px * step.x_px) / determinant};
  }
};

/// Effects of a camera beyond the projection: its lens, and paper that is not flat.
struct CameraBend {
  PagePoint centre;     ///< lens centre
  double focal_px = 1;  ///< in which radii are counted
  /// Coefficients of the lens: an undistorted radius r appears at r (1 + k1 r² + k2 r⁴).
  std::array<double, 2> radial{};
  SheetPoint foot;       ///< the point of the paper's plane under the lens
  double height_mm = 1;  ///< lens above that plane
  double reach_mm = 1;   ///< half of the box's diagonal, in which the bow is counted
  /// Height of the paper: factors of u², u v and v², each over reach_mm². mm.
  std::array<double, 3> bow_mm{};

  [[nodiscard]] SheetPoint OnPlane(SheetPoint point) const;
  [[nodiscard]] PagePoint Seen(PagePoint straight) const;
};

/// Map by a central projection (affine on a flatbed, not under a camera) and the bending of the
/// box's sides: paper on a bed and on glass is never quite flat. Between opposite sides the bending
/// changes linearly.
struct PageMap {
  PagePoint middle;   ///< sheet's centre
  PagePoint u_px_mm;  ///< page pixels per mm along u, at the middle
  PagePoint v_px_mm;
  /// Relative decrease of the scale per mm along u and v.
  SheetPoint lean_per_mm;
  double half_width_mm = 1;
  double half_height_mm = 1;
  /// Outward displacement of a side (u of left and right, v of bottom and top) from the plan: a
  /// cubic in the other coordinate over its half length, lowest power first. mm.
  std::array<std::array<double, 4>, kSides> bend_mm{};
  std::optional<CameraBend> camera;  ///< photos only

  [[nodiscard]] PagePoint ToPage(SheetPoint point) const;
  [[nodiscard]] LocalMap Near(SheetPoint point) const;
  /// Returns a planned point on a side of the box. @param along_mm  from the side's middle.
  [[nodiscard]] SheetPoint OnSide(Side side, double along_mm) const {
    return IsUpright(side) ? SheetPoint{Outward(side) * half_width_mm, along_mm}
                           : SheetPoint{along_mm, Outward(side) * half_height_mm};
  }
  /// Returns how much larger one side of the box appears than the opposite one, relative.
  [[nodiscard]] double perspective() const;
  /// True if the page shows the sheet from behind, as a mirror does.
  [[nodiscard]] bool mirrored() const {
    return u_px_mm.x_px * v_px_mm.y_px - u_px_mm.y_px * v_px_mm.x_px > 0;
  }
};

/// Computes the map without bending that maps the box's corners (low u and v first, then round by
/// high u) to these points.
/// @returns nothing if they do not go round a convex area.
[[nodiscard]] std::optional<PageMap> MapOfCorners(const std::array<PagePoint, 4>& corners,
                                                  double width_mm, double height_mm);

/// Position that halves a line's ink, and the total ink.
struct LinePlace {
  double middle = 0;  ///< samples; half of the window's ink lies below it
  double ink = 0;     ///< sum of the samples in the window
};

/// Finds the position that halves the ink in [low, high].
///
/// Reason for this estimator: it weighs a line's two edges alike (the minimum effect of rough edges
/// on a position) and needs neither the ink's level nor the blur. Everything symmetric about the
/// line - blur, halo, a resampled pixel grid - cancels. A sample is a block one sample wide, so
/// nothing is lost for pixels that average over their area: a clean line is found exactly, however
/// few pixels wide. A centroid errs there by up to 0.03 samples and weighs far dirt more.
/// @param ink  zero on paper, positive on ink; noise may be negative.
/// @param low, high  samples; the window's ends, on paper or cut at the same distance from the
/// line.
/// @returns nothing if the window exceeds the samples or has no ink.
[[nodiscard]] std::optional<LinePlace> HalfInkPlace(std::span<const float> ink, double low,
                                                    double high);

}  // namespace trammel::tool_offset
