#include "report/alignment_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "report/canvas.h"

namespace trammel::report {
namespace {

constexpr double kMostSide_px = 800;
constexpr double kEnlarged = 500;  // in px of the camera: 0.1 px are 50 px of the sensor
constexpr double kLongest_px = 150;
constexpr double kCircle_px = 14;
constexpr double kArm_px = 6;
constexpr double kTitle_px = 26;
constexpr Color kFound = kSky;
constexpr Color kProjected = kVermilion;

void Cross(const PointPx& at, const Stroke& stroke, Canvas& canvas) {
  const std::array<PointPx, 2> across{PointPx{at.x - kArm_px, at.y}, PointPx{at.x + kArm_px, at.y}};
  const std::array<PointPx, 2> down{PointPx{at.x, at.y - kArm_px}, PointPx{at.x, at.y + kArm_px}};
  canvas.Polyline(across, stroke);
  canvas.Polyline(down, stroke);
}

// On any ground: dark letters on a light patch.
void Label(const PointPx& at, const std::string& text, Canvas& canvas) {
  const TextStyle style{12, kInk, Align::kStart, true};
  const double width = canvas.TextWidth(text, style);
  const double room = canvas.width_px() - width - 4;
  const PointPx from{std::clamp(at.x, 4.0, std::max(4.0, room)), std::max(at.y, 16.0)};
  canvas.FillRect({from.x - 3, from.y - 12, width + 6, 16}, Color{1, 1, 1, 0.8});
  canvas.Text(from, text, style);
}

void DrawTarget(const DrawnTarget& target, double scale, Canvas& canvas) {
  // The canvas begins at the first pixel's corner, half a pixel before its centre.
  const auto place = [scale](const Eigen::Vector2d& px) {
    return PointPx{(px.x() + 0.5) * scale, (px.y() + 0.5) * scale};
  };
  std::string text = target.id;
  if (target.found_px) {
    const Stroke edge{target.left_out ? kProjected : kFound, 2};
    canvas.Circle(place(*target.found_px), kCircle_px, std::nullopt, edge);
    if (target.left_out) text += ", left out";
  } else {
    text += ", not found";
  }
  if (target.projected_px) {
    Stroke stroke{kProjected, 1.5};
    if (!target.found_px) stroke.dash_px = {2, 2};
    Cross(place(*target.projected_px), stroke, canvas);
  }
  if (target.found_px && target.projected_px) {
    const Eigen::Vector2d residual_px = *target.found_px - *target.projected_px;
    const double norm_px = residual_px.norm();
    const double length_px = std::min(kLongest_px, norm_px * kEnlarged * scale);
    const Eigen::Vector2d end =
        norm_px > 0 ? Eigen::Vector2d(residual_px / norm_px * length_px) : residual_px;
    const PointPx at = place(*target.projected_px);
    const std::array<PointPx, 2> line{at, PointPx{at.x + end.x(), at.y + end.y()}};
    canvas.Polyline(line, Stroke{kProjected, 2.5});
    text += fmt::format("  {:+.3f}, {:+.3f} px", residual_px.x(), residual_px.y());
  }
  const PointPx at = place(target.found_px ? *target.found_px : *target.projected_px);
  Label({at.x + kCircle_px + 4, at.y - kCircle_px}, text, canvas);
}

}  // namespace

Figure AlignmentPicture(std::size_t view, const BgrView& picture, int width_px, int height_px,
                        const std::vector<DrawnTarget>& targets) {
  const double scale = kMostSide_px / std::max(width_px, height_px);
  const RectPx area{0, 0, std::ceil(width_px * scale), std::ceil(height_px * scale)};
  Canvas canvas(area.width, area.height + kTitle_px);
  if (picture.width > 0 && picture.height > 0) {
    canvas.Image(picture, area);
  } else {
    canvas.FillRect(area, kGrid);
  }
  canvas.Clip(area);
  for (const DrawnTarget& target : targets) {
    if (target.found_px || target.projected_px) DrawTarget(target, scale, canvas);
  }
  canvas.Unclip();
  canvas.Text({6, area.height + kTitle_px - 8},
              fmt::format("view {}: circle found, cross projected, line residual x {:.0f}", view,
                          kEnlarged),
              TextStyle{13});
  return {fmt::format("view{:03}", view),
          fmt::format("View {}. Circle: found; cross: where the solution projects it; line: found "
                      "less projected, {:.0f} times enlarged, at most {:.0f} px of this page. "
                      "Dashed: in the picture by the solution, but not found.",
                      view, kEnlarged, kLongest_px),
          std::move(canvas), true, 1};
}

}  // namespace trammel::report
