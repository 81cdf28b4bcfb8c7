// A place in space by the sights that meet there, and what says that something stands at it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "part_alignment/survey/plain_sights.h"

namespace trammel::part_alignment {

inline constexpr double kPlainBand = 3;  ///< sigmas, to each side of an epipolar line

/// Where plain targets may be: a box in the object frame.
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
  /// Rays that are not in the plane which has most of the others: each of them confirms the place
  /// by itself.
  int off_plane = 0;
  /// Rays in that plane, beside two, which nothing else in their pictures can be taken for. Not
  /// counted where rays off the plane are many.
  int lonely = 0;
  double chi_square = 0;  ///< of 2 · members - 3 degrees
  bool merges = false;    ///< some views make one disc of it and a neighbour
};

/// The stretch of a line within the room, as distances from its origin.
[[nodiscard]] std::optional<std::pair<double, double>> StretchWithin(
    const PlainRoom& room, const Eigen::Vector3d& from, const Eigen::Vector3d& direction);
[[nodiscard]] bool InRoom(const PlainRoom& room, const Eigen::Vector3d& at);

[[nodiscard]] bool HasMember(const PlainMatch& match, const PlainMember& member);
/// Views that show both.
[[nodiscard]] int SeenTogether(const PlainMatch& a, const PlainMatch& b);

/// The place where members meet, by least squares. @returns false if they do not.
[[nodiscard]] bool IntersectSights(const std::vector<PlainView>& views, PlainMatch& match);

/// Sights of a view that a place explains: up to a chi-square of two degrees.
[[nodiscard]] std::vector<std::size_t> SightsAt(const PlainView& view, const PlainMatch& match,
                                                double gate);

/// Counts the rays that are off the plane which has most of them, and the lonely ones in it.
void CountOffPlane(const std::vector<PlainView>& views, const PlainRoom& room, PlainMatch& match);

}  // namespace trammel::part_alignment
