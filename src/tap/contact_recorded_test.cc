// The recorded taps that others published: a check against reality, not an accuracy figure.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tap/analyse.h"
#include "tap/finding.h"

namespace trammel::tap {
namespace {

/// Recordings with their provenance in SOURCES.md beside them; TRAMMEL_TEST_DATA names the folder.
class RecordedTap : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TRAMMEL_TEST_DATA");
    if (data == nullptr) {
      GTEST_SKIP() << "TRAMMEL_TEST_DATA is not set; it names the folder with tap/tap0.json";
    }
    folder_ = std::filesystem::path(data) / "tap";
  }

  [[nodiscard]] TapAnalysis Analyse(const std::string& name, Method method = Method::kContact) {
    nlohmann::json json;
    std::ifstream(folder_ / (name + ".json")) >> json;
    const std::vector<double> time_s = json.at("time");
    const std::vector<double> force_g = json.at("force");
    std::vector<Move> moves;
    for (const auto& move : json.at("moves")) {
      moves.push_back({move.at("print_time"), move.at("move_t"), move.at("start_v"),
                       move.at("accel"), move.at("start_z"), move.at("z_r")});
    }
    TapAnalyser analyser({.method = method});
    const TapAnalysis analysis = analyser.Analyse({time_s, force_g, moves});
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
  void ExpectHolds(const std::string& name, double by_eye_um, double widest_um) {
    const TapAnalysis analysis = Analyse(name);
    ASSERT_EQ(analysis.verdict, Verdict::kGood) << Explain(analysis.reason);
    EXPECT_LE(1e3 * analysis.interval95_mm.lo, by_eye_um);
    EXPECT_GE(1e3 * analysis.interval95_mm.hi, by_eye_um);
    EXPECT_LE(500 * (analysis.interval95_mm.hi - analysis.interval95_mm.lo), widest_um);
  }

 private:
  std::filesystem::path folder_;
};

TEST_F(RecordedTap, IntervalsHoldTheBreakAsSeenByEye) {
  ExpectHolds("tap0", -5.3, 4);
  ExpectHolds("tap1", -4.1, 4);
  ExpectHolds("tap2", 1.0, 4);
}

TEST_F(RecordedTap, TheTapThatItsAuthorsCodeRefusedIsRead) {
  ExpectHolds("tap_refused_by_author", -164, 8);
}

TEST_F(RecordedTap, AGoodTapIsAcceptedAndAFouledOneRefused) {
  EXPECT_EQ(Analyse("digitised_good").verdict, Verdict::kGood);
  EXPECT_EQ(Analyse("digitised_fouled").verdict, Verdict::kRefused);
}

TEST_F(RecordedTap, TapsWithPublishedResultsAreReported) {
  // The authors: 41.96 um, with the two-line method; and "a problematic instance".
  EXPECT_EQ(Analyse("workbench_tail640").verdict, Verdict::kGood);
  (void)Analyse("workbench_tail640", Method::kTwoLine);
  (void)Analyse("probe_110_common");
  (void)Analyse("probe_110_common", Method::kTwoLine);
}

}  // namespace
}  // namespace trammel::tap
