// Where the camera was, and the map of a photo: projection, lens and bent paper, from the box and
// the reference tool's lines.
#pragma once

#include <optional>

#include "base/page.h"
#include "base/result.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/reading/sheet_finder.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// How unlike the tools' lines may be, 1 sigma of another tool's against the reference tool's: what
/// is taken for granted of a photo before it tells.
struct RadialSpread {
  /// Above the paper; [0, 1]. Nozzles stand that evenly where each tool's Z offset was set with a
  /// probe.
  double height_mm = 0.03;
  /// By which their colour lies further out in the picture's corner; [0, 10]. Lateral colour of
  /// phones is up to 0.5 px between channels.
  double colour_px = 0.2;
  /// How well both are known: degrees of freedom, > 0. Nozzles set by eye are several times as
  /// uneven.
  double freedom = 2;
};

/// What is known of the camera before the photo is read.
struct PhotoSource {
  /// As if on film of 35 mm (36 x 24 mm) over the diagonal of the whole picture, > 0; absent where
  /// the file does not say: then it follows from the box, roughly.
  std::optional<double> film_focal_mm = {};
  RadialSpread spread;
};

/// The camera over the sheet.
struct PhotoPose {
  double focal_px = 1;
  double focal_uncertainty = 0;  ///< standard, in parts of one
  bool focal_stated = false;     ///< by the file or the user
  PagePoint centre;              ///< of the picture, taken for that of the lens
  /// Standard, of the lens's axis there, along a side: small, or that of a picture that was
  /// cropped.
  double centre_uncertainty_px = 0;
  bool as_stored = true;  ///< the picture has a size that cameras store
  double corner_px = 1;   ///< from there to a corner
  SheetPoint foot;        ///< the point of the sheet's plane under the lens
  SheetPoint aim;         ///< where the lens's axis meets that plane
  double height_mm = 1;   ///< of the lens above it
  double tilt_rad = 0;    ///< between the lens's axis and the plane's normal
};

/// Whether cameras store pictures of this size: sides of whole blocks of 4 px, as 4:3, 3:2, 16:9 or
/// 1:1 to 1 %. Few that were cropped by hand have one.
[[nodiscard]] bool IsStoredSize(int width_px, int height_px);

/// The focal length that makes the box a rectangle of its planned proportions, where the tilt is
/// large enough to tell, drawn to that of usual phones (26 … 50 mm on film).
/// @param map  its projection is that of a picture without distortion.
[[nodiscard]] PhotoPose FindPose(const PageView& page, const PageMap& map,
                                 const PhotoSource& source);

/// How far a line seems to be moved along an axis of the sheet, and how that changes along the
/// axis.
struct RadialLever {
  double height = 0;         ///< mm per mm that the line is higher than the reference tool's
  double height_per_mm = 0;  ///< the same per mm along the axis
  double colour_mm_px = 0;   ///< mm per px that its colour lies further out, in the corner
  double colour_per_px = 0;  ///< the same per mm along the axis
};

[[nodiscard]] RadialLever LeverAt(const PhotoPose& pose, const PageMap& map, Axis axis,
                                  SheetPoint point);

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
