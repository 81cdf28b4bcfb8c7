#include "part_alignment/survey/plain_doubts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>

#include "base/statistics.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBeside_px = 8;
constexpr int kLeastBeside = 3;       // pictures
constexpr double kBesideShare = 0.2;  // of those that show it at its place
constexpr double kChances = 4;        // times what chance lets expect
constexpr double kFacing = 0.34;      // cosine, 70 degrees: beyond it no disc is seen

constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

// The target of each view's sights.
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

// Pictures from the side from which others show it that show a point beside the place and none at
// it; and how many would by chance.
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

// Whether one is seen before some picture only, the other after it only, and not by chance.
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
    if (beside.pictures >= kLeastBeside + kChances * beside.by_chance &&
        beside.pictures >= kBesideShare * static_cast<double>(match.members.size())) {
      fate[t] = PlainFate::kNotStill;
    }
  }
  constexpr double kFar = 0.1;  // of the part: what is put elsewhere stays in the neighbourhood
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

}  // namespace trammel::part_alignment
