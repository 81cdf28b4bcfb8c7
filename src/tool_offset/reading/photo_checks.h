// What makes a photo of a sheet unfit to be measured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tool_offset/reading/photo_map.h"

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

}  // namespace trammel::tool_offset
