// Finds the printed frame in a photo.
#pragma once

#include <optional>
#include <vector>

#include "base/frame.h"
#include "vision/image.h"

namespace trammel::vision {

/// The quadrilateral round a convex polygon, found by dropping the side whose neighbours close over
/// it with the least extra area until four are left.
/// @param polygon  convex, in order, at least four corners.
/// @returns clockwise as seen; nothing where the polygon has too few sides that can be dropped.
[[nodiscard]] std::optional<Quad> QuadAround(std::vector<PointPx> polygon);

struct RefinedQuad {
  Quad quad;
  double closed = 0;  ///< share of the worst side with an outline within tolerance
};

/// Moves each side of a quadrilateral onto the outline of a mask: the places where, coming from
/// outside, the mask begins, fitted by a straight line that ignores outliers.
/// @param mask     1 inside, 0 outside.
/// @returns nothing where the sides cannot be fitted.
[[nodiscard]] std::optional<RefinedQuad> RefineQuad(const GrayImage& mask, const Quad& start);

struct FrameFinderOptions {
  int longest_side_px = 1000;   ///< the search runs on a picture shrunk to this, [200, 4000]
  double smallest_area = 0.02;  ///< of the picture that a frame encloses, (0, 1)
  double least_closed = 0.7;    ///< share of each side that must be seen as filament, [0, 1]
  std::size_t most_found = 10;  ///< best candidates returned
};

/// A quadrilateral outline of filament.
struct FoundFrame {
  Quad outer;          ///< outer corners in px of the photo, clockwise as seen
  double closed = 0;   ///< share of the worst side along which filament begins there, 0 … 1
  GrayImage filament;  ///< 1 where the shrunk picture shows filament, 0 elsewhere
  double filament_scale = 1;  ///< px of `filament` per px of the photo
};

/// Looks for connected pieces of filament whose outline is a convex quadrilateral, in several
/// colour channels, lighter and darker than their surroundings, at several smoothing scales: a
/// textured plate, uneven light or a string of filament spoils some of these but seldom all.
/// @param photo  8-bit BGR. REQUIRES at least 16 px each way.
/// @returns frames that are closed on all sides, closed and large ones first; empty where there are
/// none.
///          Nothing in it says that a frame holds lines.
[[nodiscard]] std::vector<FoundFrame> FindPrintedFrames(const BgrView& photo,
                                                        const FrameFinderOptions& options = {});

}  // namespace trammel::vision
