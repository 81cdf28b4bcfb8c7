#include "part_alignment/survey/plain_matching.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "base/chi_square.h"
#include "part_alignment/survey/network.h"
#include "part_alignment/survey/plain_doubts.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBand = 3;            // sigmas
constexpr std::size_t kPartners = 16;  // views that a sight is paired in
constexpr std::size_t kNear = 24;      // views that a place is looked for in first
constexpr double kMostFalse = 1e-3;    // expected false targets of a survey
constexpr double kUnlikely = 1e-6;     // of the rays' residuals
constexpr double kOffPlane = 0.0436;   // sine of 2.5 degrees: far more than a gate, seen off a row
constexpr std::size_t kPlaneRays = 14;
constexpr int kEnough = 5;  // rays off any plane: no row of targets explains them

// The stretch of a line within a box, as distances from its origin.
std::optional<std::pair<double, double>> Within(const PlainRoom& room, const Vector3d& from,
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

// What a place is chosen by.
std::pair<int, std::size_t> Evidence(const PlainMatch& match) {
  return {match.off_plane + match.lonely, match.members.size()};
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
  const auto stretch = Within(room, first.station().place, line);
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
        kBand * std::sqrt(first.usual_covariance().trace() + view.usual_covariance().trace()),
        in_band);
    if (in_band.size() <= 1) ++lonely;
  }
  match.lonely = std::max(lonely - 1, 0);  // one of them made the pair
}

class Matcher {
 public:
  Matcher(const std::vector<PlainView>& views, const PlainMatchOptions& options)
      : views_(views), options_(options) {
    for (const PlainView& view : views_) {
      found_.fates.emplace_back(view.sights().size(), PlainFate::kFree);
      free_.push_back(static_cast<double>(view.sights().size()));
      idle_.emplace_back(view.sights().size(), false);
    }
    OrderPartners();
  }

  PlainMatches Run() {
    for (const int least : {20, 8, 5, 3}) {
      if (least < options_.least_off_plane) break;
      TakeAtOnce(least);
      if (Done()) break;
    }
    constexpr int kRounds = 4;
    for (int round = 0; round < kRounds && !Done() && options_.least_off_plane < 3; ++round) {
      if (!TakeBestFirst()) break;
    }
    AssignAnew();
    DropByResiduals();
    DropDoubtful(views_, found_);
    return std::move(found_);
  }

 private:
  [[nodiscard]] bool Done() const {
    return found_.gave_up || found_.targets.size() >= options_.most_targets;
  }
  [[nodiscard]] bool IsFree(const PlainMember& member) const {
    return found_.fates[member.view][member.sight] == PlainFate::kFree;
  }

  // Pairs at angles that intersect well and in which a target looks alike.
  void OrderPartners() {
    const Vector3d middle = 0.5 * (options_.room.low + options_.room.high);
    constexpr double kBest = 0.44;  // rad, 25 degrees
    constexpr double kLeast = 0.14;
    constexpr double kMost = 1.4;
    for (const PlainView& view : views_) {
      const Vector3d from = (view.station().place - middle).normalized();
      std::vector<std::pair<double, std::size_t>> partners;
      std::vector<std::pair<double, std::size_t>> near;
      for (std::size_t v = 0; v < views_.size(); ++v) {
        if (&views_[v] == &view) continue;
        const Vector3d other = (views_[v].station().place - middle).normalized();
        const double angle = std::acos(std::clamp(from.dot(other), -1.0, 1.0));
        if (angle > kLeast && angle < kMost) partners.emplace_back(std::abs(angle - kBest), v);
        near.emplace_back(angle, v);
      }
      std::sort(partners.begin(), partners.end());
      std::sort(near.begin(), near.end());
      partners_.emplace_back();
      for (std::size_t i = 0; i < std::min(kPartners, partners.size()); ++i)
        partners_.back().push_back(partners[i].second);
      near_.emplace_back();
      for (std::size_t i = 0; i < std::min(kNear, near.size()); ++i)
        near_.back().push_back(near[i].second);
    }
  }

  // Sights of a view at a place; none if there are two.
  enum class At { kNone, kOne, kTwo };
  At SightAt(std::size_t v, const PlainMatch& match, bool free_only, std::size_t& found) const {
    const PlainView& view = views_[v];
    const auto prediction = view.Predict(match.at);
    if (!prediction || !view.InPicture(prediction->slope)) return At::kNone;
    const Matrix2d of_place =
        prediction->by_place * match.covariance * prediction->by_place.transpose();
    constexpr double kWorse = 4;  // a sight's variance than the usual one's
    const Vector2d half =
        (options_.gate * (of_place + kWorse * view.usual_covariance()).diagonal()).cwiseSqrt();
    int count = 0;
    view.Near(prediction->slope, half, [&](std::size_t k) {
      if (free_only && found_.fates[v][k] != PlainFate::kFree) return;
      const PlainSight& sight = view.sights()[k];
      const Vector2d off = sight.slope - prediction->slope;
      const Matrix2d covariance = of_place + sight.covariance;
      if (off.dot(covariance.inverse() * off) > options_.gate) return;
      ++count;
      found = k;
    });
    return count == 0 ? At::kNone : count == 1 ? At::kOne : At::kTwo;
  }

  // Adds what other views show there, until nothing changes. False if no third one does.
  bool Grow(PlainMatch& match) {
    constexpr int kRounds = 6;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<PlainMember> members;
      for (std::size_t v = 0; v < views_.size(); ++v) {
        std::size_t sight = 0;
        if (SightAt(v, match, true, sight) == At::kOne) members.push_back({v, sight});
      }
      if (members.size() < 3) return false;
      const bool same = members == match.members;
      match.members = std::move(members);
      if (!IntersectSights(views_, match)) return false;
      if (same) break;
    }
    CountOffPlane(views_, options_.room, match);
    return true;
  }

  [[nodiscard]] bool AnyThird(std::size_t first, std::size_t second,
                              const PlainMatch& match) const {
    return std::any_of(near_[first].begin(), near_[first].end(), [&](std::size_t v) {
      std::size_t sight = 0;
      return v != second && SightAt(v, match, true, sight) == At::kOne;
    });
  }

  // The place of a sight that most rays confirm.
  std::optional<PlainMatch> BestOf(std::size_t v, std::size_t k) {
    const PlainView& view = views_[v];
    const PlainSight& sight = view.sights()[k];
    const Vector3d& from = view.station().place;
    const Vector3d line = view.Line(sight.slope);
    const auto stretch = Within(options_.room, from, line);
    if (!stretch) return std::nullopt;
    std::optional<PlainMatch> best;
    for (const std::size_t partner : partners_[v]) {
      if (found_.gave_up) break;
      const PlainView& other = views_[partner];
      const auto near = other.Predict(from + stretch->first * line);
      const auto far = other.Predict(from + stretch->second * line);
      if (!near || !far) continue;
      const double half =
          kBand * std::sqrt(view.usual_covariance().trace() + other.usual_covariance().trace());
      other.Along(near->slope, far->slope, half, in_band_);
      expected_wrong_ +=
          2 * half * (far->slope - near->slope).norm() * free_[partner] / other.area();
      const std::vector<std::size_t> in_band = in_band_;
      for (const std::size_t candidate : in_band) {
        if (found_.fates[partner][candidate] != PlainFate::kFree) continue;
        if (best && HasMember(*best, {partner, candidate})) continue;  // the same place
        PlainMatch match;
        match.members = {{v, k}, {partner, candidate}};
        if (++places_ > options_.most_places) found_.gave_up = true;
        if (!IntersectSights(views_, match) || match.chi_square > kBand * kBand ||
            !InRoom(options_.room, match.at) || !AnyThird(v, partner, match)) {
          continue;
        }
        if (!Grow(match) || !HasMember(match, {v, k})) continue;
        if (!best || Evidence(match) > Evidence(*best)) best = std::move(match);
      }
    }
    return best;
  }

  // The logarithm of how many such places chance is expected to make of the sights that are free.
  [[nodiscard]] double LogFalse(const PlainMatch& match) const {
    double views = 0;
    double chance = 0;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const auto prediction = views_[v].Predict(match.at);
      if (!prediction || !views_[v].InPicture(prediction->slope)) continue;
      if (views_[v].sights().empty()) continue;
      const Matrix2d covariance =
          prediction->by_place * match.covariance * prediction->by_place.transpose() +
          views_[v].usual_covariance();
      chance += free_[v] * std::numbers::pi * options_.gate * std::sqrt(covariance.determinant()) /
                views_[v].area();
      ++views;
    }
    const double others = std::max(views - 2, 1.0);
    const double k = std::min<double>(match.off_plane + match.lonely, others);
    const double ways = std::lgamma(others + 1) - std::lgamma(k + 1) - std::lgamma(others - k + 1);
    constexpr double kLeastWrong = 0.01;
    return std::log(std::max(expected_wrong_, kLeastWrong)) + ways +
           k * std::log(std::max(chance / std::max(views, 1.0), 1e-12));
  }

  void Mark(const PlainMatch& match, PlainFate fate) {
    for (const PlainMember& member : match.members) {
      PlainFate& now = found_.fates[member.view][member.sight];
      if (now == PlainFate::kFree && fate != PlainFate::kFree) --free_[member.view];
      now = fate;
    }
  }

  void Take(PlainMatch match) {
    Mark(match, PlainFate::kUsed);
    found_.targets.push_back(std::move(match));
  }

  void TakeAtOnce(int least_off_plane) {
    expected_wrong_ = 0;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      for (std::size_t k = 0; k < views_[v].sights().size() && !Done(); ++k) {
        if (!IsFree({v, k}) || idle_[v][k]) continue;
        auto match = BestOf(v, k);
        if (!match) {
          idle_[v][k] = true;  // fewer sights are free later on
        } else if (match->off_plane >= least_off_plane) {
          Take(std::move(*match));
        }
      }
    }
  }

  // Whether two are one place, found from two of its sights.
  static std::size_t Shared(const PlainMatch& a, const PlainMatch& b) {
    return static_cast<std::size_t>(
        std::count_if(a.members.begin(), a.members.end(), [&](const PlainMember& member) {
          return std::find(b.members.begin(), b.members.end(), member) != b.members.end();
        }));
  }

  bool TakeBestFirst() {
    expected_wrong_ = 0;
    std::vector<PlainMatch> candidates;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      for (std::size_t k = 0; k < views_[v].sights().size() && !found_.gave_up; ++k) {
        if (!IsFree({v, k}) || idle_[v][k]) continue;
        auto match = BestOf(v, k);
        if (!match) {
          idle_[v][k] = true;
        } else {
          candidates.push_back(std::move(*match));
        }
      }
    }
    std::stable_sort(
        candidates.begin(), candidates.end(),
        [](const PlainMatch& a, const PlainMatch& b) { return Evidence(a) > Evidence(b); });
    std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> of_sight;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      for (const PlainMember& member : candidates[i].members)
        of_sight[{member.view, member.sight}].push_back(i);
    }
    const auto all_free = [&](const PlainMatch& match) {
      return std::all_of(match.members.begin(), match.members.end(),
                         [&](const PlainMember& member) { return IsFree(member); });
    };
    bool taken = false;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const PlainMatch& match = candidates[i];
      if (!all_free(match)) continue;
      if (match.off_plane < options_.least_off_plane) {
        Mark(match, PlainFate::kOnePlane);
        continue;
      }
      std::vector<std::size_t> rivals;
      for (const PlainMember& member : match.members) {
        for (const std::size_t j : of_sight[{member.view, member.sight}]) {
          const PlainMatch& other = candidates[j];
          if (j != i && Evidence(other).first == Evidence(match).first &&
              2 * Shared(match, other) <= match.members.size() && all_free(other)) {
            rivals.push_back(j);
          }
        }
      }
      if (!rivals.empty()) {
        Mark(match, PlainFate::kAmbiguous);
        for (const std::size_t j : rivals) Mark(candidates[j], PlainFate::kAmbiguous);
        continue;
      }
      if (LogFalse(match) > std::log(kMostFalse)) {
        chance_.push_back(match);
        continue;
      }
      Take(match);
      taken = true;
    }
    if (taken) {
      chance_.clear();
      return true;
    }
    for (const PlainMatch& match : chance_) {
      if (all_free(match)) Mark(match, PlainFate::kChance);
    }
    return false;
  }

  // All targets at once: a sight that is at two places, or one of two at a place, is of none.
  void AssignAnew() {
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> claims;
      for (std::size_t t = 0; t < found_.targets.size(); ++t) {
        PlainMatch& match = found_.targets[t];
        Mark(match, PlainFate::kFree);
        for (std::size_t v = 0; v < views_.size(); ++v) {
          std::size_t sight = 0;
          if (SightAt(v, match, false, sight) == At::kOne) claims[{v, sight}].push_back(t);
        }
        match.members.clear();
      }
      for (const auto& [sight, targets] : claims) {
        PlainFate& fate = found_.fates[sight.first][sight.second];
        fate = targets.size() == 1 ? PlainFate::kUsed : PlainFate::kAmbiguous;
        if (targets.size() == 1)
          found_.targets[targets.front()].members.push_back({sight.first, sight.second});
      }
      std::erase_if(found_.targets, [&](PlainMatch& match) {
        const bool meets = match.members.size() >= 3 && IntersectSights(views_, match);
        if (meets) CountOffPlane(views_, options_.room, match);
        if (meets && match.off_plane >= options_.least_off_plane) return false;
        Mark(match, PlainFate::kFree);
        return true;
      });
    }
  }

  // Leaves out the worst of rays that miss one another; where it is more than a few, the target.
  void DropByResiduals() {
    constexpr double kMostLeftOut = 0.2;
    std::erase_if(found_.targets, [&](PlainMatch& match) {
      PlainMatch kept = match;
      const double least =
          std::max(3.0, (1 - kMostLeftOut) * static_cast<double>(match.members.size()));
      const auto misses = [&] {
        const int freedom = 2 * static_cast<int>(kept.members.size()) - 3;
        return ChiSquareTail(kept.chi_square, freedom) < kUnlikely;
      };
      while (misses()) {
        if (static_cast<double>(kept.members.size() - 1) < least) {
          Mark(match, PlainFate::kResidual);
          return true;
        }
        kept.members.erase(WorstOf(kept));
        if (!IntersectSights(views_, kept)) return true;
      }
      match = std::move(kept);
      return false;
    });
  }

  [[nodiscard]] std::vector<PlainMember>::const_iterator WorstOf(const PlainMatch& match) const {
    const auto square = [&](const PlainMember& member) {
      const PlainSight& sight = views_[member.view].sights()[member.sight];
      const auto prediction = views_[member.view].Predict(match.at);
      if (!prediction) return std::numeric_limits<double>::infinity();
      const Vector2d off = sight.slope - prediction->slope;
      return off.dot(sight.covariance.inverse() * off);
    };
    return std::max_element(
        match.members.begin(), match.members.end(),
        [&](const PlainMember& a, const PlainMember& b) { return square(a) < square(b); });
  }

  const std::vector<PlainView>& views_;
  const PlainMatchOptions& options_;
  PlainMatches found_;
  std::vector<double> free_;  // sights of each view
  std::vector<std::vector<bool>> idle_;
  std::vector<std::vector<std::size_t>> partners_;
  std::vector<std::vector<std::size_t>> near_;
  std::vector<std::size_t> in_band_;
  std::vector<PlainMatch> chance_;
  std::size_t places_ = 0;
  double expected_wrong_ = 0;  // pairs in bands that are not of one target
};

}  // namespace

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

PlainMatches MatchPlainSights(const std::vector<PlainView>& views,
                              const PlainMatchOptions& options) {
  return Matcher(views, options).Run();
}

}  // namespace trammel::part_alignment
