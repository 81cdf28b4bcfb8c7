#include "part_alignment/survey/plain_merged.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kReach_px = 8;  // from the middle to either disc
constexpr double kMinMiddle_px = 1;
constexpr double kAside_px = 1.5;  // offset change by the unknown slope of the surface
constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

// True if a sight is midway between two positions of its view, as far as two discs differ.
bool IsAmid(const PlainView& view, const Vector2d& slope, const Vector2d& one,
            const Vector2d& other) {
  constexpr double kMiddle = 0.25;  // of the distance between both
  const double near = std::max(kMiddle * (one - other).norm(), kMinMiddle_px / view.focal_px());
  return (0.5 * (one + other) - slope).norm() < near;
}

class Merged {
 public:
  Merged(const std::vector<PlainView>& views, const PlainMatchOptions& options,
         PlainMatches& matches)
      : views_(views), options_(options), matches_(matches) {
    for (const auto& fates : matches_.fates) {
      owners_.emplace_back(fates.size(), kNobody);
      merged_.emplace_back(fates.size(), false);
    }
    sights_.resize(matches_.targets.size(), std::vector<std::size_t>(views_.size(), kNobody));
    for (std::size_t t = 0; t < matches_.targets.size(); ++t) {
      for (const PlainMember& member : matches_.targets[t].members) {
        owners_[member.view][member.sight] = t;
        sights_[t][member.view] = member.sight;
      }
    }
  }

  void Leave() {
    for (std::size_t a = 0; a < matches_.targets.size(); ++a) {
      for (std::size_t b = a + 1; b < matches_.targets.size(); ++b) {
        if (AreNear(a, b, 2 * kReach_px)) MarkBetween(a, b);
      }
    }
    std::vector<bool> none(matches_.targets.size());
    for (std::size_t t = 0; t < matches_.targets.size(); ++t) none[t] = IsMerged(t);
    for (std::size_t t = 0; t < matches_.targets.size(); ++t) {
      if (!none[t]) none[t] = IsAmidTwo(t, none) || IsSeenAsTwo(t, none);
    }
    Take(none);
  }

 private:
  [[nodiscard]] const PlainMatch& Target(std::size_t t) const { return matches_.targets[t]; }

  // True if views may show two targets within the given reach.
  [[nodiscard]] bool AreNear(std::size_t a, std::size_t b, double reach_px) const {
    const PlainView& view = views_[Target(a).members.front().view];
    const double range = (view.station().place - Target(a).at).norm();
    constexpr double kNearer = 1.5;  // another view's range
    return (Target(a).at - Target(b).at).norm() < kNearer * reach_px / view.focal_px() * range;
  }

  // Returns the least distance of two targets in a view that resolves them, px; absent without one.
  [[nodiscard]] std::optional<double> LeastApart(std::size_t a, std::size_t b) const {
    std::optional<double> least;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (sights_[a][v] == kNobody || sights_[b][v] == kNobody) continue;
      const auto& sights = views_[v].sights();
      const double apart =
          (sights[sights_[a][v]].slope - sights[sights_[b][v]].slope).norm() * views_[v].focal_px();
      if (!least || apart < *least) least = apart;
    }
    return least;
  }

  // Marks discs that views merge of two.
  void MarkBetween(std::size_t a, std::size_t b) {
    const auto apart_px = LeastApart(a, b);
    if (!apart_px) return;
    constexpr double kAlike = 1.3;  // two discs merge by their sizes in the view, not alike in all
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (sights_[a][v] != kNobody || sights_[b][v] != kNobody) continue;
      const PlainView& view = views_[v];
      const auto one = view.Predict(Target(a).at);
      const auto other = view.Predict(Target(b).at);
      if (!one || !other) continue;
      const Vector2d middle = 0.5 * (one->slope + other->slope);
      const double between_px = (one->slope - other->slope).norm() * view.focal_px();
      if (!view.InPicture(middle) || between_px > std::min(kAlike * *apart_px, 2 * kReach_px))
        continue;
      const double half = 0.5 * kReach_px / view.focal_px();
      view.Near(middle, Vector2d(half, half), [&](std::size_t k) {
        const std::size_t owner = owners_[v][k];
        if (owner != kNobody && IsSeenWith(owner, a, b)) return;
        if (!IsAmid(view, view.sights()[k].slope, one->slope, other->slope)) return;
        merged_[v][k] = true;
        matches_.targets[a].merges = matches_.targets[b].merges = true;
      });
    }
  }

  [[nodiscard]] bool IsSeenWith(std::size_t t, std::size_t a, std::size_t b) const {
    return SeenTogether(Target(t), Target(a)) + SeenTogether(Target(t), Target(b)) > 0;
  }

  [[nodiscard]] bool IsMerged(std::size_t t) const {
    const auto& members = Target(t).members;
    const auto merged = std::count_if(
        members.begin(), members.end(),
        [&](const PlainMember& member) { return merged_[member.view][member.sight]; });
    return 2 * static_cast<std::size_t>(merged) > members.size();
  }

  // True if a sight belongs to nothing that is ever seen together with a target.
  [[nodiscard]] bool IsStrange(std::size_t v, std::size_t k, std::size_t t,
                               const std::vector<bool>& none) const {
    if (merged_[v][k] || matches_.fates[v][k] == PlainFate::kCoded) return false;
    const std::size_t owner = owners_[v][k];
    return owner == kNobody || (!none[owner] && SeenTogether(Target(t), Target(owner)) == 0);
  }

  // True if most views merge two discs into this target, and the others show one alone. These show,
  // beside it, one position on one side, which is a target, or as far on the other.
  bool IsAmidTwo(std::size_t t, const std::vector<bool>& none) {
    for (std::size_t a = 0; a < matches_.targets.size(); ++a) {
      if (a == t || none[a] || !AreNear(a, t, kReach_px) ||
          SeenTogether(Target(a), Target(t)) > 0 ||
          Target(a).members.size() > Target(t).members.size()) {
        continue;
      }
      const std::vector<PlainMember> others = ToEitherSide(t, a, none);
      if (others.empty()) continue;
      matches_.targets[a].merges = true;
      for (const PlainMember& other : others) {
        const std::size_t owner = owners_[other.view][other.sight];
        if (owner != kNobody) matches_.targets[owner].merges = true;
      }
      return true;
    }
    return false;
  }

  // Returns the sights on the target's side opposite to a neighbour, as far away, from views that
  // show neither; none where much else is near.
  [[nodiscard]] std::vector<PlainMember> ToEitherSide(std::size_t t, std::size_t a,
                                                      const std::vector<bool>& none) const {
    constexpr double kMinShare = 0.8;  // explained share of nearby sights
    PlainMatch mirrored;
    mirrored.at = 2 * Target(t).at - Target(a).at;
    mirrored.covariance = 4 * Target(t).covariance + Target(a).covariance;
    std::vector<PlainMember> others;
    std::size_t beside = 0;
    std::size_t of_neighbour = 0;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (sights_[t][v] != kNobody) continue;
      const PlainView& view = views_[v];
      const auto prediction = view.Predict(Target(t).at);
      if (!prediction || !view.InPicture(prediction->slope)) continue;
      const double half = kReach_px / view.focal_px();
      const std::vector<std::size_t> at_mirrored = ObservationsAt(view, mirrored, options_.gate);
      view.Near(prediction->slope, Vector2d(half, half), [&](std::size_t k) {
        if (!IsStrange(v, k, t, none)) return;
        ++beside;
        if (owners_[v][k] == a) {
          ++of_neighbour;
        } else if (std::find(at_mirrored.begin(), at_mirrored.end(), k) != at_mirrored.end()) {
          others.push_back({v, k});
        }
      });
    }
    const auto explained = static_cast<double>(of_neighbour + others.size());
    if (explained < kMinShare * static_cast<double>(beside)) others.clear();
    return others;
  }

  // True if views without the target show sights beside it at one offset along the surface or its
  // opposite, and both occur. These are two discs, each seen too seldom to be a target.
  bool IsSeenAsTwo(std::size_t t, const std::vector<bool>& none) {
    constexpr std::size_t kMinObservations = 2;
    constexpr std::size_t kMax = 60;  // two discs cause only few
    constexpr double kMinShare = 0.8;
    const std::vector<Aside> beside = BesideOf(t, none);
    if (beside.size() < kMinObservations || beside.size() > kMax) return false;
    for (const Aside& by : beside) {
      const auto offset = AlongSurface(t, by);
      if (!offset) continue;
      std::vector<const Aside*> here;
      std::size_t opposite = 0;
      for (const Aside& other : beside) {
        const PlainView& view = views_[other.sight.view];
        const Vector2d there = view.Predict(Target(t).at)->by_place * *offset;
        const double near = kAside_px / view.focal_px();
        const bool as_far = (other.off + there).norm() < near;
        if (as_far) ++opposite;
        if (as_far || (other.off - there).norm() < near) here.push_back(&other);
      }
      if (opposite == 0 || here.size() <= opposite ||
          static_cast<double>(here.size()) < kMinShare * static_cast<double>(beside.size())) {
        continue;
      }
      for (const Aside* other : here) {
        const std::size_t owner = owners_[other->sight.view][other->sight.sight];
        if (owner != kNobody) matches_.targets[owner].merges = true;
      }
      return true;
    }
    return false;
  }

  // Sight beside a target in a view that does not show it.
  struct Aside {
    PlainMember sight;
    Vector2d off = Vector2d::Zero();
  };

  [[nodiscard]] std::vector<Aside> BesideOf(std::size_t t, const std::vector<bool>& none) const {
    std::vector<Aside> beside;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (sights_[t][v] != kNobody) continue;
      const PlainView& view = views_[v];
      const auto prediction = view.Predict(Target(t).at);
      if (!prediction || !view.InPicture(prediction->slope)) continue;
      const double half = kReach_px / view.focal_px();
      view.Near(prediction->slope, Vector2d(half, half), [&](std::size_t k) {
        const Vector2d off = view.sights()[k].slope - prediction->slope;
        if (off.norm() * view.focal_px() > kAside_px && IsStrange(v, k, t, none))
          beside.push_back({{v, k}, off});
      });
    }
    return beside;
  }

  // Computes the offset in space of a sight beside a target, if it is on a surface that faces the
  // views of the target.
  [[nodiscard]] std::optional<Vector3d> AlongSurface(std::size_t t, const Aside& beside) const {
    Vector3d facing = Vector3d::Zero();
    for (const PlainMember& member : Target(t).members)
      facing += (views_[member.view].station().place - Target(t).at).normalized();
    const auto by_place = views_[beside.sight.view].Predict(Target(t).at)->by_place;
    Eigen::Matrix3d rows;
    rows << by_place / by_place.norm(), facing.normalized().transpose();
    constexpr double kGrazing = 0.05;
    if (std::abs(rows.determinant()) < kGrazing) return std::nullopt;
    const Vector3d right(beside.off.x() / by_place.norm(), beside.off.y() / by_place.norm(), 0);
    return Vector3d(rows.inverse() * right);
  }

  // Removes false targets, and false rays of the others.
  void Take(const std::vector<bool>& none) {
    std::vector<PlainMatch> kept;
    for (std::size_t t = 0; t < matches_.targets.size(); ++t) {
      PlainMatch& match = matches_.targets[t];
      if (none[t]) {
        for (const PlainMember& member : match.members) merged_[member.view][member.sight] = true;
        continue;
      }
      const std::size_t before = match.members.size();
      const std::vector<PlainMember> members = match.members;
      std::erase_if(match.members,
                    [&](const PlainMember& member) { return merged_[member.view][member.sight]; });
      if (match.members.size() < before) {
        const bool meets = match.members.size() >= 3 && IntersectRays(views_, match);
        if (meets) CountOffPlane(views_, options_.room, match);
        if (!meets || match.off_plane < options_.min_off_plane) {
          for (const PlainMember& member : members)
            matches_.fates[member.view][member.sight] = PlainFate::kFree;
          continue;
        }
      }
      kept.push_back(std::move(match));
    }
    matches_.targets = std::move(kept);
    for (std::size_t v = 0; v < views_.size(); ++v) {
      for (std::size_t k = 0; k < merged_[v].size(); ++k) {
        if (merged_[v][k]) matches_.fates[v][k] = PlainFate::kMerged;
      }
    }
  }

  const std::vector<PlainView>& views_;
  const PlainMatchOptions& options_;
  PlainMatches& matches_;
  std::vector<std::vector<std::size_t>> owners_;  // target of each view's sights
  std::vector<std::vector<std::size_t>> sights_;  // per target and view
  std::vector<std::vector<bool>> merged_;         // each view's sights
};

}  // namespace

void LeaveMerged(const std::vector<PlainView>& views, const PlainMatchOptions& options,
                 PlainMatches& matches) {
  Merged(views, options, matches).Leave();
}

}  // namespace trammel::part_alignment
