#include "tap/tuning/tuning_conclusion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tap/samples/motion.h"

namespace trammel::tap {
namespace {

constexpr double kUmPerMm = 1000;
/// Differences between recordings and trial that chance makes in less than one case of twenty: what
/// the trial does not know of may fail taps under other settings, too.
constexpr double kRare = 0.05;

/// The most frequent one.
Finding MainReason(std::span<const TuningTap> taps) {
  std::map<FindingCode, std::size_t> counts;
  Finding main;
  std::size_t most = 0;
  for (const TuningTap& tap : taps) {
    if (tap.analysis->verdict == Verdict::kGood) continue;
    const std::size_t count = ++counts[tap.analysis->reason.code];
    if (count > most) main = tap.analysis->reason;
    most = std::max(most, count);
  }
  return main;
}

/// Whether recorded taps fail far more often than those of the trial (Poisson).
bool FailUnexplained(const Tuning& tuning, const TrialOutcome& trial) {
  const std::size_t bad = tuning.recorded - tuning.recorded_good;
  const double share =
      (static_cast<double>(trial.taps - trial.good) + 0.5) / (static_cast<double>(trial.taps) + 1);
  const double expected = share * static_cast<double>(tuning.recorded);
  double term = std::exp(-expected);
  double fewer = 0;
  for (std::size_t i = 0; i < bad; ++i) {
    fewer += term;
    term *= expected / static_cast<double>(i + 1);
  }
  return bad > 0 && 1 - fewer < kRare;
}

/// Whether all recorded taps are good where many of the trial's fail.
bool SucceedUnexplained(const Tuning& tuning, const TrialOutcome& trial) {
  const double share =
      (static_cast<double>(trial.good) + 0.5) / (static_cast<double>(trial.taps) + 1);
  return tuning.recorded == tuning.recorded_good &&
         std::pow(share, static_cast<double>(tuning.recorded)) < kRare;
}

std::string TrialText(const TrialOutcome& trial) {
  std::string text = fmt::format("{} of {} taps of the trial are good", trial.good, trial.taps);
  if (trial.good > 0)
    text += fmt::format(", 95 %: within {:.2f} µm", trial.half_width_mm * kUmPerMm);
  return text;
}

/// How the present settings do: by their trial, or as recorded where there was none.
std::string PresentText(const TrialOutcome& trial, const Tuning& tuning) {
  if (trial.taps > 0) return TrialText(trial);
  return fmt::format("{} of {} recorded taps are good", tuning.recorded_good, tuning.recorded);
}

/// What to mend where taps fail under all settings that were tried.
std::string BeyondSettings(const TrialOutcome& present, const TapTraits& traits) {
  switch (present.MainReason()) {
    case FindingCode::kNoBreak:
    case FindingCode::kNoContact:
    case FindingCode::kVagueBreak:
    case FindingCode::kBreakAtEdge:
      return fmt::format(
          "The cell is too noisy ({:.1f} gf) or too slow ({:.0f} samples/s) for a press of {:.0f} "
          "gf on {:.0f} gf/mm: quieten it, or raise the trigger force and record again",
          traits.noise_g, traits.sample_rate_hz, traits.press_force_g, traits.stiffness_g_mm);
    case FindingCode::kBaselineForceInconsistent:
    case FindingCode::kDrift:
    case FindingCode::kLowTapQuality:
      return fmt::format(
          "The free nozzle's force is another after the press, or drifts ({:.1f} gf/s): look for "
          "what pulls at the head, and raise the trigger force",
          traits.drift_g_s);
    case FindingCode::kAdhesion:
    case FindingCode::kFouledNozzle:
    case FindingCode::kSlowCollision:
      return "Plastic on the nozzle: scrub it, and probe colder";
    case FindingCode::kNone:
      return "Raise the trigger force and record again";
    default:
      return fmt::format("What fails them is {} (docs/tap.md)", Name(present.MainReason()));
  }
}

/// What keeps taps from being more precise.
std::string LimitedBy(const TrialOutcome& trial, const Tuning& tuning) {
  constexpr double kMostly = 0.5;
  const double uncertainty =
      trial.good > 0 ? trial.uncertainty_mm : tuning.traits.claimed_uncertainty_mm;
  if (tuning.predicted_uncertainty_mm > kMostly * uncertainty) {
    return fmt::format(
        "{:.2f} gf of noise at {:.0f} gf/mm and {:.0f} samples/s leave no more to a "
        "press of {:.0f} gf: quieten the cell, or average several taps",
        tuning.traits.noise_g, tuning.traits.stiffness_g_mm, tuning.traits.sample_rate_hz,
        tuning.traits.press_force_g);
  }
  return "What is left is less the samples' noise than slow noise and the form of the press";
}

/// Why the present settings stay, or what is better; for a search that may be trusted.
std::string EndText(const Search& search, double wanted_mm, const Tuning& tuning) {
  const TrialOutcome& present = search.present_outcome;
  const std::string now = PresentText(present, tuning);
  switch (search.end) {
    case SearchEnd::kFound:
      return fmt::format("change what → marks. {} then; as it is, {}",
                         TrialText(*search.advised_outcome), now);
    case SearchEnd::kPresentDoes:
      return fmt::format(
          "keep the settings. A recorded tap has a standard uncertainty of {:.2f} µm "
          "where {:.2g} µm are wanted; {}",
          tuning.traits.claimed_uncertainty_mm * kUmPerMm, wanted_mm * kUmPerMm, now);
    case SearchEnd::kNothingBetter:
      return fmt::format(
          "keep the settings. {}; of {} others that were tried none is clearly "
          "better. {}",
          now, search.tried, LimitedBy(present, tuning));
    case SearchEnd::kMachineScatters:
      return fmt::format(
          "keep the settings. {}; the machine itself scatters by {:.2f} µm (standard "
          "deviation), which more precise taps would not mend",
          now, tuning.scatter.beyond_mm * kUmPerMm);
    case SearchEnd::kStaysShallow:
      return fmt::format(
          "keep the settings. {}, but {} of {} recorded presses are shallower than 20 "
          "µm. On {:.0f} gf/mm no force that was tried makes them deeper without loss",
          now, tuning.recorded_shallow, tuning.recorded_good, tuning.traits.stiffness_g_mm);
    case SearchEnd::kOnlyLessCertain:
      return fmt::format(
          "{}. No settings that were tried make 95 % good without loss of certainty. "
          "With a press of {:.0f} gf, pulled back {:.3g} mm at {:.2g} mm/s, {}",
          now, search.lesser->press_force_g, search.lesser->pull_back_mm,
          search.lesser->pull_back_speed_mm_s, TrialText(*search.lesser_outcome));
    case SearchEnd::kNothingWorks:
      break;
  }
  return fmt::format("{}, and none of {} other settings makes 95 % good. {}", now, search.tried,
                     BeyondSettings(present, tuning.traits));
}

}  // namespace

void Conclude(const Search& search, std::span<const TuningTap> taps, double wanted_mm,
              Tuning& tuning) {
  const TrialOutcome& present = search.present_outcome;
  tuning.tried = search.tried;
  if (present.taps > 0) {
    tuning.trial_present = present;
    if (FailUnexplained(tuning, present)) {
      tuning.because = fmt::format(
          "{} of {} recorded taps failed, of the trial's {} of {}: settings alone do not explain "
          "it. {}",
          tuning.recorded - tuning.recorded_good, tuning.recorded, present.taps - present.good,
          present.taps, Explain(MainReason(taps)));
      return;
    }
    if (SucceedUnexplained(tuning, present)) {
      tuning.because = fmt::format(
          "taps drawn from these recordings are not like them ({} of {} good in the trial, all of "
          "{} recorded), so that nothing could be promised",
          present.good, present.taps, tuning.recorded);
      return;
    }
  }
  tuning.because = EndText(search, wanted_mm, tuning);
  if (search.end == SearchEnd::kNothingWorks || search.end == SearchEnd::kOnlyLessCertain) return;
  tuning.end = search.end == SearchEnd::kFound ? TuningEnd::kChange : TuningEnd::kKeep;
  if (search.end == SearchEnd::kFound) tuning.trial_advised = search.advised_outcome;
}

std::string WhyTooFewAreGood(std::span<const TuningTap> taps) {
  constexpr double kLong_s = 3;
  constexpr double kFar_mm = 0.2;  // three presses of most printers
  if (taps.empty()) return "there are no taps";
  const Finding reason = MainReason(taps);
  const auto good = std::count_if(taps.begin(), taps.end(), [](const TuningTap& tap) {
    return tap.analysis->verdict == Verdict::kGood;
  });
  std::string text = good == 0 ? fmt::format("none of {} taps is good. ", taps.size())
                               : fmt::format(
                                     "only {} of {} taps {} good, which says too little of "
                                     "the others. ",
                                     good, taps.size(), good == 1 ? "is" : "are");
  text += Explain(reason);
  const auto bad = std::find_if(taps.begin(), taps.end(), [&](const TuningTap& tap) {
    return tap.analysis->verdict != Verdict::kGood && tap.analysis->reason.code == reason.code;
  });
  TapMotion motion;
  if (bad == taps.end() || FindMotion(bad->tap.moves, motion).code != FindingCode::kNone)
    return text;
  if (reason.code == FindingCode::kStillInContact) {
    const double way_mm = motion.end_z_mm - motion.halt_z_mm;
    text += fmt::format(" It is pulled back {:.3g} mm: record again with {:.2g} mm.", way_mm,
                        std::max(kFar_mm, 2 * way_mm));
  }
  const double lasts_s = motion.pull_back_end_s - motion.pull_back_start_s;
  if (lasts_s > kLong_s) {
    text += fmt::format(
        " The pull-back takes {:.1f} s, in which every drift counts: make it shorter "
        "or faster first.",
        lasts_s);
  }
  return text;
}

}  // namespace trammel::tap
