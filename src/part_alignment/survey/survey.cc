#include "part_alignment/survey/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/random.h"
#include "part_alignment/survey/bundle.h"
#include "part_alignment/survey/network_precision.h"
#include "part_alignment/survey/network_start.h"
#include "part_alignment/survey/snooping.h"
#include "part_alignment/survey/survey_answer.h"
#include "part_alignment/survey/survey_discs.h"
#include "part_alignment/survey/survey_input.h"
#include "part_alignment/survey/survey_join.h"
#include "part_alignment/survey/survey_plain.h"

namespace trammel::part_alignment {
namespace {

constexpr double kLossWidth = 3;    // sigmas, of Cauchy's loss
constexpr double kGrossSigma = 30;  // beyond it an observation is wrong before any test of it
constexpr double kBarLimit = 3.29;  // sigmas: 0.1 %
constexpr double kLeastScatter =
    0.2;  // stated sigmas may be too large by that, no more is believed

Survey Ended(Survey survey, Verdict verdict, std::string reason) {
  survey.verdict = verdict;
  survey.reason = std::move(reason);
  return survey;
}

NetworkStartOptions StartOptionsOf(const SurveyInput& input, int side_px) {
  NetworkStartOptions options;
  options.longer_side_px = side_px;
  if (input.lens) return options;
  if (input.focal_length_px) {
    options.focal_guesses_px = {*input.focal_length_px};
  } else {
    for (const double share : {0.7, 0.95, 1.3, 0.55, 1.8, 2.5}) {
      options.focal_guesses_px.push_back(share * side_px);
    }
  }
  return options;
}

FreeLens FreeLensOf(const SurveyInput& input) { return input.lens ? kLensFixed : kLensFree; }

// Brings the network to rest with Cauchy's loss, all observations that are not gross taking part.
void Settle(const NetworkStartOptions& start, const FreeLens& free, Network& network,
            Random& random) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    BundleOptions options;
    options.free = free;
    options.bars = false;
    options.loss_sigma = kLossWidth * std::max(RobustScatter(network), kLeastScatter);
    (void)AdjustBundle(options, network);
    const double gross = kGrossSigma * std::max(RobustScatter(network), kLeastScatter);
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

// Leaves out stations and points that too little holds. True if there were any.
bool DropWeak(const SurveyOptions& options, const IndexedSurvey& indexed, Survey& survey,
              Network& network) {
  bool dropped = false;
  const auto support = SupportOf(network);
  for (std::size_t p = 0; p < network.points.size(); ++p) {
    if (!network.points[p].placed) continue;
    const PointSupport& of = support[p];
    if (of.observations >= options.least_observations &&
        of.widest_angle_rad >= options.least_angle_rad) {
      continue;
    }
    network.points[p].placed = false;
    dropped = true;
    if (p >= indexed.coded) continue;
    survey.notices.push_back(fmt::format(
        "target {} is not given: {} observations, at most {:.0f} degrees apart; {} and {:.0f} are "
        "needed: photograph it from more sides",
        indexed.ids[p], of.observations, Degrees(of.widest_angle_rad), options.least_observations,
        Degrees(options.least_angle_rad)));
  }
  constexpr int kLeastOfStation = 4;  // 8 equations for 6 numbers
  std::vector<int> of_station(network.stations.size());
  for (const NetworkObservation& observation : network.observations) {
    if (TakesPart(network, observation)) ++of_station[observation.station];
  }
  for (std::size_t s = 0; s < network.stations.size(); ++s) {
    if (!network.stations[s].placed || of_station[s] >= kLeastOfStation) continue;
    network.stations[s].placed = false;
    survey.stations[s].reason =
        fmt::format("agrees with the others in {} of its targets only", of_station[s]);
    dropped = true;
  }
  return dropped;
}

void LeaveOutMoved(const SurveyInput& input, const std::vector<std::string>& ids, Survey& survey,
                   Network& network) {
  const double size = ScaleOf(network).value_or(0);
  for (const MovedPoint& moved : FindMovedPoints(network)) {
    network.points[moved.point].placed = false;
    survey.notices.push_back(fmt::format(
        "target {} moved{} before {}, against all others: it is left out{}", ids[moved.point],
        size > 0 ? fmt::format(" by {:.2f} mm", size * moved.by) : std::string(),
        input.pictures[moved.first_after].name,
        size > 0 ? "" : "; by how much, no scale bar tells"));
  }
}

struct Adjusted {
  NetworkPrecision precision;
  double scatter = 1;        // of coded targets' centres
  double plain_scatter = 1;  // of plain ones'
};

// What the observations of points from one to another scatter by, in their sigmas.
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
  return std::max(std::sqrt(squares / std::max(redundancy, 1.0)), kLeastScatter);
}

// Least squares with data snooping; the observations' sigmas then are what they scatter by.
Adjusted Adjust(const BundleOptions& bundle, const SurveyOptions& options,
                const IndexedSurvey& indexed, Survey& survey, Network& network) {
  Adjusted adjusted;
  (void)DropWeak(options, indexed, survey, network);
  do {
    adjusted.precision = SnoopObservations(bundle, options.false_alarm, network);
  } while (DropWeak(options, indexed, survey, network));
  adjusted.scatter = ScatterOf(network, adjusted.precision, 0, indexed.coded);
  adjusted.plain_scatter =
      ScatterOf(network, adjusted.precision, indexed.coded, network.points.size());
  for (NetworkObservation& observation : network.observations) {
    observation.sigma_px *=
        observation.point < indexed.coded ? adjusted.scatter : adjusted.plain_scatter;
  }
  (void)AdjustBundle(bundle, network);
  adjusted.precision = PrecisionOf(network, bundle.free, bundle.bars);
  return adjusted;
}

// The bar that contradicts the others most, if any does.
std::optional<std::size_t> ContradictingBar(const NetworkPrecision& precision) {
  std::optional<std::size_t> worst;
  for (std::size_t b = 0; b < precision.bars.size(); ++b) {
    const double test = std::abs(precision.bars[b].test);
    if (test > kBarLimit && (!worst || test > std::abs(precision.bars[*worst].test))) worst = b;
  }
  return worst;
}

std::size_t UsedBars(const Network& network) {
  return static_cast<std::size_t>(
      std::count_if(network.bars.begin(), network.bars.end(),
                    [&](const NetworkBar& bar) { return TakesPart(network, bar); }));
}

std::string BarName(const ScaleBar& bar) { return fmt::format("{}-{}", bar.from, bar.to); }

// Adjusts with the bars, leaving out one that contradicts two others or more. The reason where the
// bars cannot all be right and none is the odd one out.
std::optional<std::string> AdjustWithBars(const SurveyInput& input, const SurveyOptions& options,
                                          const IndexedSurvey& indexed, Survey& survey,
                                          Network& network, Adjusted& adjusted) {
  BundleOptions bundle;
  bundle.free = FreeLensOf(input);
  const std::vector<NetworkObservation> as_stated = network.observations;
  while (true) {
    for (std::size_t i = 0; i < as_stated.size(); ++i) {
      network.observations[i].sigma_px = as_stated[i].sigma_px;
    }
    adjusted = Adjust(bundle, options, indexed, survey, network);
    NoteBars(input, indexed, adjusted.precision, network, survey);
    const auto worst = ContradictingBar(adjusted.precision);
    if (!worst) return std::nullopt;
    const ScaleBar& bar = input.bars[indexed.bar_of[*worst]];
    const auto& check = adjusted.precision.bars[*worst];
    if (UsedBars(network) < 3) {
      std::string names;
      for (std::size_t b = 0; b < network.bars.size(); ++b) {
        if (TakesPart(network, network.bars[b]))
          names += (names.empty() ? "" : " and ") + BarName(input.bars[indexed.bar_of[b]]);
      }
      return fmt::format(
          "the scale bars {} contradict one another by {:.3f} mm, {:.1f} times what their "
          "uncertainty and the pictures let expect: check their lengths and ends, or add a third",
          names, std::abs(check.misfit / check.redundancy), std::abs(check.test));
    }
    network.bars[*worst].used = false;
    survey.notices.push_back(fmt::format(
        "the scale bar {} is {:.3f} mm {} than the others say ({:.1f} sigmas): it is left out",
        BarName(bar), std::abs(check.misfit / check.redundancy),
        check.misfit < 0 ? "longer" : "shorter", std::abs(check.test)));
  }
}

// Plain targets join the network, and all of it is adjusted together.
Adjusted AdjustWithPlain(const SurveyInput& input, const SurveyOptions& options,
                         const PlainSearch& search, IndexedSurvey& indexed, Survey& survey,
                         std::vector<std::size_t>& moved) {
  LeaveOutMovedPlain(search, indexed, moved);
  BundleOptions bundle;
  bundle.free = FreeLensOf(input);
  return Adjust(bundle, options, indexed, survey, indexed.network);
}

// Pictures that the codes do not connect join by plain targets; what these show is searched anew.
// Without any nothing is changed.
void JoinByPlain(const SurveyInput& input, const SurveyOptions& options, IndexedSurvey& indexed,
                 Survey& survey, Adjusted& adjusted, PlainSearch& search, Random& random) {
  Network& network = indexed.network;
  const auto joined = JoinPictures(input, indexed.coded, network, random);
  if (joined.empty()) return;
  for (const std::size_t station : joined) survey.stations[station].reason.clear();
  std::vector<std::optional<ImageEllipse>> discs = indexed.discs;
  discs.resize(network.observations.size());
  CorrectDiscs(discs, indexed.corrected, network);
  std::vector<std::size_t> moved;
  const double before = adjusted.scatter;
  adjusted = AdjustWithPlain(input, options, search, indexed, survey, moved);
  adjusted.scatter *= before;
  RemovePlainTargets(search, indexed);
  LayDatum(network);
  search = AddPlainTargets(input, PrecisionOf(network, FreeLensOf(input), true), adjusted.scatter,
                           indexed);
}

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
    const double before = adjusted.scatter;
    adjusted = AdjustWithPlain(input, options, search, indexed, survey, moved);
    adjusted.scatter *= before;
    NoteBars(input, indexed, adjusted.precision, network, survey);
    LayDatum(network);
    adjusted.precision = PrecisionOf(network, FreeLensOf(input), true);
    variance_root = search.noise * adjusted.plain_scatter;
  }
  survey.plain = SummarisePlain(input, search, moved, network);
  survey.plain.variance_root = survey.plain.targets > 0 ? variance_root : 0;
}

// What ends a survey once its network stands, before any fine adjustment.
std::optional<std::string> FocalReason(const SurveyInput& input, const Network& network) {
  const auto step = FindFocalStep(network);
  if (!step) return std::nullopt;
  return fmt::format(
      "the focal length changed from {:.1f} to {:.1f} px before {}: zoom and focus must stay as "
      "they are; survey the pictures before and after as two, or photograph anew",
      step->before_px, step->after_px, input.pictures[step->first_after].name);
}

std::optional<std::string> TooFew(const SurveyInput& input, const Network& network) {
  std::size_t with_targets = 0;
  for (const SurveyPicture& picture : input.pictures) {
    if (picture.observations.size() >= 4) ++with_targets;
  }
  const std::size_t least = input.lens ? 3 : 6;
  if (with_targets >= least) return std::nullopt;
  return fmt::format(
      "{} of {} pictures show four coded targets or more ({} targets in all); {} are the least{}, "
      "some 50 make a good survey",
      with_targets, input.pictures.size(), network.points.size(), least,
      input.lens ? "" : " where the lens is not given");
}

// Why no two pictures were oriented.
std::string NoStart(const SurveyInput& input, const IndexedSurvey& indexed, Random& random) {
  if (input.focal_length_px && !input.lens) {
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
  if (auto checked = CheckSurvey(input, options); !checked) return tl::unexpected(checked.error());
  Survey survey;
  if (const auto mixed = MixedPictures(input)) {
    return Ended(
        survey, Verdict::kRefused,
        *mixed + ": pictures of one camera, uncropped, are needed; survey the others apart");
  }
  if (auto places = CheckPlaces(input); !places) return tl::unexpected(places.error());
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
  Settle(start, FreeLensOf(input), network, random);
  CorrectDiscs(indexed.discs, indexed.corrected, network);
  const auto other_focals = NoteUnplaced(input, network, indexed.longer_side_px, random, survey);
  if (const auto focal = FocalReason(input, network)) {
    return Ended(survey, Verdict::kRefused, *focal);
  }
  if (other_focals) return Ended(survey, Verdict::kRefused, *other_focals);
  NoteUnplacedTargets(indexed, survey);
  LeaveOutMoved(input, indexed.ids, survey, network);
  if (const auto apart = FallsApart(input, survey, network)) {
    return Ended(survey, Verdict::kCannotTell, *apart);
  }
  const auto scale = ScaleOf(network);
  if (scale) {
    Transform(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), *scale, network);
  } else {
    NoteOutliers(input, indexed, network, survey);
    return Ended(survey, Verdict::kCannotTell,
                 "no scale bar has both of its ends in the survey: the shape is known, no length "
                 "is; put bars of known length beside the part and name their ends");
  }
  Adjusted adjusted;
  if (const auto bars = AdjustWithBars(input, options, indexed, survey, network, adjusted)) {
    return Ended(survey, Verdict::kRefused, *bars);
  }
  if (const auto apart = FallsApart(input, survey, network)) {
    NoteOutliers(input, indexed, network, survey);
    return Ended(survey, Verdict::kCannotTell, *apart);
  }
  LayDatum(network);
  adjusted.precision = PrecisionOf(network, FreeLensOf(input), true);
  if (adjusted.precision.determined && adjusted.scatter <= options.most_variance_root &&
      HasPlainPoints(input)) {
    AddPlain(input, options, indexed, survey, adjusted, random);
  }
  NoteOutliers(input, indexed, network, survey);
  if (!adjusted.precision.determined) {
    return Ended(survey, Verdict::kCannotTell,
                 "the pictures do not determine where all of this is: the targets lie along one "
                 "line, or the pictures are all from one place; take them from all around");
  }
  DropNoticesOfGiven(indexed, survey);
  FillAnswer(input, indexed, adjusted.precision, survey);
  survey.variance_root = adjusted.scatter;
  if (adjusted.scatter > options.most_variance_root) {
    return Ended(survey, Verdict::kRefused,
                 fmt::format("the targets' centres scatter by {:.1f} times what is stated of them "
                             "(at most {:.1f}): a lens that moves (autofocus, stabiliser), a part "
                             "that bends, or stated uncertainties far too small",
                             adjusted.scatter, options.most_variance_root));
  }
  if (const auto weak = WeakLens(survey)) return Ended(survey, Verdict::kCannotTell, *weak);
  survey.verdict = Verdict::kGood;
  return survey;
}

}  // namespace trammel::part_alignment
