// Sets of settings that may be better than the present one, as far as can be said untried.
#pragma once

#include <vector>

#include "tap/tuning/tuning_trial.h"

namespace trammel::tap {

struct Candidate {
  TrialSettings settings;
  double cost = 0;  ///< By Cost.
};

/// As recorded: the median press force, and the moves.
[[nodiscard]] TrialSettings PresentSettings(const TrialWorld& world);

/// The depth at which half of the taps halt, where their median force is `force_g`.
[[nodiscard]] double MedianDepth(const TrialWorld& world, double force_g);

/// Of the break's uncertainty by noise alone, relative to that of other settings:
/// sqrt(h (9/L + 4/B)) / k, as in BreakUncertainty (tuning.h).
[[nodiscard]] double NoiseFactor(const TrialWorld& world, const TrialSettings& settings);

/// Time of the pull-back, times the press force where that is raised, each change a tenth more.
[[nodiscard]] double Cost(const TrialSettings& settings, const TrialSettings& present);

/// Press forces, pull-back distances and speeds together, by rising cost. Forces are the present
/// one and more, up to 300 gf and three times the recorded depth; distances three and four presses;
/// speeds such that noise alone leaves `target` of the present uncertainty, and some around it,
/// with at least 24 samples in the press and a ramp of at most a tenth of it.
/// @param target   > 0; above 1 where taps may get less certain.
/// @param shallow  Whether presses have to get deeper than 20 um.
[[nodiscard]] std::vector<Candidate> Candidates(const TrialWorld& world,
                                                const TrialSettings& present, double target,
                                                bool shallow);

}  // namespace trammel::tap
