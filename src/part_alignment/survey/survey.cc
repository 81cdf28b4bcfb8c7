#include "part_alignment/survey/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "base/random.h"
#include "base/rejection.h"
#include "geometry/linear_systems.h"
#include "part_alignment/part_fit/scale_bars.h"
#include "part_alignment/survey/bundle.h"
#include "part_alignment/survey/network_start.h"
#include "part_alignment/survey/snooping.h"
#include "part_alignment/survey/survey_answer.h"
#include "part_alignment/survey/survey_discs.h"
#include "part_alignment/survey/survey_input.h"
#include "part_alignment/survey/survey_join.h"
#include "part_alignment/survey/survey_plain.h"

namespace trammel::part_alignment {
namespace {

constexpr double kLossWidth = 3;  // sigmas, of Cauchy's loss
constexpr const char* kUndetermined =
    "the pictures do not determine where all of this is: the targets lie along one line, or the "
    "pictures are all from one place; take them from all around";
constexpr double kGrossSigma = 30;   // beyond it an observation is wrong before any test of it
constexpr double kMinScatter = 0.2;  // stated sigmas may be too large by that, no more is believed

Survey Ended(Survey survey, Verdict verdict, std::string reason) {
  survey.verdict = verdict;
  survey.reason = std::move(reason);
  return survey;
}

NetworkStartOptions StartOptionsOf(const SurveyInput& input, int side_px) {
  NetworkStartOptions options;
  options.longer_side_px = side_px;
  if (input.focal_length_px) {
    options.focal_guesses_px = {*input.focal_length_px};
  } else {
    for (const double share : {0.7, 0.95, 1.3, 0.55, 1.8, 2.5}) {
      options.focal_guesses_px.push_back(share * side_px);
    }
  }
  return options;
}

// Adjusts the network until it converges, with Cauchy's loss and all observations that are not
// gross.
void Settle(const NetworkStartOptions& start, Network& network, Random& random) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    BundleOptions options;
    options.bars = false;
    options.loss_sigma = kLossWidth * std::max(RobustScatter(network), kMinScatter);
    (void)AdjustBundle(options, network);
    const double gross = kGrossSigma * std::max(RobustScatter(network), kMinScatter);
    for (NetworkObservation& observation : network.observations) {
      if (!network.stations[observation.station].placed ||
          !network.points[observation.point].placed)
        continue;
      const auto misclosure = Misclosure(network, observation);
      observation.used = misclosure && misclosure->norm() < gross * observation.sigma_px;
    }
    if (round == 0) GrowNetwork(start, network, random);
  }
}

// Drops stations and points with too few observations. True if there were any.
bool DropWeak(const SurveyOptions& options, const IndexedSurvey& indexed, Survey& survey,
              Network& network) {
  bool dropped = false;
  const auto support = SupportOf(network);
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (!network.points[p].placed) continue;
    const PointSupport& of = support[p];
    if (of.observations >= options.min_observations &&
        of.widest_angle_rad >= options.min_angle_rad) {
      continue;
    }
    network.points[p].placed = false;
    dropped = true;
    if (p >= indexed.coded) continue;
    survey.notices.push_back(fmt::format(
        "target {} is not given: {} observations, at most {:.0f} degrees apart; {} and {:.0f} are "
        "needed: photograph it from more sides",
        indexed.ids[p], of.observations, Degrees(of.widest_angle_rad), options.min_observations,
        Degrees(options.min_angle_rad)));
  }
  constexpr int kMinOfStation = 4;  // 8 equations for 6 numbers
  std::vector<int> of_station(network.stations.size());
  for (const NetworkObservation& observation : network.observations) {
    if (TakesPart(network, observation)) ++of_station[observation.station];
  }
  for (std::size_t s = 0; s < network.stations.size(); ++s) {
    if (!network.stations[s].placed || of_station[s] >= kMinOfStation) continue;
    network.stations[s].placed = false;
    survey.stations[s].reason =
        fmt::format("agrees with the others in {} of its targets only", of_station[s]);
    survey.stations[s].contradicts = true;
    dropped = true;
  }
  return dropped;
}

// @returns the points that moved.
std::set<std::size_t> LeaveOutMoved(const SurveyInput& input, const std::vector<std::string>& ids,
                                    Survey& survey, Network& network) {
  std::set<std::size_t> points;
  const double size = ScaleOf(network).value_or(0);
  for (const MovedPoint& moved : FindMovedPoints(network)) {
    network.points[moved.point].placed = false;
    points.insert(moved.point);
    survey.notices.push_back(fmt::format(
        "target {} moved{} before {}, against all others: it is left out{}", ids[moved.point],
        size > 0 ? fmt::format(" by {:.2f} mm", size * moved.by) : std::string(),
        input.pictures[moved.first_after].name,
        size > 0 ? "" : "; by how much, no scale bar tells"));
  }
  return points;
}

// Drops codes read at the place of another target: of two at one place the one in fewer pictures,
// or both if that does not decide. True if there were any.
bool DropTwins(const IndexedSurvey& indexed, const NetworkPrecision& precision, Survey& survey,
               Network& network) {
  constexpr double kOnePlace = 25;  // squared sigmas: no two targets are so near
  constexpr double kClear = 2;      // times as many pictures
  std::vector<std::size_t> placed;
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (network.points[p].placed) placed.push_back(p);
  }
  const auto support = SupportOf(network);
  bool dropped = false;
  const auto drop = [&](std::size_t p, std::size_t other) {
    network.points[p].placed = false;
    dropped = true;
    survey.notices.push_back(fmt::format(
        "target {} is not given: it is at the place of target {}, so that one of the two codes was "
        "misread (in {} and {} pictures)",
        indexed.ids[p], indexed.ids[other], support[p].observations, support[other].observations));
  };
  for (std::size_t i = 0; i < placed.size(); ++i) {
    for (std::size_t k = i + 1; k < placed.size() && placed[k] < indexed.coded; ++k) {
      const auto a = 3 * static_cast<Eigen::Index>(i);
      const auto b = 3 * static_cast<Eigen::Index>(k);
      const Eigen::Vector3d apart = network.points[placed[k]].at - network.points[placed[i]].at;
      const Eigen::MatrixXd& points = precision.points;
      const Eigen::Matrix3d covariance = points.block<3, 3>(a, a) + points.block<3, 3>(b, b) -
                                         points.block<3, 3>(a, b) - points.block<3, 3>(b, a);
      if (geometry::SquaredMahalanobisDistance(covariance, apart) > kOnePlace) continue;
      const double of_i = support[placed[i]].observations;
      const double of_k = support[placed[k]].observations;
      if (of_k <= kClear * of_i) drop(placed[k], placed[i]);
      if (of_i <= kClear * of_k) drop(placed[i], placed[k]);
    }
  }
  return dropped;
}

// Drops codes for which several pictures agree on one place and several on another.
bool DropDoubles(const IndexedSurvey& indexed, Survey& survey, Network& network) {
  bool dropped = false;
  for (const DoublePoint& at : FindDoublePoints(network)) {
    if (at.point >= indexed.coded) continue;
    network.points[at.point].placed = false;
    dropped = true;
    survey.notices.push_back(fmt::format(
        "target {} is not given: {} pictures show it at one place and {} at another, so that a "
        "code was misread or two targets have it",
        indexed.ids[at.point], at.here, at.there));
  }
  return dropped;
}

struct Adjusted {
  NetworkPrecision precision;
  BarScale scale;            // bars between given points
  double scatter = 1;        // coded targets' centres
  double plain_scatter = 1;  // plain targets' centres
};

// Computes the scatter of the observations of points `first` to `end`, in their sigmas.
double ScatterOf(const Network& network, const NetworkPrecision& precision, std::size_t first,
                 std::size_t end) {
  double squares = 0;
  double redundancy = 0;
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const NetworkObservation& observation = network.observations[i];
    if (observation.point < first || observation.point >= end || !TakesPart(network, observation))
      continue;
    const auto misclosure = Misclosure(network, observation);
    if (!misclosure) continue;
    squares += misclosure->squaredNorm() / (observation.sigma_px * observation.sigma_px);
    redundancy += 2 * precision.observations[i].redundancy;
  }
  return std::max(std::sqrt(squares / std::max(redundancy, 1.0)), kMinScatter);
}

// Returns bars with both ends in the network, and their lengths in the network without bars.
// @param of_bars  indices into network.bars.
FoundBars FindBars(const SurveyInput& input, const IndexedSurvey& indexed,
                   const Eigen::MatrixXd& of_points, const std::vector<std::size_t>& of_bars) {
  const Network& network = indexed.network;
  std::vector<Eigen::Index> first_of_point;
  Eigen::Index unknowns = 0;
  for (const NetworkPoint& point : network.points) {
    first_of_point.push_back(unknowns);
    if (point.placed) unknowns += 3;
  }
  const auto count = std::ssize(of_bars);
  FoundBars found;
  found.lengths.resize(count);
  Eigen::MatrixXd by_points = Eigen::MatrixXd::Zero(count, unknowns);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::size_t b = of_bars[static_cast<std::size_t>(i)];
    const NetworkBar& bar = network.bars[b];
    const Eigen::Vector3d along = network.points[bar.to].at - network.points[bar.from].at;
    found.bars.push_back(input.bars[indexed.bar_of[b]]);
    found.lengths[i] = along.norm();
    const Eigen::RowVector3d share = (along / along.squaredNorm()).transpose();
    by_points.block<1, 3>(i, first_of_point[bar.to]) += share;
    by_points.block<1, 3>(i, first_of_point[bar.from]) -= share;
  }
  found.covariance = by_points * of_points * by_points.transpose();
  return found;
}

// Tests the bars against the network without them, and scales the network to them.
BarScale LayScale(const SurveyInput& input, const Eigen::MatrixXd& of_points,
                  IndexedSurvey& indexed, Survey& survey) {
  Network& network = indexed.network;
  std::vector<std::size_t> of_bars;
  for (std::size_t b = 0; b < network.bars.size(); ++b) {
    network.bars[b].used = true;
    survey.bars[indexed.bar_of[b]].test = {};
    if (TakesPart(network, network.bars[b])) of_bars.push_back(b);
  }
  BarScale scale = TestBars(FindBars(input, indexed, of_points, of_bars));
  for (std::size_t i = 0; i < of_bars.size(); ++i) {
    survey.bars[indexed.bar_of[of_bars[i]]].test = scale.bars[i];
    network.bars[of_bars[i]].used = scale.bars[i].used;
  }
  if (!of_bars.empty() && scale.fault.empty()) {
    Transform(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), scale.scale, network);
  }
  return scale;
}

// Adjusts by least squares with data snooping and without bars, so that a wrong bar makes no
// observation wrong; the observations' sigmas are then set to their scatter. Then the bars join. If
// they cannot, the precision is that without bars.
Adjusted Adjust(const SurveyInput& input, const SurveyOptions& options, IndexedSurvey& indexed,
                Survey& survey) {
  Network& network = indexed.network;
  BundleOptions free;
  free.bars = false;
  Adjusted adjusted;
  (void)DropWeak(options, indexed, survey, network);
  do {
    adjusted.precision = SnoopObservations(free, options.false_alarm, network);
  } while (
      (adjusted.precision.determined && DropTwins(indexed, adjusted.precision, survey, network)) ||
      DropDoubles(indexed, survey, network) || DropWeak(options, indexed, survey, network));
  adjusted.scatter = ScatterOf(network, adjusted.precision, 0, indexed.coded);
  adjusted.plain_scatter =
      ScatterOf(network, adjusted.precision, indexed.coded, network.points.size());
  for (NetworkObservation& observation : network.observations) {
    observation.sigma_px *=
        observation.point < indexed.coded ? adjusted.scatter : adjusted.plain_scatter;
  }
  (void)AdjustBundle(free, network);
  adjusted.precision = PrecisionOf(network, free.free, false);
  if (!adjusted.precision.determined) return adjusted;
  adjusted.scale = LayScale(input, adjusted.precision.points, indexed, survey);
  if (adjusted.scale.bars.empty() || !adjusted.scale.fault.empty()) return adjusted;
  const BundleOptions with_bars;
  (void)AdjustBundle(with_bars, network);
  adjusted.precision = PrecisionOf(network, with_bars.free, true);
  return adjusted;
}

// Joins pictures that the codes do not connect by plain targets, then searches these pictures
// again. Changes nothing if there are none.
void JoinByPlain(const SurveyInput& input, const SurveyOptions& options, IndexedSurvey& indexed,
                 Survey& survey, Adjusted& adjusted, PlainSearch& search, Random& random) {
  Network& network = indexed.network;
  const auto joined = JoinPictures(input, indexed.coded, network, random);
  if (joined.empty()) return;
  for (const std::size_t station : joined) {
    survey.stations[station].reason.clear();
    survey.stations[station].contradicts = false;
  }
  std::vector<std::optional<ImageEllipse>> discs = indexed.discs;
  discs.resize(network.observations.size());
  CorrectDiscs(discs, indexed.corrected, network);
  std::vector<std::size_t> moved;
  LeaveOutMovedPlain(search, indexed, moved);
  const double before = adjusted.scatter;
  adjusted = Adjust(input, options, indexed, survey);
  adjusted.scatter *= before;
  RemovePlainTargets(search, indexed);
  LayDatum(network);
  search = AddPlainTargets(input, PrecisionOf(network, kLensFree, true), adjusted.scatter, indexed);
}

// Adds plain targets to the network, and adjusts all of it together.
void AddPlain(const SurveyInput& input, const SurveyOptions& options, IndexedSurvey& indexed,
              Survey& survey, Adjusted& adjusted, Random& random) {
  Network& network = indexed.network;
  PlainSearch search = AddPlainTargets(input, adjusted.precision, adjusted.scatter, indexed);
  std::vector<std::size_t> moved;
  double variance_root = 0;
  if (network.points.size() > search.first_point) {
    JoinByPlain(input, options, indexed, survey, adjusted, search, random);
  }
  if (network.points.size() > search.first_point) {
    LeaveOutMovedPlain(search, indexed, moved);
    const double before = adjusted.scatter;
    adjusted = Adjust(input, options, indexed, survey);
    adjusted.scatter *= before;
    LayDatum(network);
    adjusted.precision = PrecisionOf(network, kLensFree, true);
    variance_root = search.noise * adjusted.plain_scatter;
  }
  survey.plain = SummarisePlain(input, search, moved, network);
  survey.plain.variance_root = survey.plain.targets > 0 ? variance_root : 0;
}

// Returns the reason to end a survey after the network's start, before any fine adjustment.
std::optional<std::string> FocalReason(const SurveyInput& input, const Network& network) {
  const auto step = FindFocalStep(network);
  if (!step) return std::nullopt;
  return fmt::format(
      "the focal length changed from {:.1f} to {:.1f} px before {}: zoom and focus must stay as "
      "they are; survey the pictures before and after as two, or photograph anew",
      step->before_px, step->after_px, input.pictures[step->first_after].name);
}

std::optional<std::string> StepReason(const SurveyInput& input, const IndexedSurvey& indexed,
                                      Random& random) {
  Network network = indexed.network;
  const double scatter = std::max(RobustScatter(network), kMinScatter);
  for (NetworkObservation& observation : network.observations) observation.sigma_px *= scatter;
  const auto step = FindShapeStep(network, random);
  if (!step) return std::nullopt;
  const double size = ScaleOf(network).value_or(0);
  return fmt::format(
      "the part changed its shape before {}: {} targets moved against the others, target {} "
      "most{}; survey the pictures before and after as two, or let nothing move and photograph "
      "anew",
      input.pictures[step->first_after].name, step->points, indexed.ids[step->most],
      size > 0 ? fmt::format(", by {:.2f} mm", size * step->by) : "");
}

std::optional<std::string> TooFew(const SurveyInput& input, const Network& network) {
  std::size_t with_targets = 0;
  for (const SurveyPicture& picture : input.pictures) {
    if (picture.observations.size() >= 4) ++with_targets;
  }
  constexpr std::size_t kMin = 6;
  if (with_targets >= kMin) return std::nullopt;
  return fmt::format(
      "{} of {} pictures show four coded targets or more ({} targets in all); {} are the least, "
      "some 50 make a good survey",
      with_targets, input.pictures.size(), network.points.size(), kMin);
}

// Explains why no two pictures were oriented.
std::string NoStart(const SurveyInput& input, const IndexedSurvey& indexed, Random& random) {
  if (input.focal_length_px) {
    SurveyInput without = input;
    without.focal_length_px.reset();
    Network network = IndexSurvey(without).network;
    if (StartNetwork(StartOptionsOf(without, indexed.longer_side_px), network, random)) {
      return fmt::format(
          "no two pictures fit one another with the focal length that is given, {:g} px; with one "
          "of {:.0f} px they do: it is wanted in px (mm over the sensor's pitch in mm); leave it "
          "out",
          *input.focal_length_px, network.lens[kFocal]);
    }
  }
  return "no two pictures share six targets seen from sides far enough apart: step some 20 "
         "degrees around the part from picture to picture, most targets in each";
}

}  // namespace

Result<Survey> SolveSurvey(const SurveyInput& input, const SurveyOptions& options) {
  TRY(CheckSurvey(input, options));
  Survey survey;
  if (const auto mixed = MixedPictures(input)) {
    return Ended(
        survey, Verdict::kRefused,
        *mixed + ": pictures of one camera, uncropped, are needed; survey the others apart");
  }
  TRY(CheckPlaces(input));
  IndexedSurvey indexed = IndexSurvey(input);
  Network& network = indexed.network;
  NoteInput(input, indexed, survey);
  if (const auto few = TooFew(input, network)) {
    return Ended(survey, Verdict::kCannotTell, *few);
  }
  Random random(options.seed);
  const NetworkStartOptions start = StartOptionsOf(input, indexed.longer_side_px);
  if (!StartNetwork(start, network, random)) {
    return Ended(survey, Verdict::kCannotTell, NoStart(input, indexed, random));
  }
  Settle(start, network, random);
  CorrectDiscs(indexed.discs, indexed.corrected, network);
  const auto other_focals = NoteUnplaced(input, network, indexed.longer_side_px, random, survey);
  if (const auto focal = FocalReason(input, network)) {
    return Ended(survey, Verdict::kRefused, *focal);
  }
  if (other_focals) return Ended(survey, Verdict::kRefused, *other_focals);
  if (const auto step = StepReason(input, indexed, random)) {
    return Ended(survey, Verdict::kCannotTell, *step);
  }
  NoteUnplacedTargets(indexed, survey);
  const std::set<std::size_t> moved = LeaveOutMoved(input, indexed.ids, survey, network);
  if (const auto apart = FallsApart(input, survey, network)) {
    return Ended(survey, Verdict::kCannotTell, *apart);
  }
  Adjusted adjusted = Adjust(input, options, indexed, survey);
  const auto ended = [&](Verdict verdict, const std::string& reason) {
    NoteOutliers(input, indexed, network, survey);
    survey.check = CheckOf(indexed, options, moved, adjusted.precision, survey);
    return Ended(survey, verdict, reason);
  };
  if (const auto apart = FallsApart(input, survey, network)) {
    return ended(Verdict::kCannotTell, *apart);
  }
  if (!adjusted.precision.determined) return ended(Verdict::kCannotTell, kUndetermined);
  if (adjusted.scale.bars.empty()) {
    return ended(Verdict::kCannotTell,
                 "no scale bar has both of its ends in the survey: the shape is known, no length "
                 "is; put bars of known length beside the part and name their ends");
  }
  if (!adjusted.scale.fault.empty()) return ended(Verdict::kRefused, adjusted.scale.fault);
  LayDatum(network);
  adjusted.precision = PrecisionOf(network, kLensFree, true);
  if (adjusted.scatter <= options.max_variance_root && HasPlainPoints(input)) {
    AddPlain(input, options, indexed, survey, adjusted, random);
    if (!adjusted.precision.determined) return ended(Verdict::kCannotTell, kUndetermined);
    if (!adjusted.scale.fault.empty()) return ended(Verdict::kRefused, adjusted.scale.fault);
  }
  DropNoticesOfGiven(indexed, survey);
  FillAnswer(input, indexed, adjusted.precision, survey);
  survey.variance_root = adjusted.scatter;
  survey.notices.insert(survey.notices.end(), adjusted.scale.notices.begin(),
                        adjusted.scale.notices.end());
  if (!adjusted.scale.unchecked.empty()) survey.unchecked.push_back(adjusted.scale.unchecked);
  if (adjusted.scatter > options.max_variance_root) {
    return ended(Verdict::kRefused,
                 fmt::format("the targets' centres scatter by {:.1f} times what is stated of them "
                             "(at most {:.1f}): a lens that moves (autofocus, stabiliser), a part "
                             "that bends, or stated uncertainties far too small",
                             adjusted.scatter, options.max_variance_root));
  }
  if (const auto weak = WeakLens(survey)) return ended(Verdict::kCannotTell, *weak);
  survey = ended(Verdict::kGood, {});
  if (survey.check.contradiction.empty()) return survey;
  return Ended(survey, Verdict::kCannotTell,
               survey.check.contradiction +
                   ": something moved, or codes were misread; let part, bars and targets be still "
                   "and photograph anew");
}

}  // namespace trammel::part_alignment
