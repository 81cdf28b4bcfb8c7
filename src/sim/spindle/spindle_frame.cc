#include "sim/spindle/spindle_frame.h"

#include <cmath>

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

}  // namespace trammel::sim
