#include "tool_offset/page_map.h"

#include <algorithm>

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

PagePoint PageMap::ToPage(SheetPoint point) const {
  const double s = point.u_mm / half_width_mm;
  const double t = point.v_mm / half_height_mm;
  const double u_mm = point.u_mm + Between(Cubic(bend_mm[kLeft], t), Cubic(bend_mm[kRight], t), s);
  const double v_mm = point.v_mm + Between(Cubic(bend_mm[kBottom], s), Cubic(bend_mm[kTop], s), t);
  return middle + u_mm * u_px_mm + v_mm * v_px_mm;
}

LocalMap PageMap::Near(SheetPoint point) const {
  constexpr double kStep_mm = 1;
  const auto slope = [&](double u_mm, double v_mm) {
    return (1 / (2 * kStep_mm)) * (ToPage({point.u_mm + u_mm, point.v_mm + v_mm}) -
                                   ToPage({point.u_mm - u_mm, point.v_mm - v_mm}));
  };
  return {ToPage(point), slope(kStep_mm, 0), slope(0, kStep_mm)};
}

}  // namespace trammel::tool_offset
