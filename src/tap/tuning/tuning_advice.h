// The lines of advice: what each setting is and should be, and why.
#pragma once

#include <vector>

#include "tap/tuning/tuning.h"
#include "tap/tuning/tuning_search.h"

namespace trammel::tap {

struct AdviceFigures {
  double wanted_uncertainty_mm = 0;
  double machine_scatter_mm = 0;
  double uncertainty_mm = 0;  ///< Of one tap under the settings that are advised, k = 1.
};

/// Pull-back distance and speed, press force, drift filter, taps per point; in this order.
[[nodiscard]] std::vector<Advice> AdviceLines(const TrialWorld& world, const TapTraits& traits,
                                              const TrialSettings& present,
                                              const TrialSettings& advised,
                                              const AdviceFigures& figures);

}  // namespace trammel::tap
