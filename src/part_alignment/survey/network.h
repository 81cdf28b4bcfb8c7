// Network of a survey by a hand-held camera: one lens for all pictures, calibrated along with the
// part.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "part_alignment/network/observation.h"

namespace trammel::part_alignment {

/// Indices of Lens: a pin-hole along +z, square pixels, (0, 0) the centre of the first pixel. With
/// x = u / w, y = v / w, r² = x² + y² (OpenCV's model, dimensionless coefficients):
///   column = c + f [x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)], row likewise.
enum LensIndex { kFocal, kColumn, kRow, kK1, kK2, kK3, kP1, kP2, kLensParameters };

inline constexpr std::array<const char*, kLensParameters> kLensParameterNames{
    "focal_length_px", "principal_column_px", "principal_row_px", "k1", "k2", "k3", "p1", "p2"};

/// Lens parameters; f and c in px.
using Lens = Eigen::Matrix<double, kLensParameters, 1>;

/// Returns a lens without distortion, its principal point in the middle of the picture.
[[nodiscard]] Lens PlainLens(double focal_px, int width_px, int height_px);

struct LensProjection {
  Eigen::Vector2d pixel;                 ///< column, row
  Eigen::Matrix<double, 2, 3> by_point;  ///< px per unit of the point
  Eigen::Matrix<double, 2, kLensParameters> by_lens;
};

/// Projects a point of the camera's frame, with derivatives. Absent behind the camera, or more than
/// 80 degrees off its axis.
[[nodiscard]] std::optional<LensProjection> ProjectLens(const Lens& lens,
                                                        const Eigen::Vector3d& camera);

/// Computes a pixel's unit line of sight. Absent where the distortion cannot be inverted.
[[nodiscard]] std::optional<Eigen::Vector3d> ObservationLine(const Lens& lens,
                                                             const Eigen::Vector2d& pixel);

/// x_camera = rotation · (x_object - place).
struct Station {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< projection centre, object frame
  bool placed = false;                              ///< takes part in the adjustment

  [[nodiscard]] Eigen::Vector3d FromObject(const Eigen::Vector3d& object) const {
    return rotation * (object - place);
  }
};

struct NetworkPoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< object frame
  bool placed = false;
};

struct NetworkBar {
  std::size_t from = 0;
  std::size_t to = 0;
  double length = 0;
  double sigma = 0;  ///< k = 1
  bool used = true;
};

/// Network in any unit of length until bars are used.
struct Network {
  Lens lens = Lens::Zero();
  std::vector<Station> stations;
  std::vector<NetworkPoint> points;
  std::vector<NetworkObservation> observations;
  std::vector<NetworkBar> bars;
};

/// True if an observation is used and both of its ends are placed.
[[nodiscard]] bool TakesPart(const Network& network, const NetworkObservation& observation);
/// True if the bar is used.
[[nodiscard]] bool TakesPart(const Network& network, const NetworkBar& bar);

/// Computes projected minus observed, px; absent if the point is not in front of the camera.
[[nodiscard]] std::optional<Eigen::Vector2d> Misclosure(const Network& network,
                                                        const NetworkObservation& observation);

/// Returns the point nearest to lines (positions and unit directions); absent for parallel ones.
[[nodiscard]] std::optional<Eigen::Vector3d> Intersect(
    const std::vector<Eigen::Vector3d>& places, const std::vector<Eigen::Vector3d>& directions);

/// Rotates, moves and scales the whole network: x -> scale · rotation · (x - origin).
void Transform(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& origin, double scale,
               Network& network);

}  // namespace trammel::part_alignment
