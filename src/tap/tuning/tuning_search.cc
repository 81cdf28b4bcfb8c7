#include "tap/tuning/tuning_search.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tap/tuning/tuning_candidates.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kTrialTaps = 200;
constexpr std::size_t kLeastTrialTaps = 60;  // all of which must be good to show 95 %
constexpr std::size_t kQuickTaps = 24;
constexpr double kQuickShare = 0.9;
constexpr double kMostTrialSamples = 4e6;
constexpr double kSamplesPerTrial = 1.2e6;
constexpr double kEnough = 0.95;
constexpr double kMostShallow = 0.05;

/// Margins between what a trial shows and what is asked: two medians of 200 differ by some 5 %.
constexpr double kAim = 0.85;
constexpr double kNotWorse = 0.97;
/// Errors below this part of what is wanted are none.
constexpr double kNegligible = 0.1;
constexpr double kWorthwhile = 0.8;
constexpr double kWorthwhileTime = 0.6;

double Share(std::size_t part, std::size_t of) {
  return of > 0 ? static_cast<double>(part) / static_cast<double>(of) : 0;
}

struct Limits {
  double noise = std::numeric_limits<double>::infinity();  // of the present one's
  double uncertainty_mm = std::numeric_limits<double>::infinity();
  double error_mm = std::numeric_limits<double>::infinity();
  double cost = std::numeric_limits<double>::infinity();
  double shallow = kMostShallow;  // of the good taps
};

bool Within(const TrialOutcome& outcome, const Limits& limits, double slack) {
  return Share(outcome.shallow, outcome.good) <= limits.shallow &&
         outcome.uncertainty_mm <= slack * limits.uncertainty_mm &&
         outcome.error_mm <= slack * limits.error_mm;
}

/// The present settings: by what was recorded as far as that tells, else by their trial.
struct Present {
  bool works = false;
  bool shallow = false;
  bool precise = false;
  double uncertainty_mm = 0;
  Limits limits;  // what they leave to be asked of others
};

Present Judge(const TrialOutcome& trial, const SearchOptions& options) {
  constexpr std::size_t kTellShare = 20;  // recorded taps
  const bool tried = trial.taps > 0;
  const bool recorded_work = Share(options.recorded_good, options.recorded) >= kEnough;
  Present present;
  present.shallow = Share(options.recorded_shallow, options.recorded_good) > kMostShallow;
  present.works =
      !present.shallow && (trial.GoodShare() >= kEnough ||
                           (recorded_work && (!tried || options.recorded >= kTellShare)));
  present.uncertainty_mm = trial.good > 0 ? trial.uncertainty_mm : options.recorded_uncertainty_mm;
  // A trial's taps are like the recorded ones, not the same; those are what a user has.
  present.precise =
      present.works && std::min(present.uncertainty_mm, options.recorded_uncertainty_mm) <=
                           options.wanted_uncertainty_mm;
  // Where many fail, those that do not are the lucky ones: the recorded of them count, too.
  if (!present.works && options.recorded_uncertainty_mm < present.uncertainty_mm) {
    present.uncertainty_mm = options.recorded_uncertainty_mm;
  }
  const double margin = present.works ? kNotWorse : 1;
  present.limits.noise = 1;
  present.limits.uncertainty_mm = margin * present.uncertainty_mm;
  if (trial.good > 0) {
    present.limits.error_mm =
        std::max(margin * trial.error_mm, kNegligible * options.wanted_uncertainty_mm);
  }
  if (!present.shallow) {
    present.limits.shallow = std::max(kMostShallow, Share(trial.shallow, trial.good));
  }
  return present;
}

class Trials {
 public:
  Trials(const TrialWorld& world, const SearchOptions& options)
      : world_(world), options_(options) {}

  [[nodiscard]] TrialOutcome Run(const TrialSettings& settings, std::size_t taps) {
    samples_ += Samples(settings, taps);
    return RunTrial(world_, settings, options_.analysis, taps, options_.seed);
  }
  [[nodiscard]] bool MayRun(const TrialSettings& settings, std::size_t taps) const {
    return samples_ + Samples(settings, taps) <= kMostTrialSamples;
  }

 private:
  // Hum takes as long to fit as all the rest.
  [[nodiscard]] double Samples(const TrialSettings& settings, std::size_t taps) const {
    const double each = SamplesOfTap(world_, settings) * (world_.noise.sines.empty() ? 1 : 2);
    return each * static_cast<double>(taps);
  }

  const TrialWorld& world_;
  const SearchOptions& options_;
  double samples_ = 0;
};

/// As many as a trial may have.
std::size_t TrialTaps(const TrialWorld& world, const TrialSettings& settings) {
  return static_cast<std::size_t>(std::clamp(kSamplesPerTrial / SamplesOfTap(world, settings), 0.0,
                                             static_cast<double>(kTrialTaps)));
}

/// Tries candidates in their order: a quick trial first, a long one for those that pass it.
void Try(const TrialWorld& world, const std::vector<Candidate>& candidates, const Limits& limits,
         double wanted_mm, Trials& trials, Search& search) {
  constexpr double kSlack = 1.1;  // of a quick trial's figures
  // What noise alone makes too uncertain need not be tried.
  const double most_noise = limits.noise * NoiseFactor(world, search.present);
  for (const Candidate& candidate : candidates) {
    const std::size_t taps = TrialTaps(world, candidate.settings);
    if (candidate.cost > limits.cost || taps < kLeastTrialTaps ||
        !trials.MayRun(candidate.settings, kQuickTaps + taps)) {
      continue;
    }
    if (NoiseFactor(world, candidate.settings) > most_noise) continue;
    ++search.tried;
    const TrialOutcome quick = trials.Run(candidate.settings, kQuickTaps);
    const double least = std::isnan(search.least_uncertainty_mm) ? limits.uncertainty_mm
                                                                 : search.least_uncertainty_mm;
    if (quick.GoodShare() < kQuickShare || !Within(quick, limits, kSlack) ||
        quick.uncertainty_mm > kSlack * std::max(wanted_mm, least)) {
      continue;
    }
    const TrialOutcome outcome = trials.Run(candidate.settings, taps);
    if (outcome.ShownShare() < kEnough || !Within(outcome, limits, 1)) continue;
    if (!(outcome.uncertainty_mm >= search.least_uncertainty_mm)) {
      search.least_uncertainty_mm = outcome.uncertainty_mm;
      search.advised = candidate.settings;
      search.advised_outcome = outcome;
    }
    if (outcome.uncertainty_mm <= wanted_mm) {
      search.advised = candidate.settings;
      search.advised_outcome = outcome;
      return;
    }
  }
}

bool IsWorthwhile(const Search& search, const Present& present, const SearchOptions& options) {
  const double advised = search.advised_outcome->uncertainty_mm;
  const double machine = options.machine_scatter_mm;
  return std::hypot(advised, machine) <= kWorthwhile * std::hypot(present.uncertainty_mm, machine);
}

/// Settings that work and are less certain than the present ones where those do.
void FindLesser(const TrialWorld& world, const Present& present, const SearchOptions& options,
                Trials& trials, Search& search) {
  const double wanted = options.wanted_uncertainty_mm;
  if (!(present.uncertainty_mm < wanted)) return;
  Limits limits;
  limits.uncertainty_mm = wanted;
  limits.noise = wanted / present.uncertainty_mm;
  const double target = kAim * wanted / present.uncertainty_mm;
  Try(world, Candidates(world, search.present, target, false), limits, wanted, trials, search);
  search.lesser = std::exchange(search.advised, std::nullopt);
  search.lesser_outcome = std::exchange(search.advised_outcome, std::nullopt);
}

SearchEnd EndOf(const Search& search, const Present& present, const SearchOptions& options) {
  if (search.advised) {
    if (!present.works || present.precise || IsWorthwhile(search, present, options)) {
      return SearchEnd::kFound;
    }
    if (search.advised_outcome->uncertainty_mm <= kWorthwhile * present.uncertainty_mm) {
      return SearchEnd::kMachineScatters;
    }
  }
  if (present.precise) return SearchEnd::kPresentDoes;
  if (present.works) return SearchEnd::kNothingBetter;
  if (search.lesser) return SearchEnd::kOnlyLessCertain;
  return present.shallow && search.present_outcome.GoodShare() >= kEnough
             ? SearchEnd::kStaysShallow
             : SearchEnd::kNothingWorks;
}

}  // namespace

Search SearchSettings(const TrialWorld& world, const SearchOptions& options) {
  Search search;
  Trials trials(world, options);
  search.present = PresentSettings(world);
  if (const std::size_t taps = TrialTaps(world, search.present); taps >= kLeastTrialTaps) {
    search.present_outcome = trials.Run(search.present, taps);
  }
  Present present = Judge(search.present_outcome, options);
  double wanted = options.wanted_uncertainty_mm;
  if (present.precise) {
    // Precise taps may be made faster, but not with less precision.
    wanted = present.limits.uncertainty_mm;
    present.limits.cost = kWorthwhileTime * Cost(search.present, search.present);
  } else if (present.works) {
    wanted = std::min(wanted, kWorthwhile * present.uncertainty_mm);
  }
  const double target = std::min(1.0, kAim * wanted / present.uncertainty_mm);
  Try(world, Candidates(world, search.present, target, present.shallow), present.limits, wanted,
      trials, search);
  if (!search.advised && !present.works && !present.shallow) {
    FindLesser(world, present, options, trials, search);
  }
  search.end = EndOf(search, present, options);
  if (search.end != SearchEnd::kFound) search.advised.reset();
  return search;
}

}  // namespace trammel::tap
