#include "sim/spindle/mill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace trammel::sim {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr double kBegin_s = 100;

struct Mill {
  explicit Mill(const MillOptions& options = {}) : mill(options) {}
  json Ask(json request, double now_s) {
    request["id"] = ++asked;
    json answer = json::parse(mill.Answer(request.dump(), now_s));
    EXPECT_EQ(answer["id"], asked);
    return answer;
  }
  json Mdi(const std::string& block, double now_s) {
    return Ask({{"do", "mdi"}, {"block", block}, {"move", true}}, now_s);
  }
  VirtualMill mill;
  int asked = 0;
};

struct Ready : Mill {
  explicit Ready(const MillOptions& options = {}) : Mill(options) {
    EXPECT_FALSE(Ask({{"do", "take"}}, kBegin_s).contains("error"));
  }
};

TEST(VirtualMill, MovesAtTheSpeedThatIsAskedForAndTellsWhereItIs) {
  Ready ready;
  const json begin = ready.Ask({{"do", "look"}}, kBegin_s);
  EXPECT_EQ(begin["position"], json({600, 400, 520, 0}));
  EXPECT_EQ(begin["mode"], "MDI");
  (void)ready.Mdi("G21 G90 G94 G53 G1 X660 Y480 Z520 F6000", kBegin_s);
  const MillPlace half = ready.mill.At(kBegin_s + 0.5);  // 100 mm at 100 mm/s
  EXPECT_TRUE(half.moving);
  EXPECT_NEAR(half.stated_mm[0], 630, 1e-9);
  const json look = ready.Ask({{"do", "look"}}, kBegin_s + 0.5);
  EXPECT_EQ(look["idle"], false);
  EXPECT_EQ(look["commanded"][1], 480);
  const MillPlace there = ready.mill.At(kBegin_s + 1);
  EXPECT_FALSE(there.moving);
  EXPECT_EQ(there.stated_mm, (Triple{660, 480, 520}));
  EXPECT_EQ(there.approach, half.approach);
  (void)ready.Mdi("G21 G90 G94 G53 G1 C90 F5400", kBegin_s + 2);
  EXPECT_NEAR(ready.mill.At(kBegin_s + 2.5).c_deg, 45, 1e-9);
  EXPECT_EQ(ready.mill.At(kBegin_s + 2.5).turn, 1U);
}

TEST(VirtualMill, AnAbortAndTheEndOfItsClientStopItWhereItIs) {
  for (const bool leave : {false, true}) {
    Ready ready;
    (void)ready.Mdi("G53 G1 X700 F6000", kBegin_s);
    if (leave) {
      ready.mill.Leave(kBegin_s + 0.25);
    } else {
      (void)ready.Ask({{"do", "abort"}}, kBegin_s + 0.25);
    }
    const MillPlace stopped = ready.mill.At(kBegin_s + 5);
    EXPECT_FALSE(stopped.moving);
    EXPECT_NEAR(stopped.stated_mm[0], 625, 1e-9);
    EXPECT_EQ(ready.Ask({{"do", "look"}}, kBegin_s + 5)["mode"], leave ? "MANUAL" : "MDI");
  }
}

TEST(VirtualMill, RefusesWhatItsControllerWould) {
  MillOptions options;
  options.faults.refused_at_move = 2;
  Ready ready(options);
  (void)ready.Mdi("G53 G1 X1300 F6000", kBegin_s);  // beyond its limits
  (void)ready.Mdi("G53 G1 X601 F6000", kBegin_s);
  EXPECT_EQ(ready.mill.At(kBegin_s + 9).stated_mm[0], 600);
  Mill other;
  EXPECT_THAT(other.Mdi("G53 G1 X601 F6000", kBegin_s)["error"].get<std::string>(),
              HasSubstr("MDI mode was not taken"));
  EXPECT_TRUE(other.Ask({{"do", "nonsense"}}, kBegin_s).contains("error"));
  EXPECT_TRUE(json::parse(other.mill.Answer("nonsense", kBegin_s)).contains("error"));
}

TEST(VirtualMill, AnEmergencyStopHaltsItHalfWayAndTakesItsPower) {
  MillOptions options;
  options.faults.estop_at_move = 1;
  Ready ready(options);
  (void)ready.Mdi("G53 G1 X700 F6000", kBegin_s);
  EXPECT_TRUE(ready.mill.At(kBegin_s + 0.25).moving);
  EXPECT_FALSE(ready.mill.At(kBegin_s + 0.75).moving);
  EXPECT_EQ(ready.Ask({{"do", "look"}}, kBegin_s + 0.75)["kind"], "taken");
  EXPECT_NEAR(ready.mill.At(kBegin_s + 9).stated_mm[0], 650, 1e-9);
  ready.mill.Leave(kBegin_s + 9);
  EXPECT_EQ(ready.Ask({{"do", "state"}}, kBegin_s + 9)["estop"], true);
}

}  // namespace
}  // namespace trammel::sim
