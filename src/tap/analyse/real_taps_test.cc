// The checks and the published method on taps that printers made (shared data, not in the
// repository).
#include <gtest/gtest.h>

#include "tap/samples/finding.h"
#include "tap/samples/recorded_taps_test_support.h"

namespace trammel::tap {
namespace {

using RealTaps = RecordedTaps;

constexpr Method kMethods[] = {Method::kContact, Method::kTwoLine};

TEST_F(RealTaps, SoundOnesAreAnsweredByBothMethods) {
  for (const char* name :
       {"tap0", "tap1", "tap2", "tap_refused_by_author", "workbench_tail640", "digitised_good"}) {
    for (const Method method : kMethods) {
      const TapAnalysis result = Analyse(name, method);
      EXPECT_EQ(result.verdict, Verdict::kGood)
          << name << ", " << ToString(method) << ": " << Explain(result.reason);
      EXPECT_GT(result.quality, 70) << name;
    }
  }
}

TEST_F(RealTaps, AFouledNozzleThatPassedItsAuthorsChecksIsRefused) {
  for (const Method method : kMethods) {
    const TapAnalysis result = Analyse("digitised_fouled", method);
    EXPECT_EQ(result.verdict, Verdict::kRefused);
    EXPECT_EQ(Name(result.reason.code), "fouled_nozzle");
    EXPECT_EQ(result.quality, 0);
  }
}

TEST_F(RealTaps, APullBackThatEndsInContactIsRefusedAsThat) {
  for (const Method method : kMethods) {
    EXPECT_EQ(Name(Analyse("probe_110_common", method).reason.code), "still_in_contact");
  }
}

TEST_F(RealTaps, TwoLineComesNearItsAuthorsResults) {
  // The author's tools of those days found elbows with Kneedle and did not split the decompression;
  // where the press is curved the two differ by what the split moves.
  const struct {
    const char* name;
    double published_um;
    double split_moves_um;
  } taps[] = {
      {"workbench_tail640", 41.96, 1}, {"tap0", -1.52, 1}, {"tap1", 0.95, 4}, {"tap2", 1.97, 2}};
  for (const auto& tap : taps) {
    EXPECT_NEAR(Analyse(tap.name, Method::kTwoLine).contact_z_mm * 1e3, tap.published_um,
                tap.split_moves_um)
        << tap.name;
  }
}

}  // namespace
}  // namespace trammel::tap
