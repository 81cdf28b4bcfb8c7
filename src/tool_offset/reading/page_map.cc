#include "tool_offset/reading/page_map.h"

#include <algorithm>
#include <cmath>

namespace trammel::tool_offset {
namespace {

/// Beyond the box a cubic means nothing any more.
double Cubic(const std::array<double, 4>& c, double t) {
  const double x = std::clamp(t, -1.05, 1.05);
  return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

double Between(double lower, double upper, double t) {
  return (lower * (1 - t) + upper * (1 + t)) / 2;
}

}  // namespace

SheetPoint CameraBend::OnPlane(SheetPoint point) const {
  const double u = point.u_mm / reach_mm;
  const double v = point.v_mm / reach_mm;
  const double above_mm = bow_mm[0] * u * u + bow_mm[1] * u * v + bow_mm[2] * v * v;
  const double outwards = above_mm / height_mm;
  return {point.u_mm + outwards * (point.u_mm - foot.u_mm),
          point.v_mm + outwards * (point.v_mm - foot.v_mm)};
}

PagePoint CameraBend::Seen(PagePoint straight) const {
  const PagePoint from_centre = straight - centre;
  const double r = Length(from_centre) / focal_px;
  const double r2 = r * r;
  return centre + (1 + r2 * (radial[0] + r2 * radial[1])) * from_centre;
}

PagePoint PageMap::ToPage(SheetPoint point) const {
  if (camera) point = camera->OnPlane(point);
  const double s = point.u_mm / half_width_mm;
  const double t = point.v_mm / half_height_mm;
  const double u_mm = point.u_mm + Between(Cubic(bend_mm[kLeft], t), Cubic(bend_mm[kRight], t), s);
  const double v_mm = point.v_mm + Between(Cubic(bend_mm[kBottom], s), Cubic(bend_mm[kTop], s), t);
  const double nearness = 1 + lean_per_mm.u_mm * u_mm + lean_per_mm.v_mm * v_mm;
  const PagePoint straight = middle + (u_mm / nearness) * u_px_mm + (v_mm / nearness) * v_px_mm;
  return camera ? camera->Seen(straight) : straight;
}

LocalMap PageMap::Near(SheetPoint point) const {
  constexpr double kStep_mm = 1;
  const auto slope = [&](double u_mm, double v_mm) {
    return (1 / (2 * kStep_mm)) * (ToPage({point.u_mm + u_mm, point.v_mm + v_mm}) -
                                   ToPage({point.u_mm - u_mm, point.v_mm - v_mm}));
  };
  return {ToPage(point), slope(kStep_mm, 0), slope(0, kStep_mm)};
}

double PageMap::perspective() const {
  return 2 * std::hypot(lean_per_mm.u_mm * half_width_mm, lean_per_mm.v_mm * half_height_mm);
}

std::optional<PageMap> MapOfCorners(const std::array<PagePoint, 4>& corners, double width_mm,
                                    double height_mm) {
  const auto cross = [](PagePoint a, PagePoint b) { return a.x_px * b.y_px - a.y_px * b.x_px; };
  const double way = cross(corners[1] - corners[0], corners[3] - corners[0]);
  for (std::size_t i = 0; i < 4; ++i) {
    const double turn = cross(corners[(i + 1) % 4] - corners[i], corners[(i + 3) % 4] - corners[i]);
    if (!(turn * way > 0)) return std::nullopt;
  }
  // The projection of a unit square's corners (Heckbert 1989), with s and t from 0 to 1.
  const PagePoint along = corners[1] - corners[2];
  const PagePoint aside = corners[3] - corners[2];
  const PagePoint rest = corners[0] - corners[1] + corners[2] - corners[3];
  const double g = cross(rest, aside) / cross(along, aside);
  const double h = cross(along, rest) / cross(along, aside);
  const PagePoint s_px = corners[1] - corners[0] + g * corners[1];
  const PagePoint t_px = corners[3] - corners[0] + h * corners[3];
  // The same about the middle, in mm.
  const double nearness = 1 + g / 2 + h / 2;
  PageMap map;
  map.half_width_mm = width_mm / 2;
  map.half_height_mm = height_mm / 2;
  map.lean_per_mm = {g / nearness / width_mm, h / nearness / height_mm};
  map.middle = (1 / nearness) * (corners[0] + 0.5 * s_px + 0.5 * t_px);
  map.u_px_mm = (1 / (nearness * width_mm)) * (s_px - g * map.middle);
  map.v_px_mm = (1 / (nearness * height_mm)) * (t_px - h * map.middle);
  return map;
}

}  // namespace trammel::tool_offset
