// Both methods on taps that printers made and others published (shared data, not in the
// repository): a check against reality, not an accuracy figure.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tap/analyse/analyse.h"
#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

constexpr Method kMethods[] = {Method::kContact, Method::kTwoLine};

/// Recordings with their provenance in SOURCES.md beside them; TRAMMEL_TEST_DATA names the folder.
class RealTaps : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TRAMMEL_TEST_DATA");
    if (data == nullptr) {
      GTEST_SKIP() << "TRAMMEL_TEST_DATA is not set; it names the folder with tap/tap0.json";
    }
    folder_ = std::filesystem::path(data) / "tap";
  }

  /// @param name  "tap0" for tap/tap0.json.
  [[nodiscard]] TapAnalysis Analyse(const std::string& name, Method method) const {
    nlohmann::json json;
    std::ifstream(folder_ / (name + ".json")) >> json;
    const auto time_s = json.at("time").get<std::vector<double>>();
    const auto force_g = json.at("force").get<std::vector<double>>();
    std::vector<Move> moves;
    for (const auto& move : json.at("moves")) {
      moves.push_back({move.at("print_time"), move.at("move_t"), move.at("start_v"),
                       move.at("accel"), move.at("start_z"), move.at("z_r")});
    }
    return TapAnalyser({.method = method}).Analyse({time_s, force_g, moves});
  }

 private:
  std::filesystem::path folder_;
};

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

TEST_F(RealTaps, IntervalsHoldTheBreakAsSeenByEye) {
  // The last samples in contact, extrapolated to the baseline.
  const struct {
    const char* name;
    double by_eye_um;
    double widest_um;
  } taps[] = {
      {"tap0", -5.3, 4}, {"tap1", -4.1, 4}, {"tap2", 1.0, 4}, {"tap_refused_by_author", -164, 8}};
  for (const auto& tap : taps) {
    const Interval interval = Analyse(tap.name, Method::kContact).contact_mm.interval95;
    EXPECT_LE(1e3 * interval.lo, tap.by_eye_um) << tap.name;
    EXPECT_GE(1e3 * interval.hi, tap.by_eye_um) << tap.name;
    EXPECT_LE(500 * (interval.hi - interval.lo), tap.widest_um) << tap.name;
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
  // The author's tools of those days found other elbows and did not split the decompression; where
  // the press is curved the two differ by what the split moves.
  const struct {
    const char* name;
    double published_um;
    double split_moves_um;
  } taps[] = {
      {"workbench_tail640", 41.96, 1}, {"tap0", -1.52, 1}, {"tap1", 0.95, 4}, {"tap2", 1.97, 2}};
  for (const auto& tap : taps) {
    EXPECT_NEAR(Analyse(tap.name, Method::kTwoLine).contact_mm.value * 1e3, tap.published_um,
                tap.split_moves_um)
        << tap.name;
  }
}

}  // namespace
}  // namespace trammel::tap
