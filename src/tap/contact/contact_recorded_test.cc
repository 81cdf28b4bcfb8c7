// The recorded taps that others published: a check against reality, not an accuracy figure.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "tap/samples/finding.h"
#include "tap/samples/recorded_taps_test_support.h"

namespace trammel::tap {
namespace {

class ContactRecorded : public RecordedTaps {
 protected:
  [[nodiscard]] TapAnalysis Print(const std::string& name, Method method = Method::kContact) const {
    const TapAnalysis analysis = Analyse(name, method);
    std::printf("    %s, %s: %s, z = %.2f um, interval %.2f to %.2f um, noise %.1f gf\n",
                name.c_str(), std::string(ToString(method)).c_str(),
                std::string(ToString(analysis.verdict)).c_str(), 1e3 * analysis.contact_z_mm,
                1e3 * analysis.interval95_mm.lo, 1e3 * analysis.interval95_mm.hi, analysis.noise_g);
    if (analysis.verdict != Verdict::kGood) {
      std::printf("      %s\n", Explain(analysis.reason).c_str());
    }
    for (const Finding& notice : analysis.Notices()) {
      std::printf("      %s\n", Explain(notice).c_str());
    }
    return analysis;
  }

  // By eye: the last samples in contact, extrapolated to the baseline.
  void ExpectHolds(const std::string& name, double by_eye_um, double widest_um) const {
    const TapAnalysis analysis = Print(name);
    ASSERT_EQ(analysis.verdict, Verdict::kGood) << Explain(analysis.reason);
    EXPECT_LE(1e3 * analysis.interval95_mm.lo, by_eye_um);
    EXPECT_GE(1e3 * analysis.interval95_mm.hi, by_eye_um);
    EXPECT_LE(500 * (analysis.interval95_mm.hi - analysis.interval95_mm.lo), widest_um);
  }
};

TEST_F(ContactRecorded, IntervalsHoldTheBreakAsSeenByEye) {
  ExpectHolds("tap0", -5.3, 4);
  ExpectHolds("tap1", -4.1, 4);
  ExpectHolds("tap2", 1.0, 4);
}

TEST_F(ContactRecorded, TheTapThatItsAuthorsCodeRefusedIsRead) {
  ExpectHolds("tap_refused_by_author", -164, 8);
}

TEST_F(ContactRecorded, AGoodTapIsAcceptedAndAFouledOneRefused) {
  EXPECT_EQ(Print("digitised_good").verdict, Verdict::kGood);
  EXPECT_EQ(Print("digitised_fouled").verdict, Verdict::kRefused);
}

TEST_F(ContactRecorded, TapsWithPublishedResultsAreReported) {
  // The authors: 41.96 um, with the two-line method; and "a problematic instance".
  EXPECT_EQ(Print("workbench_tail640").verdict, Verdict::kGood);
  (void)Print("workbench_tail640", Method::kTwoLine);
  (void)Print("probe_110_common");
  (void)Print("probe_110_common", Method::kTwoLine);
}

}  // namespace
}  // namespace trammel::tap
