#include "pressure_advance/photo/photo_comb.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vision/comb_pattern.h"
#include "vision/filament_contrast.h"
#include "vision/rectify.h"

namespace trammel::pressure_advance {
namespace {

// 1 where a rectified picture shows the photo.
vision::GrayImage SeenPart(const BgrView& photo, const vision::Homography& photo_from_view,
                           int width_px, int height_px) {
  vision::GrayImage seen(width_px, height_px);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const vision::PointPx p = photo_from_view({double(x), double(y)});
      const bool inside = p.x >= 0 && p.y >= 0 && p.x <= photo.width - 1 && p.y <= photo.height - 1;
      seen.row(y)[x] = inside ? 1.0F : 0.0F;
    }
  }
  return seen;
}

}  // namespace

std::optional<CombView> LookAtComb(const BgrView& photo, const vision::FoundComb& comb) {
  using vision::Distance_px;
  const vision::Quad& corners = comb.corners;
  double width = std::max(Distance_px(corners[0], corners[1]), Distance_px(corners[3], corners[2]));
  double height =
      std::max(Distance_px(corners[1], corners[2]), Distance_px(corners[0], corners[3]));
  const double shrink = std::min(1.0, kLongestRectified_px / std::max(width, height));
  width *= shrink;
  height *= shrink;
  constexpr double kSmallest_px = 60;
  if (std::min(width, height) < kSmallest_px) return std::nullopt;
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  const vision::Quad target{{{0, 0}, {w - 1.0, 0}, {w - 1.0, h - 1.0}, {0, h - 1.0}}};
  vision::Quad in_mask;
  for (std::size_t i = 0; i < 4; ++i) {
    in_mask[i] = {(corners[i].x + 0.5) * comb.filament_scale - 0.5,
                  (corners[i].y + 0.5) * comb.filament_scale - 0.5};
  }
  const auto photo_from_view = vision::TargetFromSource(corners, target);
  const auto mask_from_view = vision::TargetFromSource(in_mask, target);
  if (!photo_from_view || !mask_from_view) return std::nullopt;
  CombView view;
  view.corners = corners;
  view.picture = vision::Rectify(photo, *photo_from_view, w, h);
  const vision::GrayImage seen = SeenPart(photo, *photo_from_view, w, h);
  vision::GrayImage mask = vision::Rectify(comb.filament, *mask_from_view, w, h);
  for (std::size_t i = 0; i < mask.value.size(); ++i) {
    if (seen.value[i] < 0.5F) mask.value[i] = 0.5F;  // neither filament nor plate
  }
  vision::CombPlaces places;
  places.count = comb.places;
  places.pitch_px = (h - 1) / (comb.places - 1 + 2 * comb.around);
  places.first_y_px = comb.around * places.pitch_px;
  const int surroundings = std::max(5, static_cast<int>(2 * places.pitch_px)) | 1;
  const auto weights = vision::FindContrast(view.picture.view(), mask, surroundings);
  if (!weights) return std::nullopt;
  view.contrast = vision::Mix(view.picture.view(), *weights);
  view.line_pattern = vision::TraceComb(view.contrast, seen, places);
  return view;
}

}  // namespace trammel::pressure_advance
