#include "tap/judge/nozzle_cleaning.h"

#include <algorithm>

namespace trammel::tap {
namespace {

CleaningStep Judge(CleaningState& state, const CleaningRule& rule, const CleaningTap& tap) {
  if (!tap.clean) {
    state.in_a_row = 0;
  } else {
    const double lowest = std::min(state.lowest_mm, tap.z_mm);
    const double highest = std::max(state.highest_mm, tap.z_mm);
    if (state.in_a_row > 0 && highest - lowest <= rule.agree_within_mm) {
      ++state.in_a_row;
      state.lowest_mm = lowest;
      state.highest_mm = highest;
    } else {
      state.in_a_row = 1;
      state.lowest_mm = state.highest_mm = tap.z_mm;
    }
  }
  if (state.in_a_row >= rule.clean_in_a_row) return CleaningStep::kDone;
  if (state.taps >= rule.most_taps) return CleaningStep::kGiveUp;
  return tap.clean ? CleaningStep::kTapAgain : CleaningStep::kScrubAndTapAgain;
}

}  // namespace

CleaningStep NextStep(CleaningState& state, const CleaningRule& rule, const CleaningTap& tap) {
  if (state.last == CleaningStep::kDone || state.last == CleaningStep::kGiveUp) return state.last;
  ++state.taps;
  state.last = Judge(state, rule, tap);
  return state.last;
}

}  // namespace trammel::tap
