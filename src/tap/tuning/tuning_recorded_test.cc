// Advice from taps that printers made (shared data, not in the repository).
#include <gtest/gtest.h>

#include "tap/samples/recorded_taps_test_support.h"
#include "tap/tuning/tuning.h"
#include "tap/tuning/tuning_search.h"

namespace trammel::tap {
namespace {

class TuningRecorded : public RecordedTaps {
 protected:
  [[nodiscard]] Tuning TuneNamed(const std::vector<std::string>& names, std::uint64_t seed) const {
    std::vector<Recording> recordings;
    std::vector<TapAnalysis> analyses;
    for (const std::string& name : names) {
      recordings.push_back(Read(name));
      analyses.push_back(TapAnalyser({}).Analyse(recordings.back().View()));
    }
    std::vector<TuningTap> taps;
    for (std::size_t i = 0; i < names.size(); ++i) {
      taps.push_back({recordings[i].View(), &analyses[i]});
    }
    TuningOptions options;
    options.seed = seed;
    return Tune(taps, options);
  }
};

TEST_F(TuningRecorded, ItsAdviceHoldsInTrialsOfOtherSeeds) {
  const std::vector<std::string> sets[] = {{"tap0"},
                                           {"tap1"},
                                           {"tap2"},
                                           {"tap0", "tap1", "tap2"},
                                           {"tap_refused_by_author"},
                                           {"workbench_tail640"},
                                           {"digitised_good"}};
  for (const auto& names : sets) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Tuning tuning = TuneNamed(names, seed);
      ASSERT_NE(tuning.end, TuningEnd::kNone) << names[0] << ": " << tuning.because;
      ASSERT_TRUE(tuning.trial_present) << names[0];
      const TrialOutcome& present = *tuning.trial_present;
      const TrialOutcome& advised = tuning.trial_advised ? *tuning.trial_advised : present;
      EXPECT_GE(advised.GoodShare(), 0.95) << names[0];
      EXPECT_LE(advised.uncertainty_mm, present.uncertainty_mm) << names[0];
      // The trial's taps are like the recorded ones.
      constexpr double kAlike = 2.5;
      EXPECT_LT(present.uncertainty_mm, kAlike * tuning.traits.claimed_uncertainty_mm) << names[0];
      EXPECT_GT(present.uncertainty_mm, tuning.traits.claimed_uncertainty_mm / kAlike) << names[0];
    }
  }
}

TEST_F(TuningRecorded, AShallowPressIsToGetDeeper) {
  const Tuning tuning = TuneNamed({"tap_refused_by_author"}, 1);
  ASSERT_EQ(tuning.end, TuningEnd::kChange) << tuning.because;
  EXPECT_EQ(tuning.recorded_shallow, 1u);
  EXPECT_GT(tuning.advice.at(2).advised, 1.2 * tuning.advice.at(2).present);
  EXPECT_LE(tuning.trial_advised->shallow, 10u);
}

TEST_F(TuningRecorded, BadTapsGetNoAdviceButWhatIsToBeDone) {
  for (const char* name : {"probe_110_common", "digitised_fouled"}) {
    const Tuning tuning = TuneNamed({name}, 1);
    EXPECT_EQ(tuning.end, TuningEnd::kNone);
    EXPECT_GT(tuning.because.size(), 50u);
  }
}

}  // namespace
}  // namespace trammel::tap
