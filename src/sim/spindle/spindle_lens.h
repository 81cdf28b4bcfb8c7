// Points and turns of the virtual spindle's chain of frames.
#pragma once

#include <array>
#include <optional>

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

/// Column and row, px; (0, 0) is the centre of the first pixel.
using PixelPlace = std::array<double, 2>;

/// The defaults are Table 1 of Mendikute et al. Its lens maps what is *measured* to what is ideal:
/// with m = (x, y) about the principal point and r² = x² + y², in px,
/// ideal = m (1 + k1 r² + k2 r⁴) + (p1 (r² + 2 x²) + 2 p2 x y, p2 (r² + 2 y²) + 2 p1 x y).
struct SpindleLens {
  int width_px = 2592;   ///< 16 … 20000
  int height_px = 1944;  ///< 16 … 20000
  double pixel_pitch_mm = 0.0022;
  double focal_length_mm = 6.189;
  /// Of the principal point from the image's centre ((W - 1) / 2, (H - 1) / 2): column, row.
  PixelPlace principal_offset_px = {-8.732, 27.52};
  double k1 = 2.997e-8;    ///< px^-2
  double k2 = -1.937e-15;  ///< px^-4
  double p1 = -6.188e-8;   ///< px^-1
  double p2 = 3.408e-7;    ///< px^-1
  /// Of the camera frame in the taper frame.
  Triple offset_mm = {-2.139, 0.301, -320.3};
  Triple angles_rad = {-0.003, -0.009, 0.03};
  /// Whether what it sees lies at w > 0. Table 1's lies at w < 0, where u / w and v / w with rows
  /// that run down make a mirror image.
  bool along_plus_z = false;
};

/// The same camera in the same place, its frame turned half about its own x: looks along its +z and
/// its pictures are upright, as those of every real sensor.
[[nodiscard]] SpindleLens AsRealCamera(const SpindleLens& lens);

/// Focal length in px.
[[nodiscard]] double FocalPx(const SpindleLens& lens);
[[nodiscard]] PixelPlace PrincipalPx(const SpindleLens& lens);

/// The line of sight of a pixel: (x, y) of the point (x, y, 1) · w, any w, in the camera frame.
[[nodiscard]] std::array<double, 2> DirectionOf(const SpindleLens& lens, const PixelPlace& pixel);

/// Where a point of the camera frame is seen, found by inverting DirectionOf to 1e-12 px. Absent
/// behind the camera and where the lens folds. May lie outside the picture.
[[nodiscard]] std::optional<PixelPlace> SeenAt(const SpindleLens& lens, const Triple& camera_mm);

[[nodiscard]] bool InPicture(const SpindleLens& lens, const PixelPlace& pixel, double margin_px);

}  // namespace trammel::sim
