#include "part_alignment/survey/plain_matching.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "base/statistics.h"
#include "part_alignment/survey/network.h"
#include "part_alignment/survey/plain_doubts.h"
#include "part_alignment/survey/plain_merged.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kPartners = 16;  // views that a sight is paired in at first
constexpr std::size_t kNear = 24;      // views that a place is looked for in first
constexpr double kMaxFalse = 1e-3;     // expected false targets of a survey
constexpr double kUnlikely = 1e-6;     // probability of rays' residuals

// Returns the criteria for choosing a position.
std::pair<int, std::size_t> Evidence(const PlainMatch& match) {
  return {match.off_plane + match.lonely, match.members.size()};
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
    LeaveToKnown();
    for (const int least : {20, 8, 5, 3}) {
      if (least < options_.min_off_plane) break;
      TakeAtOnce(least);
      if (Done()) break;
    }
    if (options_.min_off_plane < 3) TakeFew();
    AssignAnew();
    LeaveMerged(views_, options_, found_);
    DropByResiduals();
    DropByShape(views_, found_);
    DropDoubtful(views_, found_);
    return std::move(found_);
  }

 private:
  [[nodiscard]] bool Done() const {
    return found_.gave_up || found_.targets.size() >= options_.max_targets;
  }
  [[nodiscard]] bool IsFree(const PlainMember& member) const {
    return found_.fates[member.view][member.sight] == PlainFate::kFree;
  }

  // Orders pairs at angles that intersect well and in which a target looks alike.
  void OrderPartners() {
    const Vector3d middle = 0.5 * (options_.room.low + options_.room.high);
    constexpr double kBest = 0.44;  // rad, 25 degrees
    constexpr double kMin = 0.14;
    constexpr double kMax = 1.4;
    for (const PlainView& view : views_) {
      const Vector3d from = (view.station().place - middle).normalized();
      std::vector<std::pair<double, std::size_t>> partners;
      std::vector<std::pair<double, std::size_t>> near;
      for (std::size_t v = 0; v < views_.size(); ++v) {
        if (&views_[v] == &view) continue;
        const Vector3d other = (views_[v].station().place - middle).normalized();
        const double angle = std::acos(std::clamp(from.dot(other), -1.0, 1.0));
        if (angle > kMin && angle < kMax) partners.emplace_back(std::abs(angle - kBest), v);
        near.emplace_back(angle, v);
      }
      std::sort(partners.begin(), partners.end());
      std::sort(near.begin(), near.end());
      partners_.emplace_back();
      for (const auto& [angle, v] : partners) partners_.back().push_back(v);
      near_.emplace_back();
      for (const auto& [angle, v] : near) near_.back().push_back(v);
    }
  }

  // Assigns sights at the place of a known target to that target.
  void LeaveToKnown() {
    for (const PlainMatch& known : options_.known) {
      for (std::size_t v = 0; v < views_.size(); ++v) {
        for (const std::size_t k : ObservationsAt(views_[v], known, options_.gate)) {
          if (!IsFree({v, k})) continue;
          found_.fates[v][k] = PlainFate::kCoded;
          --free_[v];
        }
      }
    }
  }

  // Returns the only sight of a view at a place; none if there are two. Free sights only, or also
  // those of a target.
  std::optional<std::size_t> ObservationAt(std::size_t v, const PlainMatch& match,
                                           bool free_only) const {
    std::optional<std::size_t> one;
    for (const std::size_t k : ObservationsAt(views_[v], match, options_.gate)) {
      const PlainFate fate = found_.fates[v][k];
      if (fate != PlainFate::kFree && (free_only || fate == PlainFate::kCoded)) continue;
      if (one) return std::nullopt;
      one = k;
    }
    return one;
  }

  // Adds the sights of other views at that place, until nothing changes. False without a third
  // view.
  bool Grow(PlainMatch& match) {
    constexpr int kRounds = 6;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<PlainMember> members;
      for (std::size_t v = 0; v < views_.size(); ++v) {
        if (const auto sight = ObservationAt(v, match, true)) members.push_back({v, *sight});
      }
      if (members.size() < 3) return false;
      const bool same = members == match.members;
      match.members = std::move(members);
      if (!IntersectRays(views_, match)) return false;
      if (same) break;
    }
    CountOffPlane(views_, options_.room, match);
    return true;
  }

  [[nodiscard]] bool AnyThird(std::size_t first, std::size_t second,
                              const PlainMatch& match) const {
    const auto& near = near_[first];
    const std::size_t count = widely_ ? near.size() : std::min(kNear, near.size());
    return std::any_of(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count),
                       [&](std::size_t v) { return v != second && ObservationAt(v, match, true); });
  }

  // Returns the place of a sight that most rays confirm.
  std::optional<PlainMatch> BestOf(std::size_t v, std::size_t k) {
    const PlainView& view = views_[v];
    const PlainObservation& sight = view.sights()[k];
    const Vector3d& from = view.station().place;
    const Vector3d line = view.Line(sight.slope);
    const auto stretch = StretchWithin(options_.room, from, line);
    if (!stretch) return std::nullopt;
    std::optional<PlainMatch> best;
    const std::size_t pairs = widely_ ? partners_[v].size() : kPartners;
    for (std::size_t i = 0; i < std::min(pairs, partners_[v].size()); ++i) {
      if (found_.gave_up) break;
      const std::size_t partner = partners_[v][i];
      const PlainView& other = views_[partner];
      const auto near = other.Predict(from + stretch->first * line);
      const auto far = other.Predict(from + stretch->second * line);
      if (!near || !far) continue;
      const double half = kPlainBand * std::sqrt(view.usual_covariance().trace() +
                                                 other.usual_covariance().trace());
      other.Along(near->slope, far->slope, half, in_band_);
      expected_wrong_ +=
          2 * half * (far->slope - near->slope).norm() * free_[partner] / other.area();
      const std::vector<std::size_t> in_band = in_band_;
      for (const std::size_t candidate : in_band) {
        if (found_.fates[partner][candidate] != PlainFate::kFree) continue;
        if (best && HasMember(*best, {partner, candidate})) continue;  // the same place
        PlainMatch match;
        match.members = {{v, k}, {partner, candidate}};
        if (++places_ > options_.max_places) found_.gave_up = true;
        if (!IntersectRays(views_, match) || match.chi_square > kPlainBand * kPlainBand ||
            !InRoom(options_.room, match.at) || !AnyThird(v, partner, match)) {
          continue;
        }
        if (!Grow(match) || !HasMember(match, {v, k})) continue;
        if (!best || Evidence(match) > Evidence(*best)) best = std::move(match);
      }
    }
    return best;
  }

  // Computes the logarithm of the number of such places that chance makes of the free sights.
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
    const double ways = LogGamma(others + 1) - LogGamma(k + 1) - LogGamma(others - k + 1);
    constexpr double kMinWrong = 0.01;
    return std::log(std::max(expected_wrong_, kMinWrong)) + ways +
           k * std::log(std::max(chance / std::max(views, 1.0), 1e-12));
  }

  // Computes that logarithm for a crowd of free sights about the place: a screw's reflections, say,
  // appear in half of the pictures within few px, but never at one place.
  [[nodiscard]] double LogFalseInCrowd(const PlainMatch& match) const {
    double most = -std::numeric_limits<double>::infinity();
    for (const double half_px : {2.0, 4.0, 8.0}) {
      double near = 0;  // sights beside it
      double views = 0;
      double gate = 0;  // share of the window, of each view that shows something there
      double band = 0;
      for (std::size_t v = 0; v < views_.size(); ++v) {
        const auto prediction = views_[v].Predict(match.at);
        if (!prediction || !views_[v].InPicture(prediction->slope)) continue;
        const double half = half_px / views_[v].focal_px();
        double of_view = 0;
        views_[v].Near(prediction->slope, Vector2d(half, half), [&](std::size_t k) {
          if (found_.fates[v][k] == PlainFate::kFree) ++of_view;
        });
        if (of_view == 0) continue;
        near += of_view;
        ++views;
        const double sigma2 = std::sqrt(views_[v].usual_covariance().determinant());
        gate += std::min(1.0, std::numbers::pi * options_.gate * sigma2 / (4 * half * half));
        band += std::min(1.0, kPlainBand * std::sqrt(sigma2) / half);
      }
      const auto rays = static_cast<double>(match.members.size());
      if (near < rays + 1) continue;  // nothing else
      const double k = match.off_plane + match.lonely;
      const double others = std::max(near - 2, k);
      const double ways = LogGamma(others + 1) - LogGamma(k + 1) - LogGamma(others - k + 1);
      const double pairs = 0.5 * near * (near - 1) * band / views;
      most = std::max(most, std::log(pairs) + ways + k * std::log(gate / views));
    }
    return most;
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

  void TakeAtOnce(int min_off_plane) {
    expected_wrong_ = 0;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      for (std::size_t k = 0; k < views_[v].sights().size() && !Done(); ++k) {
        if (!IsFree({v, k}) || idle_[v][k]) continue;
        auto match = BestOf(v, k);
        if (!match) {
          idle_[v][k] = true;  // fewer sights are free later on
        } else if (match->off_plane >= min_off_plane) {
          Take(std::move(*match));
        }
      }
    }
  }

  // Counts the common sights of two matches: one target may be found from two of its sights.
  static std::size_t Shared(const PlainMatch& a, const PlainMatch& b) {
    return static_cast<std::size_t>(
        std::count_if(a.members.begin(), a.members.end(), [&](const PlainMember& member) {
          return std::find(b.members.begin(), b.members.end(), member) != b.members.end();
        }));
  }

  // Matches targets that few views show, in pairs of all views.
  void TakeFew() {
    widely_ = true;
    for (auto& of_view : idle_) of_view.assign(of_view.size(), false);
    constexpr int kRounds = 4;
    for (int round = 0; round < kRounds && !Done(); ++round) {
      if (!TakeBestFirst()) break;
    }
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
      if (match.off_plane < options_.min_off_plane) {
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
      if (std::max(LogFalse(match), LogFalseInCrowd(match)) > std::log(kMaxFalse)) {
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

  // Reassigns all targets at once: a sight at two places, or one of two at a place, belongs to
  // none.
  void AssignAnew() {
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> claims;
      for (std::size_t t = 0; t < found_.targets.size(); ++t) {
        PlainMatch& match = found_.targets[t];
        Mark(match, PlainFate::kFree);
        for (std::size_t v = 0; v < views_.size(); ++v) {
          if (const auto sight = ObservationAt(v, match, false)) claims[{v, *sight}].push_back(t);
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
        const bool meets = match.members.size() >= 3 && IntersectRays(views_, match);
        if (meets) CountOffPlane(views_, options_.room, match);
        if (meets && match.off_plane >= options_.min_off_plane) return false;
        Mark(match, PlainFate::kFree);
        return true;
      });
    }
  }

  // Drops the worst of rays that miss one another; if they are more than a few, the target.
  void DropByResiduals() {
    constexpr double kMaxLeftOut = 0.2;
    std::erase_if(found_.targets, [&](PlainMatch& match) {
      PlainMatch kept = match;
      const double least =
          std::max(3.0, (1 - kMaxLeftOut) * static_cast<double>(match.members.size()));
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
        if (!IntersectRays(views_, kept)) return true;
      }
      match = std::move(kept);
      return false;
    });
  }

  [[nodiscard]] std::vector<PlainMember>::const_iterator WorstOf(const PlainMatch& match) const {
    const auto square = [&](const PlainMember& member) {
      const PlainObservation& sight = views_[member.view].sights()[member.sight];
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
  bool widely_ = false;  // pairs of all views, not of those that intersect best alone
  std::size_t places_ = 0;
  double expected_wrong_ = 0;  // pairs in bands that are not of one target
};

}  // namespace

PlainMatches MatchPlainObservations(const std::vector<PlainView>& views,
                                    const PlainMatchOptions& options) {
  return Matcher(views, options).Run();
}

}  // namespace trammel::part_alignment
