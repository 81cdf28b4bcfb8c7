#include "part_alignment/survey/plain_place.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "part_alignment/survey/network.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kOffPlane = 0.0436;  // sine of 2.5 degrees: far more than a gate, seen off a row
constexpr std::size_t kPlaneRays = 14;
constexpr int kEnough = 5;  // rays off any plane: no row of targets explains them

}  // namespace

std::optional<std::pair<double, double>> StretchWithin(const PlainRoom& room, const Vector3d& from,
                                                       const Vector3d& direction) {
  double near = 0;
  double far = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    double a = (room.low[axis] - from[axis]) / direction[axis];
    double b = (room.high[axis] - from[axis]) / direction[axis];
    if (a > b) std::swap(a, b);
    if (std::isnan(a) || std::isnan(b)) continue;
    near = std::max(near, a);
    far = std::min(far, b);
  }
  if (!(near < far) || !std::isfinite(far)) return std::nullopt;
  return std::pair(near, far);
}

bool InRoom(const PlainRoom& room, const Vector3d& at) {
  return (at.array() >= room.low.array()).all() && (at.array() <= room.high.array()).all();
}

bool HasMember(const PlainMatch& match, const PlainMember& member) {
  return std::find(match.members.begin(), match.members.end(), member) != match.members.end();
}

int SeenTogether(const PlainMatch& a, const PlainMatch& b) {
  int together = 0;
  for (std::size_t i = 0, j = 0; i < a.members.size() && j < b.members.size();) {
    const std::size_t of_a = a.members[i].view;
    const std::size_t of_b = b.members[j].view;
    if (of_a == of_b) ++together;
    if (of_a <= of_b) ++i;
    if (of_b <= of_a) ++j;
  }
  return together;
}

std::vector<std::size_t> SightsAt(const PlainView& view, const PlainMatch& match, double gate) {
  std::vector<std::size_t> found;
  const auto prediction = view.Predict(match.at);
  if (!prediction || !view.InPicture(prediction->slope)) return found;
  const Matrix2d of_place =
      prediction->by_place * match.covariance * prediction->by_place.transpose();
  constexpr double kWorse = 4;  // a sight's variance than the usual one's
  const Vector2d half =
      (gate * (of_place + kWorse * view.usual_covariance()).diagonal()).cwiseSqrt();
  view.Near(prediction->slope, half, [&](std::size_t k) {
    const PlainSight& sight = view.sights()[k];
    const Vector2d off = sight.slope - prediction->slope;
    const Matrix2d covariance = of_place + sight.covariance;
    if (off.dot(covariance.inverse() * off) <= gate) found.push_back(k);
  });
  return found;
}

bool IntersectSights(const std::vector<PlainView>& views, PlainMatch& match) {
  std::vector<Vector3d> places;
  std::vector<Vector3d> lines;
  for (const PlainMember& member : match.members) {
    const PlainView& view = views[member.view];
    places.push_back(view.station().place);
    lines.push_back(view.Line(view.sights()[member.sight].slope));
  }
  const auto start = Intersect(places, lines);
  if (!start) return false;
  match.at = *start;
  constexpr int kSteps = 3;
  for (int step = 0; step <= kSteps; ++step) {
    Matrix3d normal = Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    match.chi_square = 0;
    for (const PlainMember& member : match.members) {
      const PlainSight& sight = views[member.view].sights()[member.sight];
      const auto prediction = views[member.view].Predict(match.at);
      if (!prediction) return false;
      const Matrix2d weight = sight.covariance.inverse();
      const Vector2d off = sight.slope - prediction->slope;
      normal += prediction->by_place.transpose() * weight * prediction->by_place;
      right += prediction->by_place.transpose() * weight * off;
      match.chi_square += off.dot(weight * off);
    }
    const Eigen::LDLT<Matrix3d> factor(normal);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) return false;
    match.covariance = factor.solve(Matrix3d::Identity());
    if (step < kSteps) match.at += factor.solve(right);
  }
  return match.at.allFinite() && match.covariance.allFinite();
}

// Rays that the plane through the place with most of the others leaves out, and those in it beside
// two of them whose pictures have nothing else along the line in which they see the plane.
void CountOffPlane(const std::vector<PlainView>& views, const PlainRoom& room, PlainMatch& match) {
  match.off_plane = 0;
  match.lonely = 0;
  Vector3d plane = Vector3d::Zero();
  std::vector<Vector3d> rays;
  for (const PlainMember& member : match.members) {
    rays.push_back((views[member.view].station().place - match.at).normalized());
  }
  const std::size_t step = std::max<std::size_t>(1, rays.size() / kPlaneRays);
  int least = std::numeric_limits<int>::max();
  std::size_t of_plane = 0;
  for (std::size_t i = 0; i < rays.size(); i += step) {
    for (std::size_t j = i + step; j < rays.size(); j += step) {
      const Vector3d across = rays[i].cross(rays[j]);
      constexpr double kParallel = 0.035;  // 2 degrees: no plane
      if (across.norm() < kParallel) continue;
      const Vector3d normal = across.normalized();
      const auto off = std::count_if(rays.begin(), rays.end(), [&](const Vector3d& ray) {
        return std::abs(ray.dot(normal)) > kOffPlane;
      });
      if (static_cast<int>(off) >= least) continue;
      least = static_cast<int>(off);
      plane = normal;
      of_plane = i;
    }
  }
  if (plane.isZero()) return;
  match.off_plane = least;
  if (least >= kEnough) return;
  const PlainMember& by = match.members[of_plane];
  const PlainView& first = views[by.view];
  const Vector3d line = first.Line(first.sights()[by.sight].slope);
  const auto stretch = StretchWithin(room, first.station().place, line);
  if (!stretch) return;
  int lonely = 0;
  std::vector<std::size_t> in_band;
  for (std::size_t k = 0; k < match.members.size(); ++k) {
    const PlainView& view = views[match.members[k].view];
    if (k == of_plane || std::abs(rays[k].dot(plane)) > kOffPlane) continue;
    const auto near = view.Predict(first.station().place + stretch->first * line);
    const auto far = view.Predict(first.station().place + stretch->second * line);
    if (!near || !far) continue;
    view.Along(
        near->slope, far->slope,
        kPlainBand * std::sqrt(first.usual_covariance().trace() + view.usual_covariance().trace()),
        in_band);
    if (in_band.size() <= 1) ++lonely;
  }
  match.lonely = std::max(lonely - 1, 0);  // one of them made the pair
}

}  // namespace trammel::part_alignment
