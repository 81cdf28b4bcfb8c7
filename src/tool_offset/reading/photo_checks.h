// Distinguishes a scan from a photo, and finds faults that make a photo unfit for measurement.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/page.h"
#include "tool_offset/reading/photo_map.h"
#include "tool_offset/reading/sheet_finder.h"

namespace trammel::tool_offset {

/// Limits of a usable photo.
inline constexpr double kMinPhotoScale_px_mm = 9;  // a line of 0.4 mm is 4 px wide
inline constexpr double kMaxPhotoBlur_px = 2.5;
inline constexpr double kMaxPhotoBlur_mm = 0.18;  // two legs then run together
inline constexpr double kMaxPhotoTilt_deg = 35;

/// Measures the blur of the box's lines on their worst side, whatever their width. Unit: 1 sigma of
/// the Gauss curve that smears a line's two edges.
/// @param sheet  as found, its map that of a scan or of a photo.
[[nodiscard]] double BlurOfBox_px(const PageView& page, const SheetPlan& plan,
                                  const SheetOnPage& sheet);

/// Explains why the photo cannot be measured, and what to do; nothing if it can.
[[nodiscard]] std::optional<std::string> PhotoFault(const PhotoOnPage& photo);

/// Returns, per structure, whether a lamp's reflection drowns fingers of the reference tool. Their
/// ink is less dark against its paper than elsewhere, which uneven light alone does not cause, and
/// the paper is brighter.
[[nodiscard]] std::vector<bool> GlareOver(const PageView& page, const SheetPlan& plan,
                                          const PageMap& map);

/// Dots per inch along a row and down the page.
struct Resolution {
  double x = 0;
  double y = 0;
};

/// Resolution stated in a file; every part may be wrong.
struct StatedOfPage {
  std::optional<double> dpi_x;
  std::optional<double> dpi_y;
  bool film_focal = false;  ///< a camera's focal length
};

/// Signs of the picture's origin.
struct KindSigns {
  Resolution shown;          ///< sheet's resolution
  double perspective = 0;    ///< PageMap::perspective()
  double barrel_mm = 0;      ///< mean outward bow of the box's sides, as by a lens
  bool camera_size = false;  ///< IsStoredSize()
  bool stated = false;       ///< the file states the resolution that the sheet shows
  bool scanners = false;     ///< the sheet shows a resolution that scanners have, in both axes
  bool squeezed = false;     ///< rows and columns are unlike, and not by perspective
  bool flat = false;         ///< neither perspective nor a lens is seen
};

/// Largest relative difference of a stated resolution from the sheet's: printers' and scanners'
/// scales differ by up to 0.5 % each.
inline constexpr double kSameResolution = 0.02;

[[nodiscard]] Resolution ShownResolution(const PageMap& map);

[[nodiscard]] KindSigns SignsOf(const PageView& page, const PageMap& map,
                                const StatedOfPage& stated);

/// Returns the only kind that explains the signs. A photo read as a scan yields wrong intervals, so
/// a scan has to prove itself: by the resolution that its file states, or one that scanners have in
/// a size that no camera stores, and without perspective and lens.
/// @param for_photo  true if the sheet was laid out for a photo
/// @returns nothing if both are possible
[[nodiscard]] std::optional<PageKind> KindBy(const KindSigns& signs, const StatedOfPage& stated,
                                             bool for_photo);

/// Explains why neither kind alone matches the picture, and what to do.
[[nodiscard]] std::string WhyNoKind(const KindSigns& signs);

}  // namespace trammel::tool_offset
