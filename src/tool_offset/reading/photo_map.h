// The map of a photo: projection, lens and bent paper, from the box and the reference tool's lines.
#pragma once

#include "base/result.h"
#include "tool_offset/reading/photo_pose.h"
#include "tool_offset/reading/sheet_finder.h"

namespace trammel::tool_offset {

/// How a photo was taken, and how well that explains it.
struct PhotoOnPage {
  PhotoPose pose;
  RadialSpread spread;   ///< that was taken for granted
  double rms_mm = 0;     ///< of box and reference tool's fingers against the map
  int fingers = 0;       ///< of the reference tool that were found
  double px_per_mm = 0;  ///< where the sheet is seen smallest
  double blur_px = 0;    ///< 1 sigma, of the reference tool's lines
};

/// The middle of what reaches of a finger beyond the other comb.
[[nodiscard]] SheetPoint OuterMiddle(const SheetPlan& plan, const Structure& structure,
                                     std::size_t comb, int finger);

/// Replaces the sheet's map, whose sides bend as scans do, by that of a camera, and says how the
/// camera stood.
///
/// The projection (8), two coefficients of radial distortion about the picture's middle and the
/// paper's bow (3) by least squares with Huber's weights, from places on the box and from where the
/// reference tool's fingers stand, of which each tells along its own axis.
/// What is left (waves of the paper, a lens that is not centred) may reach some hundredths of a mm:
/// enough to find every leg, whose place among its neighbours is read apart from the map.
/// @param sheet  as found: right to 0.4 mm everywhere.
/// @returns errors (kMeasurement): fewer than a third of the reference tool's fingers were found,
/// or
///          they lie further from the map than paper and lenses of phones bend.
[[nodiscard]] Result<PhotoOnPage> FitPhotoMap(const PageView& page, const SheetPlan& plan,
                                              const PhotoSource& source, SheetOnPage& sheet);

}  // namespace trammel::tool_offset
