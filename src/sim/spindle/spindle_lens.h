// Points and rotations of the virtual spindle's chain of frames.
#pragma once

#include <array>
#include <optional>

namespace trammel::sim {

/// Point or direction; mm, rad or dimensionless, as its name states.
using Triple = std::array<double, 3>;
/// Rotation matrix, row by row.
using Turn = std::array<Triple, 3>;

[[nodiscard]] Triple operator+(const Triple& a, const Triple& b);
[[nodiscard]] Triple operator-(const Triple& a, const Triple& b);
[[nodiscard]] Triple operator*(double factor, const Triple& a);
[[nodiscard]] double Dot(const Triple& a, const Triple& b);
[[nodiscard]] Triple Cross(const Triple& a, const Triple& b);
/// REQUIRES a nonzero vector.
[[nodiscard]] Triple UnitOf(const Triple& a);

[[nodiscard]] Turn operator*(const Turn& a, const Turn& b);
[[nodiscard]] Triple operator*(const Turn& turn, const Triple& a);
[[nodiscard]] Turn Back(const Turn& turn);  ///< the inverse

/// Returns the right-handed rotation about the axis.
[[nodiscard]] Turn TurnX(double angle_rad);
[[nodiscard]] Turn TurnY(double angle_rad);
[[nodiscard]] Turn TurnZ(double angle_rad);

/// Frame in another frame: outer = turn · inner + origin_mm.
struct Place {
  Triple origin_mm = {};
  Turn turn = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

  [[nodiscard]] Triple Out(const Triple& inner_mm) const;
  [[nodiscard]] Triple In(const Triple& outer_mm) const;
};
/// Composes outer_from_inner of two frames.
[[nodiscard]] Place operator*(const Place& outer, const Place& inner);
[[nodiscard]] Place Back(const Place& place);  ///< inner_from_outer

/// Applies eq. 2 of the paper: first about x by alpha, then about the fixed y by beta, the fixed z
/// by gamma.
[[nodiscard]] Turn TurnOf(const Triple& angles_rad);

/// Column and row, px; (0, 0) is the centre of the first pixel.
using PixelPlace = std::array<double, 2>;

/// The defaults are Table 1 of Mendikute et al. Its lens maps *measured* to ideal points: with m =
/// (x, y) about the principal point and r² = x² + y², in px,
/// ideal = m (1 + k1 r² + k2 r⁴) + (p1 (r² + 2 x²) + 2 p2 x y, p2 (r² + 2 y²) + 2 p1 x y).
struct SpindleLens {
  int width_px = 2592;   ///< 16 … 20000
  int height_px = 1944;  ///< 16 … 20000
  double pixel_pitch_mm = 0.0022;
  double focal_length_mm = 6.189;
  /// Offset of the principal point from the image's centre ((W - 1) / 2, (H - 1) / 2): column, row.
  PixelPlace principal_offset_px = {-8.732, 27.52};
  double k1 = 2.997e-8;    ///< px^-2
  double k2 = -1.937e-15;  ///< px^-4
  double p1 = -6.188e-8;   ///< px^-1
  double p2 = 3.408e-7;    ///< px^-1
  /// Pose of the camera frame in the taper frame.
  Triple offset_mm = {-2.139, 0.301, -320.3};
  Triple angles_rad = {-0.003, -0.009, 0.03};
  /// True if visible points are at w > 0. Table 1's are at w < 0, where u / w and v / w with rows
  /// that run down make a mirror image.
  bool along_plus_z = false;
};

/// Returns the same camera in the same position, with its frame rotated by half a turn about its
/// own x: it looks along its +z and its pictures are upright, like those of every real sensor.
[[nodiscard]] SpindleLens AsRealCamera(const SpindleLens& lens);

/// Returns the focal length in px.
[[nodiscard]] double FocalPx(const SpindleLens& lens);
[[nodiscard]] PixelPlace PrincipalPx(const SpindleLens& lens);

/// Returns the line of sight of a pixel: (x, y) of the point (x, y, 1) · w, any w, in the camera
/// frame.
[[nodiscard]] std::array<double, 2> DirectionOf(const SpindleLens& lens, const PixelPlace& pixel);

/// Computes the pixel of a point in the camera frame, by inverting DirectionOf to 1e-12 px. Absent
/// behind the camera and where the lens folds. May be outside the picture.
[[nodiscard]] std::optional<PixelPlace> SeenAt(const SpindleLens& lens, const Triple& camera_mm);

[[nodiscard]] bool InPicture(const SpindleLens& lens, const PixelPlace& pixel, double margin_px);

}  // namespace trammel::sim
