#include "part_alignment/survey/survey_answer.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "part_alignment/survey/network_start.h"
#include "part_alignment/survey/orientation.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// Sums of the used observations' squared misclosures, by a key of the observation.
struct Squares {
  double sum_px2 = 0;
  int observations = 0;
  [[nodiscard]] double Rms() const {
    return observations > 0 ? std::sqrt(sum_px2 / (2 * observations)) : 0;
  }
};

template <class Key>
std::vector<Squares> SquaresBy(const Network& network, std::size_t count, Key key) {
  std::vector<Squares> squares(count);
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    Squares& of = squares[key(observation)];
    const auto misclosure = Misclosure(network, observation);
    if (misclosure) of.sum_px2 += misclosure->squaredNorm();
    ++of.observations;
  }
  return squares;
}

// Returns the point, other than its own, that the network predicts at an observation.
std::optional<std::size_t> PointAt(const Network& network, const NetworkObservation& observation) {
  constexpr double kThere = 20;  // sigmas
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (p == observation.point || !network.points[p].placed) continue;
    NetworkObservation other = observation;
    other.point = p;
    const auto misclosure = Misclosure(network, other);
    if (misclosure && misclosure->norm() < std::max(1.0, kThere * observation.sigma_px)) return p;
  }
  return std::nullopt;
}

// Returns the largest angle between two of these unit lines, up to 90 degrees.
double WidestAngle(const std::vector<Vector3d>& lines) {
  double min_cosine = 1;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = i + 1; j < lines.size(); ++j) {
      min_cosine = std::min(min_cosine, std::abs(lines[i].dot(lines[j])));
    }
  }
  return std::acos(min_cosine);
}

// Returns each point's lines of sight from the placed stations, even if they do not meet.
std::vector<std::vector<Vector3d>> RaysOf(const Network& network) {
  std::vector<std::vector<Vector3d>> rays(network.points.size());
  for (const NetworkObservation& observation : network.observations) {
    const Station& station = network.stations[observation.station];
    if (!station.placed) continue;
    if (const auto line = ObservationLine(network.lens, observation.pixel)) {
      rays[observation.point].emplace_back(station.rotation.transpose() * *line);
    }
  }
  return rays;
}

// Returns the focal length with which a picture fits the placed points, if there is one.
std::optional<double> OtherFocal(Network network, const std::vector<std::size_t>& observations,
                                 double tolerance_px, Random& random) {
  constexpr double kMinShare = 0.8;
  constexpr std::size_t kMin = 6;
  const double focal = network.lens[kFocal];
  for (const double factor : {0.9, 1.1, 0.8, 1.25, 0.65, 1.55}) {
    network.lens[kFocal] = factor * focal;
    const auto resection = Resect(network, observations, 10 * tolerance_px, random);
    if (!resection || resection->agreeing < kMin) continue;
    const double loss = 10 * tolerance_px / network.observations[observations.front()].sigma_px;
    const auto fit = FitStation(network, observations, resection->station, 0.1 * loss, true);
    if (!fit) continue;
    network.lens[kFocal] = fit->focal_px;
    std::size_t agreeing = 0;
    for (const std::size_t i : observations) {
      const NetworkObservation& observation = network.observations[i];
      if (!network.points[observation.point].placed) continue;
      const auto there =
          ProjectLens(network.lens, fit->station.FromObject(network.points[observation.point].at));
      if (there && (there->pixel - observation.pixel).norm() < tolerance_px) ++agreeing;
    }
    if (static_cast<double>(agreeing) >= kMinShare * static_cast<double>(resection->observations)) {
      return fit->focal_px;
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<PointSupport> SupportOf(const Network& network) {
  std::vector<std::vector<Vector3d>> lines(network.points.size());
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    lines[observation.point].push_back(
        (network.points[observation.point].at - network.stations[observation.station].place)
            .normalized());
  }
  std::vector<PointSupport> support(network.points.size());
  for (std::size_t p = 0; p < lines.size(); ++p) {
    support[p].observations = static_cast<int>(lines[p].size());
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& line : lines[p]) sum -= line;
    if (sum.norm() > 0) support[p].seen_from = sum.normalized();
    support[p].widest_angle_rad = WidestAngle(lines[p]);
  }
  return support;
}

std::optional<double> ScaleOf(const Network& network) {
  std::vector<double> ratios;
  for (const NetworkBar& bar : network.bars) {
    if (!TakesPart(network, bar)) continue;
    ratios.push_back(bar.length / (network.points[bar.to].at - network.points[bar.from].at).norm());
  }
  return ratios.empty() ? std::nullopt : std::optional(Median(ratios));
}

void LayDatum(Network& network) {
  Vector3d centroid = Vector3d::Zero();
  double count = 0;
  for (const NetworkPoint& point : network.points) {
    if (!point.placed) continue;
    centroid += point.at;
    ++count;
  }
  centroid /= count;
  Matrix3d spread = Matrix3d::Zero();
  Vector3d first = Vector3d::Zero();
  for (const NetworkPoint& point : network.points) {
    if (!point.placed) continue;
    if (first.isZero()) first = point.at - centroid;
    spread += (point.at - centroid) * (point.at - centroid).transpose();
  }
  Vector3d stations = Vector3d::Zero();
  for (const Station& station : network.stations) {
    if (station.placed) stations += station.place - centroid;
  }
  const auto eigen = geometry::DecomposeSymmetric(spread);
  Vector3d z = eigen.vectors.col(0);
  Vector3d x = eigen.vectors.col(2);
  if (z.dot(stations) < 0) z = -z;
  if (x.dot(first) < 0) x = -x;
  Matrix3d rotation;
  rotation.row(0) = x.transpose();
  rotation.row(1) = z.cross(x).transpose();
  rotation.row(2) = z.transpose();
  Transform(rotation, centroid, 1, network);
}

void NoteInput(const SurveyInput& input, const IndexedSurvey& indexed, Survey& survey) {
  for (const SurveyPicture& picture : input.pictures) {
    SurveyStation& station = survey.stations.emplace_back();
    station.picture = picture.name;
    if (picture.observations.empty()) station.reason = "shows no coded target";
  }
  for (std::size_t b = 0; b < input.bars.size(); ++b) {
    survey.bars.push_back({input.bars[b], {}});
    const auto& known = indexed.bar_of;
    if (std::find(known.begin(), known.end(), b) != known.end()) continue;
    survey.notices.push_back(fmt::format("the scale bar {}-{} is not used: no picture shows {}",
                                         input.bars[b].from, input.bars[b].to, "both of its ends"));
  }
}

std::optional<std::string> NoteUnplaced(const SurveyInput& input, const Network& network,
                                        int longer_side_px, Random& random, Survey& survey) {
  constexpr double kTolerance = 1e-3;  // relative to the side
  const auto observations = ObservationsByStation(network);
  std::vector<std::string> other_focal;
  double last_focal_px = 0;
  for (std::size_t s = 0; s < observations.size(); ++s) {
    std::string& reason = survey.stations[s].reason;
    if (network.stations[s].placed || !reason.empty()) continue;
    const auto known = std::count_if(
        observations[s].begin(), observations[s].end(),
        [&](std::size_t i) { return network.points[network.observations[i].point].placed; });
    if (known < 4) {
      reason = fmt::format("shows {} of the targets that the others show; four are needed", known);
      continue;
    }
    Network all = network;
    for (const std::size_t i : observations[s]) all.observations[i].used = true;
    const auto focal = OtherFocal(all, observations[s], kTolerance * longer_side_px, random);
    if (focal) {
      reason = fmt::format("was taken with a focal length of {:.0f} px, the others with {:.0f}",
                           *focal, network.lens[kFocal]);
      survey.stations[s].contradicts = true;
      other_focal.push_back(input.pictures[s].name);
      last_focal_px = *focal;
    } else {
      reason = fmt::format(
          "contradicts the others: its {} targets stand otherwise in them (another part, a moved "
          "one, or exchanged codes)",
          known);
      survey.stations[s].contradicts = true;
    }
  }
  if (other_focal.size() < 3) return std::nullopt;
  return fmt::format(
      "{} pictures, {} … {}, were taken with another focal length (about {:.0f} px, the others "
      "with {:.0f}): zoom and focus must stay as they are; survey them apart",
      other_focal.size(), other_focal.front(), other_focal.back(), last_focal_px,
      network.lens[kFocal]);
}

void NoteUnplacedTargets(const IndexedSurvey& indexed, Survey& survey) {
  const Network& network = indexed.network;
  std::vector<int> seen(network.points.size());
  for (const NetworkObservation& observation : network.observations) {
    if (network.stations[observation.station].placed) ++seen[observation.point];
  }
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (network.points[p].placed) continue;
    survey.notices.push_back(fmt::format(
        "target {} is not given: {} of the pictures used {} it{}; photograph it from more sides",
        indexed.ids[p], seen[p], seen[p] == 1 ? "shows" : "show",
        seen[p] < 2 ? "" : ", and no two agree on its place from sides far enough apart"));
  }
}

void DropNoticesOfGiven(const IndexedSurvey& indexed, Survey& survey) {
  const Network& network = indexed.network;
  for (std::size_t p = 0; p < indexed.coded; ++p) {
    const std::string begin = fmt::format("target {} is not given:", indexed.ids[p]);
    const auto is_of = [&](const std::string& notice) { return notice.starts_with(begin); };
    auto last = std::find_if(survey.notices.rbegin(), survey.notices.rend(), is_of);
    if (last == survey.notices.rend()) continue;
    const std::string kept = *last;
    std::erase_if(survey.notices, is_of);
    if (!network.points[p].placed) survey.notices.push_back(kept);
  }
}

std::optional<std::string> FallsApart(const SurveyInput& input, const Survey& survey,
                                      const Network& network) {
  std::size_t with_targets = 0;
  std::size_t placed = 0;
  std::string first;
  for (std::size_t s = 0; s < network.stations.size(); ++s) {
    if (input.pictures[s].observations.empty()) continue;
    ++with_targets;
    if (network.stations[s].placed) {
      ++placed;
    } else if (first.empty()) {
      first = fmt::format("; {} {}", survey.stations[s].picture, survey.stations[s].reason);
    }
  }
  constexpr double kMinShare = 2.0 / 3;
  if (static_cast<double>(placed) >= kMinShare * static_cast<double>(with_targets)) {
    return std::nullopt;
  }
  return fmt::format(
      "only {} of {} pictures hang together{}: neighbouring pictures must share six targets",
      placed, with_targets, first);
}

void NoteOutliers(const SurveyInput& input, const IndexedSurvey& indexed, const Network& network,
                  Survey& survey) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t>
      read_as;  // station, point: stands there
  for (const NetworkObservation& observation : network.observations) {
    if (observation.used || !network.stations[observation.station].placed ||
        !network.points[observation.point].placed || observation.point >= indexed.coded) {
      continue;
    }
    const auto misclosure = Misclosure(network, observation);
    SurveyOutlier outlier;
    outlier.picture = input.pictures[observation.station].name;
    outlier.target = indexed.ids[observation.point];
    outlier.error_px = misclosure ? misclosure->norm() : INFINITY;
    if (const auto there = PointAt(network, observation)) {
      outlier.seen_there = indexed.ids[*there];
      read_as[{observation.station, observation.point}] = *there;
    }
    survey.outliers.push_back(std::move(outlier));
  }
  for (const auto& [from, there] : read_as) {
    const auto back = read_as.find({from.first, there});
    if (back == read_as.end() || back->second != from.second || there < from.second) continue;
    survey.notices.push_back(fmt::format("in {} the targets {} and {} are exchanged",
                                         input.pictures[from.first].name, indexed.ids[from.second],
                                         indexed.ids[there]));
  }
}

AdjustmentCheck CheckOf(const IndexedSurvey& indexed, const SurveyOptions& options,
                        const std::set<std::size_t>& moved, const NetworkPrecision& precision,
                        const Survey& survey) {
  const Network& network = indexed.network;
  std::vector<bool> disagrees(network.points.size());
  const auto rays = RaysOf(network);
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    const bool seen_enough = std::ssize(rays[p]) > options.min_observations &&
                             WidestAngle(rays[p]) >= options.min_angle_rad;
    disagrees[p] = moved.contains(p) || (!network.points[p].placed && seen_enough);
  }
  RejectionTally tally;
  for (const NetworkObservation& observation : network.observations) {
    const SurveyStation& station = survey.stations[observation.station];
    const bool used = TakesPart(network, observation);
    const bool placed = network.stations[observation.station].placed;
    const bool rejected =
        placed ? (network.points[observation.point].placed && !used) || disagrees[observation.point]
               : station.contradicts;
    if (!used && !rejected) continue;
    tally.Add({"picture " + station.picture, "target " + indexed.ids[observation.point]}, rejected);
  }
  return tally.Check(static_cast<int>(std::lround(precision.observation_redundancy)));
}

void FillAnswer(const SurveyInput& input, const IndexedSurvey& indexed,
                const NetworkPrecision& precision, Survey& survey) {
  const Network& network = indexed.network;
  const auto support = SupportOf(network);
  const auto by_point =
      SquaresBy(network, network.points.size(),
                [](const NetworkObservation& observation) { return observation.point; });
  const auto by_station =
      SquaresBy(network, network.stations.size(),
                [](const NetworkObservation& observation) { return observation.station; });
  std::vector<double> least(network.points.size(), 1);
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    if (!TakesPart(network, network.observations[i])) continue;
    double& of_point = least[network.observations[i].point];
    of_point = std::min(of_point, precision.observations[i].redundancy);
  }
  survey.covariance = precision.points;
  Index row = 0;
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (!network.points[p].placed) continue;
    SurveyedTarget target;
    target.id = indexed.ids[p];
    target.at_mm = network.points[p].at;
    target.sigma_mm = precision.points.diagonal().segment<3>(row).cwiseMax(0.0).cwiseSqrt();
    target.observations = support[p].observations;
    target.widest_angle_rad = support[p].widest_angle_rad;
    target.seen_from = support[p].seen_from;
    target.rms_px = by_point[p].Rms();
    target.min_redundancy = least[p];
    target.plain = p >= indexed.coded;
    survey.targets.push_back(std::move(target));
    row += 3;
  }
  for (std::size_t s = 0; s < network.stations.size(); ++s) {
    SurveyStation& station = survey.stations[s];
    station.used = network.stations[s].placed;
    station.place_mm = network.stations[s].place;
    station.camera_from_survey = network.stations[s].rotation;
    station.observations = by_station[s].observations;
    station.rms_px = by_station[s].Rms();
    if (!station.used) {
      survey.notices.push_back(
          fmt::format("{} is left out: it {}", input.pictures[s].name, station.reason));
    }
  }
  survey.lens = network.lens;
  survey.lens_sigma = precision.lens.diagonal().cwiseMax(0.0).cwiseSqrt();
}

std::optional<std::string> WeakLens(const Survey& survey) {
  constexpr double kMaxShare = 5e-3;
  if (survey.lens_sigma[kFocal] <= kMaxShare * survey.lens[kFocal]) return std::nullopt;
  return fmt::format(
      "the focal length is known to {:.1f} of {:.0f} px only: photograph the part obliquely from "
      "all sides, some pictures with the camera rolled by 90 degrees",
      survey.lens_sigma[kFocal], survey.lens[kFocal]);
}

namespace {

// Names the axis of the survey's frame nearest to a direction.
std::string SideOf(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{}{}", direction[axis] < 0 ? '-' : '+', "xyz"[axis]);
}

}  // namespace

std::vector<std::string> AdvisePictures(const Survey& survey) {
  constexpr int kFewObservations = 6;
  constexpr int kMaxNamed = 12;
  constexpr double kMuchWorse = 2;  // than the median target
  std::vector<double> sigmas_mm;
  for (const SurveyedTarget& target : survey.targets) sigmas_mm.push_back(target.sigma_mm.norm());
  if (sigmas_mm.empty()) return {};
  const double usual_mm = Median(sigmas_mm);
  struct Weak {
    std::string ids;
    int more = 0;  // beyond those named
    int named = 0;
    double worst_mm = 0;
    int fewest = 0;
  };
  std::map<std::string, Weak> weak_from;
  for (std::size_t i = 0; i < survey.targets.size(); ++i) {
    const SurveyedTarget& target = survey.targets[i];
    if (target.observations >= kFewObservations && sigmas_mm[i] < kMuchWorse * usual_mm) continue;
    Weak& weak = weak_from[SideOf(target.seen_from)];
    weak.fewest =
        weak.ids.empty() ? target.observations : std::min(weak.fewest, target.observations);
    if (weak.named < kMaxNamed) {
      weak.ids += (weak.ids.empty() ? "" : ", ") + target.id;
      ++weak.named;
    } else {
      ++weak.more;
    }
    weak.worst_mm = std::max(weak.worst_mm, sigmas_mm[i] / std::sqrt(3.0));
  }
  std::vector<std::string> advice;
  for (const auto& [side, weak] : weak_from) {
    advice.push_back(fmt::format(
        "more pictures from the {} side, from directions far apart, that show {}{}: seen {} times "
        "at least, known to {:.3f} mm at worst (k = 1, per axis); the usual target to {:.3f} mm",
        side, weak.ids, weak.more > 0 ? fmt::format(" and {} more", weak.more) : "", weak.fewest,
        weak.worst_mm, usual_mm / std::sqrt(3.0)));
  }
  return advice;
}

}  // namespace trammel::part_alignment
