#include "part_alignment/survey/network_start.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "part_alignment/survey/orientation.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWide = 0.02;       // of the longer side: tolerance before the lens is known
constexpr double kNarrow = 0.00075;  // and after: 3 px of 4000
constexpr std::size_t kPairs = 4;    // pairs tried
constexpr std::size_t kSeedStations = 8;
constexpr std::size_t kLensStations = 8;  // minimum for solving the whole lens
constexpr double kMinAngle = 0.1;         // rad, between two lines that place a point

using Observations = std::vector<std::vector<std::size_t>>;

struct Pair {
  std::size_t first = 0;
  std::size_t second = 0;
  std::vector<std::pair<std::size_t, std::size_t>> shared;  ///< observations
  double score = 0;
};

std::vector<std::pair<std::size_t, std::size_t>> Shared(const Network& network,
                                                        const std::vector<std::size_t>& first,
                                                        const std::vector<std::size_t>& second) {
  std::vector<std::size_t> of_point(network.points.size(), network.observations.size());
  for (const std::size_t i : first) of_point[network.observations[i].point] = i;
  std::vector<std::pair<std::size_t, std::size_t>> shared;
  for (const std::size_t i : second) {
    const std::size_t other = of_point[network.observations[i].point];
    if (other < network.observations.size()) shared.emplace_back(other, i);
  }
  return shared;
}

// Returns the misfit of the best affine map between two pictures: parallax and perspective, px rms.
double AffineMisfit(const Network& network,
                    const std::vector<std::pair<std::size_t, std::size_t>>& shared) {
  const auto count = static_cast<Index>(shared.size());
  Eigen::MatrixXd from(count, 3);
  Eigen::MatrixXd to(count, 2);
  for (Index i = 0; i < count; ++i) {
    const auto& [a, b] = shared[static_cast<std::size_t>(i)];
    from.row(i) << network.observations[a].pixel.transpose(), 1;
    to.row(i) = network.observations[b].pixel.transpose();
  }
  const Eigen::MatrixXd map = geometry::SolveLeastSquares(from, to);
  return std::sqrt((to - from * map).squaredNorm() / static_cast<double>(count));
}

std::vector<Pair> BestPairs(const Network& network, const Observations& observations, int side_px) {
  constexpr std::size_t kMinShared = 6;
  constexpr double kEnoughMisfit = 0.01;  // relative to the side
  constexpr double kEnoughShared = 20;
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    for (std::size_t j = i + 1; j < observations.size(); ++j) {
      Pair pair{i, j, Shared(network, observations[i], observations[j]), 0};
      if (pair.shared.size() < kMinShared) continue;
      const double count = std::min(static_cast<double>(pair.shared.size()), kEnoughShared);
      pair.score =
          count * std::min(AffineMisfit(network, pair.shared) / (kEnoughMisfit * side_px), 1.0);
      pairs.push_back(std::move(pair));
    }
  }
  const std::size_t kept = std::min(kPairs, pairs.size());
  std::partial_sort(pairs.begin(), pairs.begin() + static_cast<std::ptrdiff_t>(kept), pairs.end(),
                    [](const Pair& a, const Pair& b) { return a.score > b.score; });
  pairs.resize(kept);
  return pairs;
}

double ErrorOf(const Network& network, const NetworkObservation& observation) {
  const auto misclosure = Misclosure(network, observation);
  return misclosure ? misclosure->norm() : std::numeric_limits<double>::infinity();
}

// Uses the observations within the tolerance, and no others.
void Gate(double tolerance_px, Network& network) {
  for (NetworkObservation& observation : network.observations) {
    if (network.stations[observation.station].placed && network.points[observation.point].placed)
      observation.used = ErrorOf(network, observation) < tolerance_px;
  }
}

std::vector<double> Errors(const Network& network) {
  std::vector<double> errors;
  for (const NetworkObservation& observation : network.observations) {
    if (TakesPart(network, observation)) errors.push_back(ErrorOf(network, observation));
  }
  return errors;
}

// Computes the point that agrees with most of its observations; absent with fewer than two.
std::optional<Vector3d> IntersectObservations(const Network& network,
                                              const std::vector<std::size_t>& observations,
                                              double tolerance_px) {
  constexpr std::size_t kMaxLines = 12;
  std::vector<std::size_t> seen;
  std::vector<Vector3d> places;
  std::vector<Vector3d> lines;
  for (const std::size_t i : observations) {
    const Station& station = network.stations[network.observations[i].station];
    const auto line = ObservationLine(network.lens, network.observations[i].pixel);
    if (!station.placed || !line) continue;
    seen.push_back(i);
    places.push_back(station.place);
    lines.push_back(station.rotation.transpose() * *line);
  }
  const auto agreeing = [&](const Vector3d& at) {
    std::vector<std::size_t> agree;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const NetworkObservation& observation = network.observations[seen[k]];
      const auto projection =
          ProjectLens(network.lens, network.stations[observation.station].FromObject(at));
      if (projection && (projection->pixel - observation.pixel).norm() < tolerance_px)
        agree.push_back(k);
    }
    return agree;
  };
  std::vector<std::size_t> best;
  const std::size_t stride = 1 + lines.size() / kMaxLines;
  for (std::size_t a = 0; a < lines.size(); a += stride) {
    for (std::size_t b = a + stride; b < lines.size(); b += stride) {
      if (lines[a].cross(lines[b]).norm() < std::sin(kMinAngle)) continue;
      const auto at = Intersect({places[a], places[b]}, {lines[a], lines[b]});
      if (!at) continue;
      auto agree = agreeing(*at);
      if (agree.size() > best.size()) best = std::move(agree);
    }
  }
  if (best.size() < 2) return std::nullopt;
  std::vector<Vector3d> best_places;
  std::vector<Vector3d> best_lines;
  for (const std::size_t k : best) {
    best_places.push_back(places[k]);
    best_lines.push_back(lines[k]);
  }
  const auto at = Intersect(best_places, best_lines);
  return at && agreeing(*at).size() >= 2 ? at : std::nullopt;
}

// @param barred  of the points; those stay as they are. Empty: none is.
void PlacePoints(double tolerance_px, Network& network, const std::vector<bool>& barred = {}) {
  std::vector<std::vector<std::size_t>> of_point(network.points.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    of_point[network.observations[i].point].push_back(i);
  }
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (network.points[p].placed || (!barred.empty() && barred[p])) continue;
    if (const auto at = IntersectObservations(network, of_point[p], tolerance_px)) {
      network.points[p] = {*at, true};
    }
  }
}

std::size_t KnownObservations(const Network& network,
                              const std::vector<std::size_t>& observations) {
  return static_cast<std::size_t>(std::count_if(
      observations.begin(), observations.end(),
      [&](std::size_t i) { return network.points[network.observations[i].point].placed; }));
}

// Returns stations not yet placed that see at least `least` placed points, most first.
std::vector<std::size_t> NextStations(const Network& network, const Observations& observations,
                                      std::size_t least) {
  std::vector<std::size_t> next;
  for (std::size_t s = 0; s < observations.size(); ++s) {
    if (!network.stations[s].placed && KnownObservations(network, observations[s]) >= least)
      next.push_back(s);
  }
  std::stable_sort(next.begin(), next.end(), [&](std::size_t a, std::size_t b) {
    return KnownObservations(network, observations[a]) >
           KnownObservations(network, observations[b]);
  });
  return next;
}

bool PlaceStation(std::size_t station, const Observations& observations, double tolerance_px,
                  Network& network, Random& random) {
  constexpr double kMinShare = 0.6;
  for (const std::size_t i : observations[station]) network.observations[i].used = true;
  const auto resection = Resect(network, observations[station], tolerance_px, random);
  if (!resection || static_cast<double>(resection->agreeing) <
                        kMinShare * static_cast<double>(resection->observations)) {
    return false;
  }
  network.stations[station] = resection->station;
  return true;
}

void Adjust(const FreeLens& free, double loss_px, Network& network) {
  if (Errors(network).empty()) return;
  std::vector<double> sigmas;
  for (const NetworkObservation& observation : network.observations)
    sigmas.push_back(observation.sigma_px);
  BundleOptions options;
  options.free = free;
  options.loss_sigma = loss_px / Median(sigmas);
  options.bars = false;
  options.max_iterations = 25;
  (void)AdjustBundle(options, network);  // a start: what it is worth, its residuals tell
}

struct Seed {
  Network network;
  std::size_t used = 0;
  double median_px = 0;
};

std::size_t Placed(const Network& network) {
  return static_cast<std::size_t>(std::count_if(network.stations.begin(), network.stations.end(),
                                                [](const Station& s) { return s.placed; }));
}

// Tests an oriented pair by further pictures.
std::optional<Seed> TrySeed(const NetworkStartOptions& options, const Observations& observations,
                            const Pair& pair, const RelativeOrientation& orientation,
                            Network network, Random& random) {
  const double wide_px = kWide * options.longer_side_px;
  network.stations[pair.first] = {Eigen::Matrix3d::Identity(), Vector3d::Zero(), true};
  network.stations[pair.second] = {orientation.rotation, orientation.place, true};
  PlacePoints(wide_px, network);
  for (const std::size_t station : NextStations(network, observations, 6)) {
    if (Placed(network) >= kSeedStations) break;
    if (PlaceStation(station, observations, wide_px, network, random)) {
      PlacePoints(wide_px, network);
    }
  }
  constexpr double kLossShare = 0.2;
  for (const double tolerance_px : {wide_px, 0.5 * wide_px}) {
    Gate(tolerance_px, network);
    if (Errors(network).size() < 2 * observations.size() && Errors(network).size() < 12)
      return std::nullopt;
    Adjust(kFocalAndRadialFree, kLossShare * tolerance_px, network);
  }
  Gate(wide_px, network);
  const std::vector<double> errors = Errors(network);
  if (errors.empty()) return std::nullopt;
  return Seed{std::move(network), errors.size(), Median(errors)};
}

// Scores a seed: number of explained observations, weighted by their fit.
double WorthOf(const Seed& seed, double side_px) {
  constexpr double kFine = 5e-4;  // relative to the side: 2 px of 4000
  return static_cast<double>(seed.used) / (1 + seed.median_px / (kFine * side_px));
}

std::optional<Seed> BestSeed(const NetworkStartOptions& options, const Observations& observations,
                             const Network& network, Random& random) {
  constexpr double kGoodEnough = 1e-4;  // relative to the side
  const double side_px = options.longer_side_px;
  std::optional<Seed> best;
  for (const Pair& pair : BestPairs(network, observations, options.longer_side_px)) {
    for (const double focal : options.focal_guesses_px) {
      Network start = network;
      start.lens[kFocal] = focal;
      std::vector<Vector3d> first;
      std::vector<Vector3d> second;
      for (const auto& [a, b] : pair.shared) {
        const auto line1 = ObservationLine(start.lens, start.observations[a].pixel);
        const auto line2 = ObservationLine(start.lens, start.observations[b].pixel);
        if (!line1 || !line2) continue;
        first.push_back(*line1);
        second.push_back(*line2);
      }
      for (const RelativeOrientation& orientation : OrientPair(first, second, 2, random)) {
        auto seed = TrySeed(options, observations, pair, orientation, start, random);
        if (seed && (!best || WorthOf(*seed, side_px) > WorthOf(*best, side_px)))
          best = std::move(seed);
      }
    }
    if (best && best->median_px < kGoodEnough * side_px && Placed(best->network) >= 4) break;
  }
  return best;
}

}  // namespace

Observations ObservationsByStation(const Network& network) {
  Observations observations(network.stations.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    observations[network.observations[i].station].push_back(i);
  }
  return observations;
}

void GrowNetwork(const NetworkStartOptions& options, Network& network, Random& random) {
  const Observations observations = ObservationsByStation(network);
  const double side_px = options.longer_side_px;
  double tolerance_px = kWide * side_px;
  constexpr double kSpread = 10;  // medians within which an observation is taken
  while (true) {
    const std::size_t before = Placed(network);
    std::vector<std::size_t> next = NextStations(network, observations, 6);
    if (next.empty()) next = NextStations(network, observations, 4);
    const std::size_t most = std::max<std::size_t>(4, before / 2);
    for (const std::size_t station : next) {
      if (Placed(network) >= before + most) break;
      (void)PlaceStation(station, observations, tolerance_px, network, random);
    }
    PlacePoints(tolerance_px, network);
    Gate(tolerance_px, network);
    const bool whole_lens = Placed(network) >= kLensStations;
    Adjust(whole_lens ? kLensFree : kFocalAndRadialFree, 0.2 * tolerance_px, network);
    const std::vector<double> errors = Errors(network);
    const bool grew = Placed(network) > before;
    const double last_px = tolerance_px;
    if (!errors.empty() && whole_lens) {
      tolerance_px = std::clamp(kSpread * Median(errors), kNarrow * side_px, kWide * side_px);
    }
    if (!grew && tolerance_px >= 0.5 * last_px) break;
  }
  Gate(tolerance_px, network);
}

void PlaceMore(double tolerance_px, const std::vector<bool>& barred, Network& network,
               Random& random) {
  constexpr std::size_t kMinKnown = 4;
  const Observations observations = ObservationsByStation(network);
  bool grew = true;
  while (grew) {
    grew = false;
    PlacePoints(tolerance_px, network, barred);
    for (const std::size_t station : NextStations(network, observations, kMinKnown)) {
      grew |= PlaceStation(station, observations, tolerance_px, network, random);
    }
  }
}

bool StartNetwork(const NetworkStartOptions& options, Network& network, Random& random) {
  const Observations observations = ObservationsByStation(network);
  auto seed = BestSeed(options, observations, network, random);
  if (!seed) return false;
  network = std::move(seed->network);
  GrowNetwork(options, network, random);
  return true;
}

}  // namespace trammel::part_alignment
