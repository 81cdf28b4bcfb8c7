// Plain points as lines of sight of known stations, and the places where these meet.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "part_alignment/survey/bundle.h"
#include "part_alignment/survey/survey.h"

namespace trammel::part_alignment {

/// Point of a picture, by its station without the lens: x / z and y / z.
struct PlainObservation {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  /// Covariance of the slope: the point's own scatter, and the errors of station and lens.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  /// Second moments of its outline in slopes; absent: unknown.
  std::optional<Eigen::Matrix2d> moments = std::nullopt;
  std::size_t point = 0;  ///< index into the picture's plain points
};

/// Projection of a point in space into a station.
struct SlopePrediction {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, 3> by_place = Eigen::Matrix<double, 2, 3>::Zero();
};

/// Station with its sights, in cells.
class PlainView {
 public:
  /// @param precision  of the station and the lens; absent: they are taken as known.
  /// @param range      roughly how far what it sees is.
  /// @param noise      factor on the points' own sigmas.
  PlainView(const SurveyPicture& picture, const Station& station, const Lens& lens,
            const NetworkPrecision::StationPrecision* precision, double range, double noise);

  [[nodiscard]] const Station& station() const { return station_; }
  [[nodiscard]] const std::vector<PlainObservation>& sights() const { return sights_; }
  /// Covariance of a usual sight.
  [[nodiscard]] const Eigen::Matrix2d& usual_covariance() const { return usual_; }
  /// Returns the picture's area, in slopes.
  [[nodiscard]] double area() const { return size_.x() * size_.y(); }
  /// Returns px per unit of slope in the middle.
  [[nodiscard]] double focal_px() const { return focal_px_; }

  /// Predicts the slope of a point; absent behind the camera.
  [[nodiscard]] std::optional<SlopePrediction> Predict(const Eigen::Vector3d& at) const;
  [[nodiscard]] bool InPicture(const Eigen::Vector2d& slope) const;
  /// Returns the unit line of sight in the object frame.
  [[nodiscard]] Eigen::Vector3d Line(const Eigen::Vector2d& slope) const;

  /// Calls `tell` with each sight within a rectangle about a slope.
  template <class Tell>
  void Near(const Eigen::Vector2d& slope, const Eigen::Vector2d& half, Tell tell) const {
    const auto [first_x, last_x] = CellsOf(slope.x() - half.x(), slope.x() + half.x(), 0);
    const auto [first_y, last_y] = CellsOf(slope.y() - half.y(), slope.y() + half.y(), 1);
    for (int y = first_y; y <= last_y; ++y) {
      for (int x = first_x; x <= last_x; ++x) {
        for (std::size_t k = CellBegin(x, y); k < CellBegin(x, y) + CellSize(x, y); ++k) {
          const std::size_t sight = in_cells_[k];
          const Eigen::Vector2d off = (sights_[sight].slope - slope).cwiseAbs();
          if (off.x() <= half.x() && off.y() <= half.y()) tell(sight);
        }
      }
    }
  }

  /// Finds sights within `half` of the stretch between two slopes.
  void Along(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double half,
             std::vector<std::size_t>& found) const;

 private:
  static constexpr int kCells = 48;  ///< along each side
  [[nodiscard]] std::pair<int, int> CellsOf(double low, double high, int axis) const;
  [[nodiscard]] std::size_t CellBegin(int x, int y) const {
    return begins_[static_cast<std::size_t>(y * kCells + x)];
  }
  [[nodiscard]] std::size_t CellSize(int x, int y) const {
    return begins_[static_cast<std::size_t>(y * kCells + x) + 1] - CellBegin(x, y);
  }
  void FillCells();

  Station station_;
  std::vector<PlainObservation> sights_;
  Eigen::Matrix2d usual_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d size_ = Eigen::Vector2d::Ones();
  double focal_px_ = 1;
  std::vector<std::size_t> in_cells_;
  std::vector<std::size_t> begins_;
};

inline constexpr double kPlainBand = 3;  ///< sigmas, to each side of an epipolar line

/// Box in the object frame that may contain plain targets.
struct PlainRoom {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
};

struct PlainMember {
  std::size_t view = 0;
  std::size_t sight = 0;
  friend bool operator==(const PlainMember&, const PlainMember&) = default;
};

struct PlainMatch {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<PlainMember> members;  ///< ascending by view, one of each at most
  /// Number of rays outside the plane that has most of the others: each of them confirms the place
  /// by itself.
  int off_plane = 0;
  /// Number of rays in that plane, beyond two, without another candidate in their pictures. Not
  /// counted if rays off the plane are many.
  int lonely = 0;
  double chi_square = 0;  ///< 2 · members - 3 degrees of freedom
  bool merges = false;    ///< some views make one disc of it and a neighbour
};

/// Computes the stretch of a line within the room, as distances from its origin.
[[nodiscard]] std::optional<std::pair<double, double>> StretchWithin(
    const PlainRoom& room, const Eigen::Vector3d& from, const Eigen::Vector3d& direction);
[[nodiscard]] bool InRoom(const PlainRoom& room, const Eigen::Vector3d& at);

[[nodiscard]] bool HasMember(const PlainMatch& match, const PlainMember& member);
/// Counts views that show both.
[[nodiscard]] int SeenTogether(const PlainMatch& a, const PlainMatch& b);

/// Computes the place where members meet, by least squares. @returns false if they do not.
[[nodiscard]] bool IntersectRays(const std::vector<PlainView>& views, PlainMatch& match);

/// Finds sights of a view that a place explains: up to a chi-square of two degrees.
[[nodiscard]] std::vector<std::size_t> ObservationsAt(const PlainView& view,
                                                      const PlainMatch& match, double gate);

/// Counts the rays off the plane that has most of them, and the lonely ones in it.
void CountOffPlane(const std::vector<PlainView>& views, const PlainRoom& room, PlainMatch& match);

}  // namespace trammel::part_alignment
