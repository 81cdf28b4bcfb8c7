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

// 1 on the lines' cores, 0 in the middle of the spaces between them, one half where it may be
// either: where the lines lie is known, and what is brighter or darker there need not be filament.
vision::GrayImage LinesAndSpaces(const vision::GrayImage& seen, const vision::CombPlaces& places,
                                 double beside) {
  constexpr double kCore = 0.15, kSpace = 0.38;  // pitches from the nearest place
  vision::GrayImage mask(seen.width, seen.height);
  std::fill(mask.value.begin(), mask.value.end(), 0.5F);
  const double lines_px = seen.width / (1 + 2 * beside);
  const int from = static_cast<int>(beside * lines_px),
            to = static_cast<int>((1 + beside) * lines_px);
  for (int y = 0; y < seen.height; ++y) {
    const double place = (y - places.first_y_px) / places.pitch_px;
    if (place < -0.5 || place > places.count - 0.5) continue;
    const double off = std::abs(place - std::round(place));
    if (off > kCore && off < kSpace) continue;
    for (int x = from; x < to; ++x) {
      if (seen.row(y)[x] > 0.5F) mask.row(y)[x] = off <= kCore ? 1.0F : 0.0F;
    }
  }
  return mask;
}

}  // namespace

std::optional<CombView> LookAtComb(const BgrView& photo, const vision::FoundComb& comb,
                                   double longest_px) {
  using vision::Distance_px;
  const vision::Quad& corners = comb.corners;
  double width = std::max(Distance_px(corners[0], corners[1]), Distance_px(corners[3], corners[2]));
  double height =
      std::max(Distance_px(corners[1], corners[2]), Distance_px(corners[0], corners[3]));
  const double shrink = std::min(1.0, longest_px / std::max(width, height));
  width *= shrink;
  height *= shrink;
  constexpr double kSmallest_px = 60;
  if (std::min(width, height) < kSmallest_px) return std::nullopt;
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  const vision::Quad target{{{0, 0}, {w - 1.0, 0}, {w - 1.0, h - 1.0}, {0, h - 1.0}}};
  const auto photo_from_view = vision::TargetFromSource(corners, target);
  if (!photo_from_view) return std::nullopt;
  CombView view;
  view.corners = corners;
  view.picture = vision::Rectify(photo, *photo_from_view, w, h);
  const vision::GrayImage seen = SeenPart(photo, *photo_from_view, w, h);
  vision::CombPlaces places;
  places.count = comb.places;
  places.pitch_px = (h - 1) / (comb.places - 1 + 2 * comb.around);
  places.first_y_px = comb.around * places.pitch_px;
  const int surroundings = std::max(5, static_cast<int>(2 * places.pitch_px)) | 1;
  const auto weights = vision::FindContrast(
      view.picture.view(), LinesAndSpaces(seen, places, comb.beside), surroundings);
  if (!weights) return std::nullopt;
  view.contrast = vision::Mix(view.picture.view(), *weights);
  view.line_pattern = vision::TraceComb(view.contrast, seen, places);
  return view;
}

}  // namespace trammel::pressure_advance
