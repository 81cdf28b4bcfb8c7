// Camera pose and map of a photo: projection, lens and bent paper, from the box and the reference
// tool's lines.
#pragma once

#include <optional>

#include "base/page.h"
#include "base/result.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/reading/sheet_finder.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Assumed spread of the tools' lines in a photo, 1 sigma of another tool's against the reference
/// tool's.
struct RadialSpread {
  /// Height above the paper; [0, 1]. Nozzles whose Z offset was set with a probe agree that well.
  double height_mm = 0.03;
  /// Outward shift of their colour in the picture's corner; [0, 10]. Lateral colour of phones is up
  /// to 0.5 px between channels.
  double colour_px = 0.2;
  /// Degrees of freedom of both estimates, > 0. Nozzles set by eye are several times as uneven.
  double freedom = 2;
};

/// Camera data given before the photo is read.
struct PhotoSource {
  /// Focal length on film of 35 mm (36 x 24 mm) over the diagonal of the whole picture, > 0. Absent
  /// if the file does not state it: then the box determines it roughly.
  std::optional<double> film_focal_mm = {};
  RadialSpread spread;
};

/// Pose of the camera over the sheet.
struct PhotoPose {
  double focal_px = 1;
  double focal_uncertainty = 0;  ///< standard, in parts of one
  bool focal_stated = false;     ///< true if from the file or user
  PagePoint centre;              ///< of the picture, taken for that of the lens
  /// Standard uncertainty of the lens's axis there, along a side: small, or that of a cropped
  /// picture.
  double centre_uncertainty_px = 0;
  bool as_stored = true;  ///< the picture has a size that cameras store
  double corner_px = 1;   ///< centre to corner
  SheetPoint foot;        ///< the point of the sheet's plane under the lens
  SheetPoint aim;         ///< intersection of the lens axis with that plane
  double height_mm = 1;   ///< lens above it
  double tilt_rad = 0;    ///< between the lens's axis and the plane's normal
};

/// True if cameras store pictures of this size: sides of whole blocks of 4 px, as 4:3, 3:2, 16:9 or
/// 1:1 to 1 %. Few pictures cropped by hand match.
[[nodiscard]] bool IsStoredSize(int width_px, int height_px);

/// Estimates the focal length that makes the box a rectangle of its planned proportions, if the
/// tilt is large enough. Usual phones are the prior (26 … 50 mm on film).
/// @param map  its projection is that of a picture without distortion.
[[nodiscard]] PhotoPose FindPose(const PageView& page, const PageMap& map,
                                 const PhotoSource& source);

/// Apparent displacement of a line along an axis of the sheet, and its change along the axis.
struct RadialLever {
  double height = 0;         ///< mm per mm that the line is higher than the reference tool's
  double height_per_mm = 0;  ///< the same per mm along the axis
  double colour_mm_px = 0;   ///< mm per px that its colour lies further out, in the corner
  double colour_per_px = 0;  ///< the same per mm along the axis
};

[[nodiscard]] RadialLever LeverAt(const PhotoPose& pose, const PageMap& map, Axis axis,
                                  SheetPoint point);

/// Camera of a photo, and the quality of its fit.
struct PhotoOnPage {
  PhotoPose pose;
  RadialSpread spread;   ///< assumed spread
  double rms_mm = 0;     ///< of box and reference tool's fingers from the map
  int fingers = 0;       ///< reference tool's fingers found
  double px_per_mm = 0;  ///< at the sheet's smallest scale
  double blur_px = 0;    ///< 1 sigma, of the reference tool's lines
};

/// Returns the middle of the part of a finger that extends beyond the other comb.
[[nodiscard]] SheetPoint OuterMiddle(const SheetPlan& plan, const Structure& structure,
                                     std::size_t comb, int finger);

/// Replaces the sheet's map, whose sides bend as scans do, by that of a camera, and estimates the
/// camera's pose.
///
/// Fits the projection (8), two coefficients of radial distortion about the picture's middle and
/// the paper's bow (3) by least squares with Huber's weights, to points on the box and to the
/// reference tool's fingers, each along its own axis. The remainder (waves of the paper, a lens
/// that is not centred) may reach some hundredths of a mm. That is enough to find every leg, whose
/// place among its neighbours is read apart from the map.
/// @param sheet  as found: right to 0.4 mm everywhere.
/// @returns errors (kMeasurement): fewer than a third of the reference tool's fingers were found,
/// or they are farther from the map than paper and lenses of phones bend.
[[nodiscard]] Result<PhotoOnPage> FitPhotoMap(const PageView& page, const SheetPlan& plan,
                                              const PhotoSource& source, SheetOnPage& sheet);

}  // namespace trammel::tool_offset
