// Points and turns of the virtual spindle's chain of frames.
#pragma once

#include <array>

namespace trammel::sim {

/// A point or a direction; mm, rad or a bare number, as its name says.
using Triple = std::array<double, 3>;
/// A rotation matrix, row after row.
using Turn = std::array<Triple, 3>;

[[nodiscard]] Triple operator+(const Triple& a, const Triple& b);
[[nodiscard]] Triple operator-(const Triple& a, const Triple& b);
[[nodiscard]] Triple operator*(double factor, const Triple& a);
[[nodiscard]] double Dot(const Triple& a, const Triple& b);
[[nodiscard]] Triple Cross(const Triple& a, const Triple& b);
/// REQUIRES a vector that is not zero.
[[nodiscard]] Triple UnitOf(const Triple& a);

[[nodiscard]] Turn operator*(const Turn& a, const Turn& b);
[[nodiscard]] Triple operator*(const Turn& turn, const Triple& a);
[[nodiscard]] Turn Back(const Turn& turn);  ///< the inverse

/// Right-handed turns about the axes.
[[nodiscard]] Turn TurnX(double angle_rad);
[[nodiscard]] Turn TurnY(double angle_rad);
[[nodiscard]] Turn TurnZ(double angle_rad);

/// A frame in another: outer = turn · inner + origin_mm.
struct Place {
  Triple origin_mm = {};
  Turn turn = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

  [[nodiscard]] Triple Out(const Triple& inner_mm) const;
  [[nodiscard]] Triple In(const Triple& outer_mm) const;
};
/// outer_from_inner of two places, one after the other.
[[nodiscard]] Place operator*(const Place& outer, const Place& inner);
[[nodiscard]] Place Back(const Place& place);  ///< inner_from_outer

/// Eq. 2 of the paper: first about x by alpha, then about the fixed y by beta, the fixed z by
/// gamma.
[[nodiscard]] Turn TurnOf(const Triple& angles_rad);

}  // namespace trammel::sim
