#include "part_alignment/survey/survey_plain.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "base/statistics.h"
#include "part_alignment/survey/plain_view.h"
#include "part_alignment/survey/snooping.h"
#include "part_alignment/survey/survey_discs.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

constexpr double kMedianChiSquare2 = 1.3862943611198906;  // for two degrees of freedom: 2 ln 2
constexpr double kMinNoise = 0.2;                         // floor, in stated sigmas
constexpr double kMaxNoise = 5;
// Maximum sigma of a plain point: reflections on screws move by about as much from picture to
// picture, and such uncertain outlines determine no disc (part_alignment_study).
constexpr double kMaxSigma_px = 0.5;

std::optional<std::string> TooMany(const SurveyInput& input) {
  std::size_t all = 0;
  for (const SurveyPicture& picture : input.pictures) {
    all += picture.plain.size();
    if (picture.plain.size() > kMaxPlainOfPicture) {
      return fmt::format(
          "{} shows {} plain points; up to {} in a picture can be told apart: let the finder take "
          "brighter or larger discs only, or cover what shines",
          picture.name, picture.plain.size(), kMaxPlainOfPicture);
    }
  }
  if (all <= kMaxPlainPoints) return std::nullopt;
  return fmt::format(
      "the pictures show {} plain points; up to {} in all can be matched: leave out pictures, or "
      "points that are no targets",
      all, kMaxPlainPoints);
}

// Returns the coded targets' extent, and a tenth of the largest side more.
PlainRoom RoomOf(const Network& network) {
  constexpr double kBeyond = 0.1;
  PlainRoom room;
  room.low = Vector3d::Constant(std::numeric_limits<double>::infinity());
  room.high = -room.low;
  for (const NetworkPoint& point : network.points) {
    if (!point.placed) continue;
    room.low = room.low.cwiseMin(point.at);
    room.high = room.high.cwiseMax(point.at);
  }
  const Vector3d beyond = Vector3d::Constant(kBeyond * (room.high - room.low).maxCoeff());
  room.low -= beyond;
  room.high += beyond;
  return room;
}

// Views of the pictures in use that show plain points.
struct Views {
  std::vector<PlainView> views;
  std::vector<std::size_t> pictures;
};

Views ViewsOf(const SurveyInput& input, const Network& network, const NetworkPrecision& precision,
              const PlainRoom& room, double noise) {
  std::map<std::size_t, const NetworkPrecision::StationPrecision*> precisions;
  for (const auto& station : precision.stations) precisions[station.station] = &station;
  const Vector3d middle = 0.5 * (room.low + room.high);
  Views views;
  for (std::size_t s = 0; s < input.pictures.size(); ++s) {
    const Station& station = network.stations[s];
    if (!station.placed || input.pictures[s].plain.empty()) continue;
    const auto known = precisions.find(s);
    views.views.emplace_back(input.pictures[s], station, network.lens,
                             known == precisions.end() ? nullptr : known->second,
                             (station.place - middle).norm(), noise);
    views.pictures.push_back(s);
  }
  return views;
}

double UsualVariance(const Views& views) {
  std::vector<double> variances;
  for (const PlainView& view : views.views) variances.push_back(view.usual_covariance().trace());
  return Median(variances);
}

// Estimates the scatter of plain points, in their stated sigmas, from targets that many rays
// confirm, matched within wide bands.
double NoiseOf(const SurveyInput& input, const Network& network, const NetworkPrecision& precision,
               const PlainMatchOptions& options, double scatter) {
  constexpr double kWide = 3;
  PlainMatchOptions pilot = options;
  pilot.min_off_plane = 5;
  pilot.max_targets = 40;
  const double wide = kWide * scatter;
  const Views views = ViewsOf(input, network, precision, options.room, wide);
  const PlainMatches matches = MatchPlainObservations(views.views, pilot);
  constexpr std::size_t kMinTargets = 5;
  if (matches.targets.size() < kMinTargets) return scatter;
  std::vector<double> squares;
  for (const PlainMatch& match : matches.targets) {
    const double left = 1 - 1.5 / static_cast<double>(match.members.size());
    for (const PlainMember& member : match.members) {
      const PlainObservation& sight = views.views[member.view].sights()[member.sight];
      const auto prediction = views.views[member.view].Predict(match.at);
      if (!prediction) continue;
      const Eigen::Vector2d off = sight.slope - prediction->slope;
      squares.push_back(off.dot(sight.covariance.inverse() * off) / left);
    }
  }
  const double ratio = Median(squares) / kMedianChiSquare2;
  // Stations and lens are off alike in neighbouring pictures, which residuals do not show. All is
  // attributed to the points, as too much does less harm to the search than too little.
  const double all = UsualVariance(views);
  const double stations = UsualVariance(ViewsOf(input, network, precision, options.room, 0));
  return std::max(wide * std::sqrt(ratio * all / (all - stations)), kMinNoise);
}

double UsualSigma_px(const SurveyInput& input) {
  std::vector<double> sigma_px;
  for (const SurveyPicture& picture : input.pictures) {
    for (const PlainPoint& point : picture.plain) sigma_px.push_back(point.sigma_px);
  }
  return Median(sigma_px);
}

// Returns the coded targets, with their uncertainties.
std::vector<PlainMatch> CodedOf(const Network& network, const NetworkPrecision& precision) {
  std::vector<PlainMatch> coded;
  Eigen::Index row = 0;
  for (const NetworkPoint& point : network.points) {
    if (!point.placed) continue;
    PlainMatch& match = coded.emplace_back();
    match.at = point.at;
    match.covariance = precision.points.block<3, 3>(row, row);
    row += 3;
  }
  return coded;
}

const char* WordsFor(PlainFate fate) {
  switch (fate) {
    case PlainFate::kFree:
      return "agree with no two other pictures on a place among the coded targets";
    case PlainFate::kOnePlane:
      return "agree only with pictures in one plane with it, as points of a row do by chance: "
             "photograph from above and below that plane";
    case PlainFate::kChance:
      return "agree with so few pictures that it may be by chance: more pictures from that side";
    case PlainFate::kAmbiguous:
      return "fit two targets alike";
    case PlainFate::kResidual:
      return "belong to targets whose lines of sight miss one another";
    case PlainFate::kNotStill:
      return "belong to what stands beside its place in other pictures: moved, or a reflection";
    case PlainFate::kMoved:
      return "belong to targets that were put elsewhere meanwhile";
    case PlainFate::kCoded:
      return "are discs of coded targets whose codes were not read there";
    case PlainFate::kNoDisc:
      return "have outlines that no round disc has from all these sides: a reflection, or two "
             "discs";
    case PlainFate::kMerged:
      return "are one disc of two targets so close that the picture does not tell them apart";
    case PlainFate::kUsed:
      return "contradict the other points of their target";
  }
  return "";
}

}  // namespace

bool HasPlainPoints(const SurveyInput& input) {
  return std::any_of(input.pictures.begin(), input.pictures.end(),
                     [](const SurveyPicture& picture) { return !picture.plain.empty(); });
}

PlainSearch AddPlainTargets(const SurveyInput& input, const NetworkPrecision& precision,
                            double scatter, IndexedSurvey& indexed) {
  Network& network = indexed.network;
  PlainSearch search;
  search.first_point = network.points.size();
  search.first_observation = network.observations.size();
  search.fates.resize(input.pictures.size());
  for (std::size_t s = 0; s < input.pictures.size(); ++s) {
    if (network.stations[s].placed)
      search.fates[s].assign(input.pictures[s].plain.size(), PlainFate::kFree);
  }
  if (const auto many = TooMany(input)) {
    search.refused = *many;
    return search;
  }
  PlainMatchOptions options;
  options.room = RoomOf(network);
  options.known = CodedOf(network, precision);
  const double noise = NoiseOf(input, network, precision, options, scatter);
  search.noise = noise;
  if (noise > kMaxNoise) {
    search.refused = fmt::format(
        "plain points scatter by {:.1f} times what is stated of them (at most {:.0f}): discs that "
        "are no discs, or stated uncertainties far too small",
        noise, kMaxNoise);
    return search;
  }
  if (const double sigma_px = noise * UsualSigma_px(input); sigma_px > kMaxSigma_px) {
    search.refused = fmt::format(
        "plain points are known to {:.2f} px (at most {:.1f}): reflections on screws and edges "
        "stand as still as targets do; photograph from nearer, and sharper",
        sigma_px, kMaxSigma_px);
    return search;
  }
  const Views views = ViewsOf(input, network, precision, options.room, noise);
  PlainMatches matches = MatchPlainObservations(views.views, options);
  if (matches.gave_up || matches.targets.size() > kMaxPlainTargets) {
    search.refused =
        matches.gave_up
            ? fmt::format(
                  "so many plain points are in one another's epipolar bands that {} "
                  "places do not tell them apart: fewer points, or smaller uncertainties",
                  options.max_places)
            : fmt::format(
                  "{} plain targets; up to {} are adjusted together: survey the part in "
                  "pieces",
                  matches.targets.size(), kMaxPlainTargets);
    return search;
  }
  for (std::size_t v = 0; v < views.views.size(); ++v) {
    for (std::size_t k = 0; k < views.views[v].sights().size(); ++k) {
      search.fates[views.pictures[v]][views.views[v].sights()[k].point] = matches.fates[v][k];
    }
  }
  std::sort(matches.targets.begin(), matches.targets.end(),
            [](const PlainMatch& a, const PlainMatch& b) { return a.at.x() < b.at.x(); });
  const std::set<std::string> taken(indexed.ids.begin(), indexed.ids.end());
  std::vector<std::optional<ImageEllipse>> discs(network.observations.size());
  int number = 0;
  for (const PlainMatch& match : matches.targets) {
    std::string id;
    do {
      id = fmt::format("P{}", ++number);
    } while (taken.contains(id));
    for (const PlainMember& member : match.members) {
      const std::size_t picture = views.pictures[member.view];
      const std::size_t k = views.views[member.view].sights()[member.sight].point;
      const PlainPoint& point = input.pictures[picture].plain[k];
      network.observations.push_back({picture,
                                      network.points.size(),
                                      {point.column_px, point.row_px},
                                      noise * point.sigma_px,
                                      true});
      discs.push_back(point.disc);
      search.sources.push_back({picture, k});
    }
    network.points.push_back({match.at, true});
    indexed.ids.push_back(std::move(id));
  }
  std::vector<bool> corrected;
  CorrectDiscs(discs, corrected, network);
  return search;
}

void RemovePlainTargets(const PlainSearch& search, IndexedSurvey& indexed) {
  indexed.network.points.resize(search.first_point);
  indexed.network.observations.resize(search.first_observation);
  indexed.corrected.resize(search.first_observation);
  indexed.ids.resize(search.first_point);
}

void LeaveOutMovedPlain(const PlainSearch& search, IndexedSurvey& indexed,
                        std::vector<std::size_t>& moved) {
  for (const MovedPoint& point : FindMovedPoints(indexed.network)) {
    if (point.point < search.first_point) continue;
    indexed.network.points[point.point].placed = false;
    moved.push_back(point.point);
  }
}

PlainSummary SummarisePlain(const SurveyInput& input, const PlainSearch& search,
                            const std::vector<std::size_t>& moved, const Network& network) {
  PlainSummary summary;
  summary.refused = !search.refused.empty();
  summary.reason = search.refused;
  auto fates = search.fates;
  if (summary.refused) {
    for (const auto& of_picture : fates) summary.points += static_cast<int>(of_picture.size());
    return summary;
  }
  for (std::size_t i = 0; i < search.sources.size(); ++i) {
    const NetworkObservation& observation = network.observations[search.first_observation + i];
    PlainFate& fate = fates[search.sources[i].picture][search.sources[i].point];
    if (TakesPart(network, observation)) {
      ++summary.used;
    } else if (std::find(moved.begin(), moved.end(), observation.point) != moved.end()) {
      fate = PlainFate::kMoved;
    } else if (!network.points[observation.point].placed) {
      fate = PlainFate::kResidual;
    }
  }
  for (std::size_t p = search.first_point; p < network.points.size(); ++p) {
    if (network.points[p].placed) ++summary.targets;
  }
  std::set<std::pair<std::size_t, std::size_t>> taking_part;
  for (std::size_t i = 0; i < search.sources.size(); ++i) {
    if (TakesPart(network, network.observations[search.first_observation + i]))
      taking_part.insert({search.sources[i].picture, search.sources[i].point});
  }
  struct Tally {
    int points = 0;
    std::set<std::size_t> pictures;
  };
  std::map<PlainFate, Tally> left_over;
  for (std::size_t s = 0; s < input.pictures.size(); ++s) {
    for (std::size_t k = 0; k < fates[s].size(); ++k) {
      ++summary.points;
      if (taking_part.contains({s, k})) continue;
      Tally& tally = left_over[fates[s][k]];
      ++tally.points;
      tally.pictures.insert(s);
    }
  }
  for (const auto& [fate, tally] : left_over) {
    summary.left_over.push_back(
        {WordsFor(fate), tally.points, static_cast<int>(tally.pictures.size())});
  }
  std::stable_sort(summary.left_over.begin(), summary.left_over.end(),
                   [](const auto& a, const auto& b) { return a.points > b.points; });
  return summary;
}

}  // namespace trammel::part_alignment
