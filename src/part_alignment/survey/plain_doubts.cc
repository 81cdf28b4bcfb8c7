#include "part_alignment/survey/plain_doubts.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <set>

#include "base/statistics.h"
#include "part_alignment/survey/survey_discs.h"

namespace trammel::part_alignment {
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kBeside_px = 8;
constexpr int kMinBeside = 3;         // pictures
constexpr double kBesideShare = 0.2;  // of the views that show it at its place
constexpr double kChances = 4;        // times what chance lets expect
constexpr double kFacing = 0.34;      // cosine, 70 degrees: beyond it no disc is seen

constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

// Returns the target of each view's sights.
std::vector<std::vector<std::size_t>> OwnersOf(const PlainMatches& matches) {
  std::vector<std::vector<std::size_t>> owners;
  for (const auto& fates : matches.fates) owners.emplace_back(fates.size(), kNobody);
  for (std::size_t t = 0; t < matches.targets.size(); ++t) {
    for (const PlainMember& member : matches.targets[t].members)
      owners[member.view][member.sight] = t;
  }
  return owners;
}

constexpr int kNeighbours = 2;  // seen together so often, two targets are two

Vector3d SeenFrom(const std::vector<PlainView>& views, const PlainMatch& match) {
  Vector3d sum = Vector3d::Zero();
  for (const PlainMember& member : match.members)
    sum += (views[member.view].station().place - match.at).normalized();
  return sum.normalized();
}

// Number of pictures, from the side of the others, that show a point beside the place and none at
// it; and the number expected by chance.
struct Beside {
  int pictures = 0;
  double by_chance = 0;
};

Beside BesideOf(const std::vector<PlainView>& views, const PlainMatches& matches,
                const std::vector<std::vector<std::size_t>>& owners,
                const std::vector<double>& free, std::size_t t) {
  const PlainMatch& match = matches.targets[t];
  std::set<std::size_t> at_place;
  for (const PlainMember& member : match.members) at_place.insert(member.view);
  const Vector3d seen_from = SeenFrom(views, match);
  Beside beside;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (at_place.contains(v)) continue;
    const auto prediction = views[v].Predict(match.at);
    if (!prediction || !views[v].InPicture(prediction->slope)) continue;
    const Vector3d ray = views[v].station().place - match.at;
    if (seen_from.dot(ray.normalized()) < kFacing) continue;
    const double half = kBeside_px / views[v].focal_px();
    const double near = 2 * half * ray.norm();
    bool found = false;
    views[v].Near(prediction->slope, Vector2d(half, half), [&](std::size_t k) {
      const PlainFate fate = matches.fates[v][k];
      if (fate == PlainFate::kMerged || fate == PlainFate::kCoded) return;
      const std::size_t owner = owners[v][k];
      if (owner != kNobody) {
        const PlainMatch& other = matches.targets[owner];
        if ((other.at - match.at).norm() > near || SeenTogether(match, other) >= kNeighbours ||
            (match.merges && other.merges)) {
          return;
        }
      }
      found = true;
    });
    if (found) ++beside.pictures;
    beside.by_chance += 4 * half * half * free[v] / views[v].area();
  }
  return beside;
}

// True if one is seen only before some picture, the other only after it, and not by chance.
bool InTurn(const PlainMatch& a, const PlainMatch& b) {
  constexpr double kLogUnlikely = -3;  // 5 %, of neighbours, which one picture shows both of
  if (!(a.members.back().view < b.members.front().view ||
        b.members.back().view < a.members.front().view)) {
    return false;
  }
  const auto n = static_cast<double>(a.members.size());
  const auto m = static_cast<double>(b.members.size());
  const double orders = LogGamma(n + m + 1) - LogGamma(n + 1) - LogGamma(m + 1);
  return std::log(2.0) - orders < kLogUnlikely;
}

}  // namespace

void DropDoubtful(const std::vector<PlainView>& views, PlainMatches& matches) {
  const auto owners = OwnersOf(matches);
  std::vector<double> free;  // sights of no target
  for (const auto& of_view : owners) {
    free.push_back(static_cast<double>(std::count(of_view.begin(), of_view.end(), kNobody)));
  }
  const std::size_t count = matches.targets.size();
  std::vector<PlainFate> fate(count, PlainFate::kUsed);
  std::vector<Vector3d> seen_from;
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d high = -low;
  for (std::size_t t = 0; t < count; ++t) {
    const PlainMatch& match = matches.targets[t];
    seen_from.push_back(SeenFrom(views, match));
    low = low.cwiseMin(match.at);
    high = high.cwiseMax(match.at);
    const Beside beside = BesideOf(views, matches, owners, free, t);
    if (beside.pictures >= kMinBeside + kChances * beside.by_chance &&
        beside.pictures >= kBesideShare * static_cast<double>(match.members.size())) {
      fate[t] = PlainFate::kNotStill;
    }
  }
  constexpr double kFar = 0.1;       // of the part: moved targets are sought only nearby
  constexpr double kSameSide = 0.8;  // cosine
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) {
      const PlainMatch& first = matches.targets[a];
      const PlainMatch& second = matches.targets[b];
      if (!(first.merges && second.merges) &&
          (first.at - second.at).norm() < kFar * (high - low).norm() &&
          seen_from[a].dot(seen_from[b]) > kSameSide && InTurn(first, second)) {
        fate[a] = fate[b] = PlainFate::kMoved;
      }
    }
  }
  std::vector<PlainMatch> kept;
  for (std::size_t t = 0; t < count; ++t) {
    for (const PlainMember& member : matches.targets[t].members)
      matches.fates[member.view][member.sight] = fate[t];
    if (fate[t] == PlainFate::kUsed) kept.push_back(std::move(matches.targets[t]));
  }
  matches.targets = std::move(kept);
}

namespace {

// Computes the misfit of the outlines to one disc, given its normal times its radius: the sum of
// squares, of an axis.
double Misfit(const std::vector<DiscShape>& shapes, const Vector3d& disc, Matrix3d& normal,
              Vector3d& right) {
  const Matrix3d of_disc = disc.squaredNorm() * Matrix3d::Identity() - disc * disc.transpose();
  double squares = 0;
  normal.setZero();
  right.setZero();
  for (const DiscShape& shape : shapes) {
    const auto& by_place = shape.by_place;
    const double weight = 1 / (4 * shape.moments.norm());  // d(a²)/da = 2 a
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

// Finds the smallest misfit from one start: Levenberg-Marquardt.
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
  constexpr std::size_t kMinShapes = 3;
  if (shapes.size() < kMinShapes) return std::nullopt;
  // Tilted to either side of the viewing direction: few outlines do not determine which.
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
  constexpr std::size_t kMinTargets = 8;  // for a common difference of outlines
  constexpr double kUnlikely = 1e-6;
  constexpr double kAlike = 2;  // times what most differ by: larger discs, other lights
  constexpr double kMaxLeftOut = 0.2;
  std::vector<std::optional<ShapeFit>> fits;
  std::vector<double> misfits_px;
  for (const PlainMatch& match : matches.targets) {
    fits.push_back(FitShape(views, match));
    if (fits.back()) misfits_px.push_back(fits.back()->misfit_px);
  }
  if (misfits_px.size() < kMinTargets) return;
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
        std::max(3.0, std::ceil((1 - kMaxLeftOut) * static_cast<double>(match.members.size()))));
    const std::vector<PlainMember> all = match.members;
    std::vector<PlainMember> left_out;
    auto fit = fits[t];
    while (!is_disc(fit) && match.members.size() > least) {
      const auto worst = match.members.begin() + static_cast<std::ptrdiff_t>(fit->worst);
      left_out.push_back(*worst);
      match.members.erase(worst);
      fit = FitShape(views, match);
    }
    const bool disc = is_disc(fit) && (left_out.empty() || IntersectRays(views, match));
    for (const PlainMember& member : disc ? left_out : all)
      matches.fates[member.view][member.sight] = PlainFate::kNoDisc;
    if (disc) kept.push_back(std::move(match));
  }
  matches.targets = std::move(kept);
}

}  // namespace trammel::part_alignment
