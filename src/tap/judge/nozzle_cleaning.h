// When a nozzle counts as clean: the rule by which a printer scrubs and taps again.
#pragma once

namespace trammel::tap {

struct CleaningRule {
  int clean_in_a_row = 3;  ///< Clean taps that end it; >= 1. What users of the tap probe ask for.
  int most_taps = 15;      ///< After which it is given up; >= clean_in_a_row.
  /// Clean taps in a row must agree within this, mm; > 0. Plastic on a nozzle shifts a tap by tens
  /// of um, a clean one repeats to 3 um.
  double agree_within_mm = 0.010;
};

/// What was seen of one tap.
struct CleaningTap {
  bool clean = false;  ///< Verdict good, quality not bad, no sign of plastic.
  double z_mm = 0;     ///< Counts where clean.
};

enum class CleaningStep {
  kTapAgain,          ///< So far clean: tap once more.
  kScrubAndTapAgain,  ///< Scrub the nozzle, then tap.
  kDone,              ///< The nozzle is clean.
  kGiveUp,            ///< Too many taps: somebody must look at it.
};

/// How far it has come. Start with a new one; it stays with its last word once that was kDone or
/// kGiveUp.
struct CleaningState {
  int taps = 0;
  int in_a_row = 0;
  double lowest_mm = 0;  ///< Of those in a row.
  double highest_mm = 0;
  CleaningStep last = CleaningStep::kTapAgain;
};

/// The next tap in, what to do out. A tap that is clean but does not agree with those before it
/// begins a new row.
[[nodiscard]] CleaningStep NextStep(CleaningState& state, const CleaningRule& rule,
                                    const CleaningTap& tap);

}  // namespace trammel::tap
