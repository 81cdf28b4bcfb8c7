#include "sim/spindle/spindle_lens.h"

#include <cmath>
#include <numbers>

#include "base/check.h"

namespace trammel::sim {

Triple operator+(const Triple& a, const Triple& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

Triple operator-(const Triple& a, const Triple& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Triple operator*(double factor, const Triple& a) {
  return {factor * a[0], factor * a[1], factor * a[2]};
}

double Dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Triple Cross(const Triple& a, const Triple& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Triple UnitOf(const Triple& a) {
  const double length = std::sqrt(Dot(a, a));
  TRAMMEL_CHECK(length > 0, "a direction of length {}", length);
  return (1 / length) * a;
}

Turn operator*(const Turn& a, const Turn& b) {
  const Turn columns = Back(b);
  Turn product;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) product[i][j] = Dot(a[i], columns[j]);
  }
  return product;
}

Triple operator*(const Turn& turn, const Triple& a) {
  return {Dot(turn[0], a), Dot(turn[1], a), Dot(turn[2], a)};
}

Turn Back(const Turn& turn) {
  Turn back;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) back[i][j] = turn[j][i];
  }
  return back;
}

Turn TurnX(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{{1, 0, 0}, {0, c, -s}, {0, s, c}}};
}

Turn TurnY(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
}

Turn TurnZ(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
}

Triple Place::Out(const Triple& inner_mm) const { return turn * inner_mm + origin_mm; }

Triple Place::In(const Triple& outer_mm) const { return Back(turn) * (outer_mm - origin_mm); }

Place operator*(const Place& outer, const Place& inner) {
  return {outer.Out(inner.origin_mm), outer.turn * inner.turn};
}

Place Back(const Place& place) {
  const Turn back = Back(place.turn);
  return {-1.0 * (back * place.origin_mm), back};
}

Turn TurnOf(const Triple& angles_rad) {
  return TurnZ(angles_rad[2]) * TurnY(angles_rad[1]) * TurnX(angles_rad[0]);
}

namespace {

struct Bent {
  PixelPlace ideal;
  std::array<std::array<double, 2>, 2> by_measured;
};

// Returns the polynomial and its derivative at a measured position about the principal point.
Bent Bend(const SpindleLens& lens, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1 + lens.k1 * r2 + lens.k2 * r2 * r2;
  const double slope = 2 * (lens.k1 + 2 * lens.k2 * r2);  // d(radial) = slope · (x dx + y dy)
  Bent bent;
  bent.ideal = {x * radial + lens.p1 * (r2 + 2 * x * x) + 2 * lens.p2 * x * y,
                y * radial + lens.p2 * (r2 + 2 * y * y) + 2 * lens.p1 * x * y};
  bent.by_measured[0][0] = radial + slope * x * x + 6 * lens.p1 * x + 2 * lens.p2 * y;
  bent.by_measured[0][1] = slope * x * y + 2 * lens.p1 * y + 2 * lens.p2 * x;
  bent.by_measured[1][0] = slope * x * y + 2 * lens.p2 * x + 2 * lens.p1 * y;
  bent.by_measured[1][1] = radial + slope * y * y + 6 * lens.p2 * y + 2 * lens.p1 * x;
  return bent;
}

}  // namespace

SpindleLens AsRealCamera(const SpindleLens& lens) {
  SpindleLens real = lens;
  if (lens.along_plus_z) return real;
  // Rz Ry Rx(alpha) · Rx(pi): the half turn is applied first, so it adds to alpha.
  real.angles_rad[0] = std::remainder(lens.angles_rad[0] + std::numbers::pi, 2 * std::numbers::pi);
  real.along_plus_z = true;
  return real;
}

double FocalPx(const SpindleLens& lens) { return lens.focal_length_mm / lens.pixel_pitch_mm; }

PixelPlace PrincipalPx(const SpindleLens& lens) {
  return {(lens.width_px - 1) / 2.0 + lens.principal_offset_px[0],
          (lens.height_px - 1) / 2.0 + lens.principal_offset_px[1]};
}

std::array<double, 2> DirectionOf(const SpindleLens& lens, const PixelPlace& pixel) {
  const PixelPlace principal = PrincipalPx(lens);
  const PixelPlace ideal = Bend(lens, pixel[0] - principal[0], pixel[1] - principal[1]).ideal;
  return {ideal[0] / FocalPx(lens), ideal[1] / FocalPx(lens)};
}

std::optional<PixelPlace> SeenAt(const SpindleLens& lens, const Triple& camera_mm) {
  constexpr int kSteps = 50;
  constexpr double kDone_px = 1e-12;
  constexpr double kRounding_px = 1e-9;  // coordinates of 1e4 px are not finer than 2e-12
  const double ahead_mm = lens.along_plus_z ? camera_mm[2] : -camera_mm[2];
  if (!(ahead_mm > 1e-6)) return std::nullopt;
  const double x = FocalPx(lens) * camera_mm[0] / camera_mm[2];
  const double y = FocalPx(lens) * camera_mm[1] / camera_mm[2];
  double at_x = x;
  double at_y = y;
  double size = 0;
  for (int i = 0; i < kSteps; ++i) {
    const Bent bent = Bend(lens, at_x, at_y);
    const auto& d = bent.by_measured;
    const double determinant = d[0][0] * d[1][1] - d[0][1] * d[1][0];
    if (!(determinant > 0.05)) return std::nullopt;  // it folds at 0
    const double miss_x = x - bent.ideal[0];
    const double miss_y = y - bent.ideal[1];
    const double step_x = (d[1][1] * miss_x - d[0][1] * miss_y) / determinant;
    const double step_y = (d[0][0] * miss_y - d[1][0] * miss_x) / determinant;
    at_x += step_x;
    at_y += step_y;
    size = std::hypot(step_x, step_y);
    if (size < kDone_px) break;
  }
  if (!(size < kRounding_px)) return std::nullopt;
  const PixelPlace principal = PrincipalPx(lens);
  return PixelPlace{principal[0] + at_x, principal[1] + at_y};
}

bool InPicture(const SpindleLens& lens, const PixelPlace& pixel, double margin_px) {
  return pixel[0] >= margin_px && pixel[0] <= lens.width_px - 1 - margin_px &&
         pixel[1] >= margin_px && pixel[1] <= lens.height_px - 1 - margin_px;
}

}  // namespace trammel::sim
