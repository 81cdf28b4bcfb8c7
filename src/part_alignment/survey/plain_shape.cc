#include "part_alignment/survey/plain_shape.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/statistics.h"
#include "part_alignment/survey/survey_discs.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// What the outlines differ by from those of one disc, its normal times its radius given: the sum
// of squares, of an axis.
double Misfit(const std::vector<DiscShape>& shapes, const Vector3d& disc, Matrix3d& normal,
              Vector3d& right) {
  const Matrix3d of_disc = disc.squaredNorm() * Matrix3d::Identity() - disc * disc.transpose();
  double squares = 0;
  normal.setZero();
  right.setZero();
  for (const DiscShape& shape : shapes) {
    const auto& by_place = shape.by_place;
    const double weight = 1 / (4 * shape.moments.norm());  // of a² by a: 2 a
    const Matrix2d off = shape.moments - by_place * of_disc * by_place.transpose();
    squares += weight * off.squaredNorm();
    Eigen::Matrix<double, 3, 3> rows;  // both diagonals, and what stands beside them twice
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = Vector3d::Unit(axis);
      const Matrix3d change =
          2 * disc[axis] * Matrix3d::Identity() - step * disc.transpose() - disc * step.transpose();
      const Matrix2d seen = by_place * change * by_place.transpose();
      rows.col(axis) << seen(0, 0), std::numbers::sqrt2 * seen(0, 1), seen(1, 1);
    }
    normal += weight * rows.transpose() * rows;
    right +=
        weight * rows.transpose() * Vector3d(off(0, 0), std::numbers::sqrt2 * off(0, 1), off(1, 1));
  }
  return squares;
}

struct Found {
  Vector3d disc = Vector3d::Zero();
  double misfit = std::numeric_limits<double>::infinity();
};

// The least misfit that is found from one start: Levenberg-Marquardt.
Found LeastMisfit(const std::vector<DiscShape>& shapes, Vector3d disc) {
  constexpr int kSteps = 12;
  Matrix3d normal;
  Vector3d right;
  double least = Misfit(shapes, disc, normal, right);
  double damping = 1e-3;
  for (int step = 0; step < kSteps; ++step) {
    Matrix3d damped = normal;
    damped.diagonal() *= 1 + damping;
    const Vector3d tried = disc + Eigen::LDLT<Matrix3d>(damped).solve(right);
    Matrix3d next_normal;
    Vector3d next_right;
    const double misfit = Misfit(shapes, tried, next_normal, next_right);
    if (misfit < least) {
      const bool done = least - misfit < 1e-4 * least;
      disc = tried;
      least = misfit;
      normal = next_normal;
      right = next_right;
      damping *= 0.1;
      if (done) break;
    } else {
      damping *= 10;
    }
  }
  return {disc, least};
}

}  // namespace

std::optional<ShapeFit> FitShape(const std::vector<PlainView>& views, const PlainMatch& match) {
  std::vector<DiscShape> shapes;
  std::vector<std::size_t> of_shape;  // member
  double focal_px = 0;
  double radius = 0;
  Vector3d seen_from = Vector3d::Zero();
  for (std::size_t m = 0; m < match.members.size(); ++m) {
    const PlainMember& member = match.members[m];
    const PlainView& view = views[member.view];
    const auto prediction = view.Predict(match.at);
    const auto& moments = view.sights()[member.sight].moments;
    if (!prediction || !moments) continue;
    shapes.push_back({prediction->by_place, *moments});
    of_shape.push_back(m);
    focal_px = view.focal_px();
    const Vector3d ray = view.station().place - match.at;
    seen_from += ray.normalized();
    radius = std::max(radius, ray.norm() * std::sqrt(moments->norm()));
  }
  constexpr std::size_t kLeastShapes = 3;
  if (shapes.size() < kLeastShapes) return std::nullopt;
  // Tilted to either side of where it is seen from: few outlines do not tell to which.
  const Vector3d ahead = seen_from.normalized();
  const Vector3d aside = ahead.unitOrthogonal();
  const Vector3d above = ahead.cross(aside);
  std::vector<Vector3d> starts;
  if (const auto disc = DiscOf(shapes)) starts.push_back(disc->radius * disc->normal);
  for (const Vector3d& tilt :
       {Vector3d(Vector3d::Zero()), aside, Vector3d(-aside), above, Vector3d(-above)}) {
    starts.push_back(radius * (ahead + 0.7 * tilt).normalized());
  }
  Found best;
  for (const Vector3d& start : starts) {
    const Found found = LeastMisfit(shapes, start);
    if (found.misfit < best.misfit) best = found;
  }
  ShapeFit fit;
  fit.freedom = 3 * static_cast<int>(shapes.size()) - 3;
  fit.misfit_px = focal_px * std::sqrt(best.misfit / fit.freedom);
  double worst = -1;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Matrix3d normal;
    Vector3d right;
    const double of_one = Misfit({shapes[i]}, best.disc, normal, right);
    if (!(of_one > worst)) continue;
    worst = of_one;
    fit.worst = of_shape[i];
  }
  return fit;
}

void DropByShape(const std::vector<PlainView>& views, PlainMatches& matches) {
  constexpr std::size_t kLeastTargets = 8;  // that tell what outlines differ by
  constexpr double kUnlikely = 1e-6;
  constexpr double kAlike = 2;  // times what most differ by: larger discs, other lights
  constexpr double kMostLeftOut = 0.2;
  std::vector<std::optional<ShapeFit>> fits;
  std::vector<double> misfits_px;
  for (const PlainMatch& match : matches.targets) {
    fits.push_back(FitShape(views, match));
    if (fits.back()) misfits_px.push_back(fits.back()->misfit_px);
  }
  if (misfits_px.size() < kLeastTargets) return;
  const double usual_px = Median(misfits_px);
  const auto is_disc = [&](const std::optional<ShapeFit>& fit) {
    return !fit || fit->misfit_px < kAlike * usual_px ||
           ChiSquareTail(fit->freedom * std::pow(fit->misfit_px / usual_px, 2), fit->freedom) >
               kUnlikely;
  };
  std::vector<PlainMatch> kept;
  for (std::size_t t = 0; t < fits.size(); ++t) {
    PlainMatch& match = matches.targets[t];
    const auto least = static_cast<std::size_t>(
        std::max(3.0, std::ceil((1 - kMostLeftOut) * static_cast<double>(match.members.size()))));
    const std::vector<PlainMember> all = match.members;
    std::vector<PlainMember> left_out;
    auto fit = fits[t];
    while (!is_disc(fit) && match.members.size() > least) {
      const auto worst = match.members.begin() + static_cast<std::ptrdiff_t>(fit->worst);
      left_out.push_back(*worst);
      match.members.erase(worst);
      fit = FitShape(views, match);
    }
    const bool disc = is_disc(fit) && (left_out.empty() || IntersectSights(views, match));
    for (const PlainMember& member : disc ? left_out : all)
      matches.fates[member.view][member.sight] = PlainFate::kNoDisc;
    if (disc) kept.push_back(std::move(match));
  }
  matches.targets = std::move(kept);
}

}  // namespace trammel::part_alignment
