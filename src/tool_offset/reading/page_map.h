// From the sheet to the page: where on the scan a place of the plan is to be found.
#pragma once

#include <array>
#include <optional>

#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// The sides of the box, by the sheet's coordinates.
enum Side : std::size_t { kLeft, kRight, kBottom, kTop };
inline constexpr std::size_t kSides = 4;

/// The map near one place: linear.
struct LocalMap {
  PagePoint at;
  PagePoint u_px_mm;  ///< page pixels per mm along u
  PagePoint v_px_mm;

  [[nodiscard]] PagePoint ToPage(double u_mm, double v_mm) const {
    return at + u_mm * u_px_mm + v_mm * v_px_mm;
  }
};

/// What a camera adds to the projection: its lens, and paper that is not flat.
struct CameraBend {
  PagePoint centre;     ///< of the lens
  double focal_px = 1;  ///< in which radii are counted
  /// What lies at radius r in a picture without distortion is seen at r (1 + k1 r² + k2 r⁴).
  std::array<double, 2> radial{};
  SheetPoint foot;       ///< the point of the paper's plane under the lens
  double height_mm = 1;  ///< of the lens above that plane
  double reach_mm = 1;   ///< half of the box's diagonal, in which the bow is counted
  /// Height of the paper: factors of u², u v and v², each over reach_mm². mm.
  std::array<double, 3> bow_mm{};

  [[nodiscard]] SheetPoint OnPlane(SheetPoint point) const;
  [[nodiscard]] PagePoint Seen(PagePoint straight) const;
};

/// A central projection (affine on a flatbed, not under a camera), and how the box's sides bend
/// (paper on a bed and on glass is never quite flat); between opposite sides the bending changes
/// linearly.
struct PageMap {
  PagePoint middle;   ///< of the sheet
  PagePoint u_px_mm;  ///< page pixels per mm along u, at the middle
  PagePoint v_px_mm;
  /// By how much everything is seen smaller per mm along u and v, in parts of one.
  SheetPoint lean_per_mm;
  double half_width_mm = 1;
  double half_height_mm = 1;
  /// Outward coordinate (u of left and right, v of bottom and top) that a side has beyond its
  /// planned one: a cubic in the other coordinate over its half length, lowest power first. mm.
  std::array<std::array<double, 4>, kSides> bend_mm{};
  std::optional<CameraBend> camera;  ///< of a photo

  [[nodiscard]] PagePoint ToPage(SheetPoint point) const;
  [[nodiscard]] LocalMap Near(SheetPoint point) const;
  /// How much larger one side of the box is seen than the opposite one, in parts of one.
  [[nodiscard]] double perspective() const;
  /// Whether the page shows the sheet from behind, as a mirror does.
  [[nodiscard]] bool mirrored() const {
    return u_px_mm.x_px * v_px_mm.y_px - u_px_mm.y_px * v_px_mm.x_px > 0;
  }
};

/// The map without bending that takes the box's corners (low u and v first, then round by high u)
/// to these places.
/// @returns nothing where they do not go round a convex area.
[[nodiscard]] std::optional<PageMap> MapOfCorners(const std::array<PagePoint, 4>& corners,
                                                  double width_mm, double height_mm);

}  // namespace trammel::tool_offset
