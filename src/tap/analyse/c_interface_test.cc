#include <gtest/gtest.h>
#include <trammel/tap.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "tap/analyse/analyse.h"
#include "tap/contact/press_test_support.h"
#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

struct Call {
  test::PressTap tap = test::MakePressTap({}, 1000);
  trammel_tap_options options{};
  trammel_tap_result result{};
  std::vector<std::byte> workspace;

  Call() {
    trammel_tap_default_options(&options, sizeof options);
    result.struct_size = sizeof result;
    workspace.resize(trammel_tap_workspace_bytes(tap.time_s.size()));
  }

  trammel_tap_status Run() {
    std::vector<trammel_tap_move> moves;
    for (const Move& m : tap.moves) {
      moves.push_back({m.start_time_s, m.duration_s, m.start_velocity_mm_s, m.acceleration_mm_s2,
                       m.start_z_mm, m.z_direction});
    }
    return trammel_tap_analyse(tap.time_s.data(), tap.force_g.data(), tap.time_s.size(),
                               moves.data(), moves.size(), &options, workspace.data(),
                               workspace.size(), &result);
  }
};

TEST(TapCInterface, SaysWhatTheLibrarySays) {
  Call call;
  ASSERT_EQ(call.Run(), TRAMMEL_TAP_OK);
  TapAnalyser analyser({});
  const TapAnalysis analysis = analyser.Analyse(call.tap.View());
  EXPECT_EQ(call.result.verdict, TRAMMEL_TAP_GOOD);
  EXPECT_EQ(call.result.contact_z_mm, analysis.contact_mm.value);
  EXPECT_EQ(call.result.interval95_lo_mm, analysis.contact_mm.interval95.lo);
  EXPECT_EQ(call.result.interval95_hi_mm, analysis.contact_mm.interval95.hi);
  EXPECT_EQ(call.result.point_count, static_cast<int>(analysis.point_count));
  EXPECT_EQ(call.result.struct_size, sizeof call.result);
}

TEST(TapCInterface, AnyAlignmentOfTheWorkspaceWillDo) {
  Call call;
  const std::size_t bytes = call.workspace.size();
  call.workspace.resize(bytes + 7);
  for (std::size_t shift = 0; shift < 8; ++shift) {
    trammel_tap_move move{};
    call.result.verdict = -1;
    ASSERT_EQ(
        trammel_tap_analyse(call.tap.time_s.data(), call.tap.force_g.data(), call.tap.time_s.size(),
                            &move, 0, nullptr, call.workspace.data() + shift, bytes, &call.result),
        TRAMMEL_TAP_OK);
    EXPECT_STREQ(trammel_tap_finding_name(call.result.reason.code), "missing_moves");
    EXPECT_TRUE(std::isnan(call.result.contact_z_mm));
  }
}

TEST(TapCInterface, BadArgumentsAreSaid) {
  Call call;
  call.workspace.resize(call.workspace.size() - 1);
  EXPECT_EQ(call.Run(), TRAMMEL_TAP_SMALL_WORKSPACE);
  Call method;
  method.options.method = 7;
  EXPECT_EQ(method.Run(), TRAMMEL_TAP_BAD_ARGUMENT);
  Call latency;
  for (const double latency_s : {-10.1, 10.1, HUGE_VAL, -HUGE_VAL}) {
    latency.options.latency_s = latency_s;
    EXPECT_EQ(latency.Run(), TRAMMEL_TAP_BAD_ARGUMENT) << latency_s;
  }
  Call unsized;
  unsized.result.struct_size = 0;
  EXPECT_EQ(unsized.Run(), TRAMMEL_TAP_BAD_ARGUMENT);
  EXPECT_EQ(
      trammel_tap_analyse(nullptr, nullptr, 5, nullptr, 0, nullptr, nullptr, 0, &unsized.result),
      TRAMMEL_TAP_BAD_ARGUMENT);
  EXPECT_EQ(trammel_tap_analyse(nullptr, nullptr, 0, nullptr, 0, nullptr, nullptr, 0, nullptr),
            TRAMMEL_TAP_BAD_ARGUMENT);
}

TEST(TapCInterface, SamplesDatedTooEarlyAreTakenBackByANegativeLatency) {
  Call call;
  call.options.latency_s = 0;
  ASSERT_EQ(call.Run(), TRAMMEL_TAP_OK);
  ASSERT_EQ(call.result.verdict, TRAMMEL_TAP_GOOD);
  for (const double early_s : {1e-3, 4.7e-3, 0.02}) {
    Call shifted;
    for (double& time_s : shifted.tap.time_s) {
      time_s -= early_s;
    }
    shifted.options.latency_s = -early_s;
    ASSERT_EQ(shifted.Run(), TRAMMEL_TAP_OK);
    ASSERT_EQ(shifted.result.verdict, TRAMMEL_TAP_GOOD) << early_s;
    EXPECT_NEAR(shifted.result.contact_z_mm, call.result.contact_z_mm, 1e-9) << early_s;
  }
}

TEST(TapCInterface, NothingIsWrittenBeyondWhatAnOlderCallerKnows) {
  Call call;
  call.result.struct_size = offsetof(trammel_tap_result, point_count);
  call.result.point_count = -77;
  call.options.struct_size = offsetof(trammel_tap_options, latency_s);
  call.options.latency_s = 1;  // not known to this caller
  ASSERT_EQ(call.Run(), TRAMMEL_TAP_OK);
  EXPECT_EQ(call.result.point_count, -77);
  EXPECT_NEAR(call.result.contact_z_mm, call.tap.contact_z_mm, 2e-3);
}

TEST(TapCInterface, NamesAndSentencesAreNeverNull) {
  EXPECT_EQ(trammel_tap_version(), TRAMMEL_TAP_VERSION);
  EXPECT_STREQ(trammel_tap_verdict_name(TRAMMEL_TAP_CANNOT_TELL), "cannot_tell");
  EXPECT_STREQ(trammel_tap_method_name(TRAMMEL_TAP_METHOD_TWO_LINE), "two-line");
  EXPECT_STREQ(trammel_tap_corner_name(TRAMMEL_TAP_BREAK), "break");
  EXPECT_STREQ(trammel_tap_status_name(TRAMMEL_TAP_OK), "ok");
  EXPECT_STREQ(trammel_tap_verdict_name(99), "");
  EXPECT_STREQ(trammel_tap_corner_name(-1), "");
  for (int code = 0; code < 256; ++code) {
    const trammel_tap_finding finding{code, 0, 1.5, 2.5};
    char text[16];
    const std::size_t whole = trammel_tap_explain(&finding, text, sizeof text);
    EXPECT_GT(whole, 0U);
    EXPECT_LT(std::strlen(text), sizeof text);
    EXPECT_EQ(std::string(text),
              Explain({static_cast<FindingCode>(code), 1.5, 2.5}).substr(0, sizeof text - 1));
  }
  EXPECT_EQ(trammel_tap_explain(nullptr, nullptr, 0), 0U);
}

}  // namespace
}  // namespace trammel::tap
