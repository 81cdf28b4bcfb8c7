// Tells a scan from a photo, and what makes a photo unfit to be measured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/page.h"
#include "tool_offset/reading/photo_map.h"
#include "tool_offset/reading/sheet_finder.h"

namespace trammel::tool_offset {

/// What a photo must have at least.
inline constexpr double kLeastPhotoScale_px_mm = 9;  // a line of 0.4 mm is 4 px wide
inline constexpr double kMostPhotoBlur_px = 2.5;
inline constexpr double kMostPhotoBlur_mm = 0.18;  // two legs then run together
inline constexpr double kMostPhotoTilt_deg = 35;

/// How blurred the box's lines are, 1 sigma of a Gauss curve that a line's two edges are smeared
/// by, on the side where they are blurred most; whatever their width.
/// @param sheet  as found, its map that of a scan or of a photo.
[[nodiscard]] double BlurOfBox_px(const PageView& page, const SheetPlan& plan,
                                  const SheetOnPage& sheet);

/// Why the photo cannot be measured, and what to do; nothing where it can.
[[nodiscard]] std::optional<std::string> PhotoFault(const PhotoOnPage& photo);

/// Of each structure, whether a lamp's reflection drowns fingers of the reference tool in it: their
/// ink is less dark against its paper than elsewhere, which uneven light alone does not do, and the
/// paper is brighter.
[[nodiscard]] std::vector<bool> GlareOver(const PageView& page, const SheetPlan& plan,
                                          const PageMap& map);

/// Dots per inch along a row and down the page.
struct Resolution {
  double x = 0;
  double y = 0;
};

/// What a file states of itself; every part may be wrong.
struct StatedOfPage {
  std::optional<double> dpi_x;
  std::optional<double> dpi_y;
  bool film_focal = false;  ///< a camera's focal length
};

/// What the picture shows of where it comes from.
struct KindSigns {
  Resolution shown;          ///< of the sheet
  double perspective = 0;    ///< PageMap::perspective()
  double barrel_mm = 0;      ///< by which the box's sides bow outwards, as behind a lens; mean
  bool camera_size = false;  ///< IsStoredSize()
  bool stated = false;       ///< the file states the resolution that the sheet shows
  bool scanners = false;     ///< the sheet shows a resolution that scanners have, in both axes
  bool squeezed = false;     ///< rows and columns are unlike, and not by perspective
  bool flat = false;         ///< neither perspective nor a lens is seen
};

/// By how much a stated resolution may differ from what the sheet shows: printers' and scanners'
/// scales do by up to 0.5 % each.
inline constexpr double kSameResolution = 0.02;

[[nodiscard]] Resolution ShownResolution(const PageMap& map);

[[nodiscard]] KindSigns SignsOf(const PageView& page, const PageMap& map,
                                const StatedOfPage& stated);

/// The kind that alone explains the signs. A photo read as a scan answers with intervals that do
/// not hold, so that a scan has to show that it is one: by the resolution that its file states, or
/// one that scanners have in a size that no camera stores, and without perspective and lens.
/// @param for_photo  whether the sheet was laid out for a photo
/// @returns nothing where both may be
[[nodiscard]] std::optional<PageKind> KindBy(const KindSigns& signs, const StatedOfPage& stated,
                                             bool for_photo);

/// Why neither kind alone explains the picture, and what to do.
[[nodiscard]] std::string WhyNoKind(const KindSigns& signs);

}  // namespace trammel::tool_offset
