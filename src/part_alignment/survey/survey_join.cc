#include "part_alignment/survey/survey_join.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "base/statistics.h"
#include "part_alignment/survey/network_start.h"
#include "part_alignment/survey/orientation.h"
#include "part_alignment/survey/plain_view.h"
#include "part_alignment/survey/survey_answer.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWide_px = 6;  // error of three rays at the other end of a part
constexpr double kNear_px = 1.5;
constexpr double kLogUnlikely = -13.8;  // a millionth
constexpr double kFacing = 0.34;        // cosine, 70 degrees

/// Known target that a picture may show.
struct Landmark {
  std::size_t point = 0;
  Vector3d at = Vector3d::Zero();
  Vector3d seen_from = Vector3d::UnitZ();
};

/// Plain point of the picture at the expected position of a landmark.
struct LandmarkObservation {
  std::size_t point = 0;  ///< network index
  std::size_t plain = 0;  ///< picture index
};

struct LandmarkObservations {
  std::vector<LandmarkObservation> at_landmarks;
  double by_chance = 0;
};

/// Picture to be resected.
class Resector {
 public:
  Resector(const SurveyPicture& picture, std::size_t station,
           const std::vector<Landmark>& landmarks, std::size_t coded,
           const std::vector<std::size_t>& observations, Network& network)
      : picture_(picture),
        station_(station),
        landmarks_(landmarks),
        coded_(coded),
        network_(network),
        view_(picture, Station{}, network.lens, nullptr, 1, 1) {
    for (const std::size_t i : observations) {
      const NetworkObservation& observation = network_.observations[i];
      const auto line = ObservationLine(network_.lens, observation.pixel);
      if (observation.point >= coded || !network_.points[observation.point].placed || !line)
        continue;
      known_.push_back(i);
      lines_.push_back(*line);
    }
  }

  [[nodiscard]] std::size_t Known() const { return known_.size(); }

  // Finds the position where most landmarks agree, and adds their observations.
  bool Place(Random& random) {
    if (known_.size() < 2 || view_.sights().empty()) return false;
    if (known_.size() >= 3) {
      TryCodes();
    } else {
      TryGuesses(random);
    }
    return best_ && Accept();
  }

 private:
  [[nodiscard]] const Vector3d& KnownAt(std::size_t k) const {
    return network_.points[network_.observations[known_[k]].point].at;
  }

  [[nodiscard]] LandmarkObservations Look(const Station& station, double near_px) const {
    LandmarkObservations sightings;
    const double half = near_px / view_.focal_px();
    const double share =
        std::numbers::pi * half * half * static_cast<double>(view_.sights().size()) / view_.area();
    for (const Landmark& landmark : landmarks_) {
      const Vector3d camera = station.FromObject(landmark.at);
      if (!(camera.z() > 0)) continue;
      const Vector2d slope = camera.head<2>() / camera.z();
      if (!view_.InPicture(slope)) continue;
      const Vector3d ray = (station.place - landmark.at).normalized();
      if (ray.dot(landmark.seen_from) < kFacing) continue;
      sightings.by_chance += share;
      double nearest = half;
      std::optional<std::size_t> sight;
      view_.Near(slope, Vector2d(half, half), [&](std::size_t k) {
        const double off = (view_.sights()[k].slope - slope).norm();
        if (off > nearest) return;
        nearest = off;
        sight = view_.sights()[k].point;
      });
      if (sight) sightings.at_landmarks.push_back({landmark.point, *sight});
    }
    return sightings;
  }

  void Try(const std::array<Vector3d, 3>& object, const std::array<Vector3d, 3>& lines) {
    for (const Station& station : ThreePointStations(object, lines)) {
      ++tried_;
      const std::size_t agree = Look(station, kWide_px).at_landmarks.size();
      if (best_ && agree <= agree_) continue;
      best_ = station;
      agree_ = agree;
    }
  }

  void TryCodes() {
    constexpr std::size_t kMax = 6;
    const std::size_t count = std::min(known_.size(), kMax);
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        for (std::size_t c = b + 1; c < count; ++c)
          Try({KnownAt(a), KnownAt(b), KnownAt(c)}, {lines_[a], lines_[b], lines_[c]});
      }
    }
  }

  // Tries some points as every plain target in turn.
  void TryGuesses(Random& random) {
    constexpr int kPoints = 8;
    for (int i = 0; i < kPoints; ++i) {
      const PlainObservation& sight = view_.sights()[random.Below(view_.sights().size())];
      const Vector3d line = Vector3d(sight.slope.x(), sight.slope.y(), 1).normalized();
      for (const Landmark& landmark : landmarks_) {
        if (landmark.point < coded_) continue;
        Try({KnownAt(0), KnownAt(1), landmark.at}, {lines_[0], lines_[1], line});
      }
    }
  }

  // Fits the station to its codes and its sightings of the landmarks.
  std::optional<Station> Fit(const Station& start, const LandmarkObservations& sightings,
                             double loss_px) {
    const std::size_t before = network_.observations.size();
    std::vector<std::size_t> all = known_;
    for (const LandmarkObservation& sighting : sightings.at_landmarks) {
      all.push_back(network_.observations.size());
      Observe(sighting);
    }
    const double sigma_px = network_.observations[known_.front()].sigma_px;
    const auto fit = FitStation(network_, all, start, loss_px / sigma_px, false);
    network_.observations.resize(before);
    if (!fit) return std::nullopt;
    return fit->station;
  }

  void Observe(const LandmarkObservation& sighting) {
    const PlainPoint& point = picture_.plain[sighting.plain];
    network_.observations.push_back(
        {station_, sighting.point, {point.column_px, point.row_px}, point.sigma_px, true});
  }

  bool Accept() {
    LandmarkObservations sightings = Look(*best_, kWide_px);
    for (const double near_px : {kWide_px, 0.5 * kWide_px, kNear_px}) {
      const auto fitted = Fit(*best_, sightings, 0.5 * near_px);
      if (!fitted) return false;
      best_ = *fitted;
      sightings = Look(*best_, near_px);
    }
    const auto agree = static_cast<double>(sightings.at_landmarks.size());
    const double log_chance = agree * std::log(std::max(sightings.by_chance, 1e-12)) -
                              LogGamma(agree + 1) + std::log(static_cast<double>(tried_));
    const bool codes_agree = std::all_of(known_.begin(), known_.end(), [&](std::size_t i) {
      const NetworkObservation& observation = network_.observations[i];
      const auto projection =
          ProjectLens(network_.lens, best_->FromObject(network_.points[observation.point].at));
      return projection && (projection->pixel - observation.pixel).norm() < kNear_px;
    });
    if (log_chance > kLogUnlikely || !codes_agree) return false;
    best_->placed = true;
    network_.stations[station_] = *best_;
    for (const LandmarkObservation& sighting : sightings.at_landmarks) {
      if (sighting.point >= coded_) Observe(sighting);
    }
    return true;
  }

  const SurveyPicture& picture_;
  std::size_t station_;
  const std::vector<Landmark>& landmarks_;
  std::size_t coded_;
  Network& network_;
  PlainView view_;
  std::vector<std::size_t> known_;
  std::vector<Vector3d> lines_;
  std::optional<Station> best_;
  std::size_t agree_ = 0;
  std::size_t tried_ = 0;
};

std::vector<Landmark> LandmarksOf(const Network& network) {
  const auto support = SupportOf(network);
  std::vector<Landmark> landmarks;
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (network.points[p].placed && support[p].observations >= 3)
      landmarks.push_back({p, network.points[p].at, support[p].seen_from});
  }
  return landmarks;
}

// Marks points that are rejected although enough pictures show them.
std::vector<bool> BarredOf(const Network& network) {
  std::vector<int> seen(network.points.size());
  for (const NetworkObservation& observation : network.observations) {
    if (network.stations[observation.station].placed) ++seen[observation.point];
  }
  std::vector<bool> barred(network.points.size());
  for (std::size_t p = 0; p < seen.size(); ++p)
    barred[p] = !network.points[p].placed && seen[p] >= 3;
  return barred;
}

// Uses observations that agree, of new points and stations.
void Gate(const std::vector<bool>& old_points, const std::vector<bool>& old_stations,
          Network& network) {
  for (NetworkObservation& observation : network.observations) {
    if (old_points[observation.point] && old_stations[observation.station]) continue;
    if (!network.points[observation.point].placed || !network.stations[observation.station].placed)
      continue;
    const auto misclosure = Misclosure(network, observation);
    observation.used = misclosure && misclosure->norm() < 2 * kNear_px;
  }
}

}  // namespace

std::vector<std::size_t> JoinPictures(const SurveyInput& input, std::size_t coded, Network& network,
                                      Random& random) {
  std::vector<bool> old_points;
  std::vector<bool> old_stations;
  for (const NetworkPoint& point : network.points) old_points.push_back(point.placed);
  for (const Station& station : network.stations) old_stations.push_back(station.placed);
  const std::vector<bool> barred = BarredOf(network);
  const std::vector<Landmark> landmarks = LandmarksOf(network);
  // Stations with four known codes or more have contradicted them before.
  std::vector<std::size_t> waiting;
  const auto first = ObservationsByStation(network);
  for (std::size_t s = 0; s < network.stations.size(); ++s) {
    if (old_stations[s] || input.pictures[s].plain.empty()) continue;
    constexpr std::size_t kEnough = 4;
    if (Resector(input.pictures[s], s, landmarks, coded, first[s], network).Known() < kEnough)
      waiting.push_back(s);
  }
  bool grew = !waiting.empty();
  while (grew) {
    grew = false;
    for (const std::size_t least : {3, 2}) {
      for (const std::size_t s : waiting) {
        if (network.stations[s].placed || grew) continue;
        const auto observations = ObservationsByStation(network);
        Resector resector(input.pictures[s], s, landmarks, coded, observations[s], network);
        if (resector.Known() >= least) grew = resector.Place(random);
      }
    }
    if (grew) PlaceMore(2 * kNear_px, barred, network, random);
  }
  std::vector<std::size_t> joined;
  for (std::size_t s = 0; s < network.stations.size(); ++s) {
    if (network.stations[s].placed && !old_stations[s]) joined.push_back(s);
  }
  if (!joined.empty()) Gate(old_points, old_stations, network);
  return joined;
}

}  // namespace trammel::part_alignment
