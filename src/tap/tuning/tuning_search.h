// The settings under which taps are to be made, chosen together and each set tried.
#pragma once

#include <cstdint>
#include <optional>

#include "tap/tuning/tuning_trial.h"

namespace trammel::tap {

struct SearchOptions {
  double wanted_uncertainty_mm = 0.001;  ///< k = 1, of one tap.
  /// Scatter that no setting mends: an uncertainty far below it is no gain.
  double machine_scatter_mm = 0;
  // Of the recorded taps themselves.
  std::size_t recorded = 0;
  std::size_t recorded_good = 0;
  std::size_t recorded_shallow = 0;                                           ///< Of the good ones.
  double recorded_uncertainty_mm = std::numeric_limits<double>::quiet_NaN();  ///< Median.
  TapOptions analysis;
  std::uint64_t seed = 1;
};

enum class SearchEnd : std::uint8_t {
  kFound,            ///< `advised` is better.
  kPresentDoes,      ///< The present settings do what is wanted.
  kNothingBetter,    ///< They do not, but nothing that was tried is better.
  kMachineScatters,  ///< More precise taps are possible, but the machine scatters far more.
  kStaysShallow,     ///< They do, but for presses that are shallow; no force in reach mends that.
  kOnlyLessCertain,  ///< Too many taps fail; where they do not, they are less certain: `lesser`.
  kNothingWorks,     ///< Too many taps fail under each.
};

struct Search {
  SearchEnd end = SearchEnd::kNothingBetter;
  TrialSettings present;
  TrialOutcome present_outcome;  ///< Of no taps where one has too many samples.
  std::optional<TrialSettings> advised;
  std::optional<TrialOutcome> advised_outcome;
  std::optional<TrialSettings> lesser;  ///< With the wanted uncertainty, but more than the present.
  std::optional<TrialOutcome> lesser_outcome;
  /// Of all that were tried for long: the least uncertainty of one under which taps are good.
  double least_uncertainty_mm = std::numeric_limits<double>::quiet_NaN();
  std::size_t tried = 0;  ///< Sets of settings.
};

/// Tries press forces, pull-back distances and speeds together, those that cost the least time and
/// force first, until one set works and has the wanted uncertainty; without such a one, that of the
/// least uncertainty, if it is better by a fifth. Neither the stated uncertainty nor the error
/// itself may be larger than under the present settings in the same trial.
/// Cost: at most some 4 million samples drawn and analysed, whatever the taps are like.
[[nodiscard]] Search SearchSettings(const TrialWorld& world, const SearchOptions& options);

}  // namespace trammel::tap
