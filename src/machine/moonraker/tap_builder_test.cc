// Taps from streams of forces and moves.
#include "machine/moonraker/tap_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "machine/moonraker/tap_stream_test_support.h"

namespace trammel::machine {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(TapBuilder, CutsATapOutOfForcesAndMoves) {
  TapBuilder builder;
  builder.AddMoves(TapMoves());
  std::vector<json> taps;
  for (const json& batch : Forces(95, 104)) {
    builder.AddForces(batch);
    for (json& tap : builder.Take()) taps.push_back(std::move(tap));
  }
  ASSERT_THAT(taps, SizeIs(1));
  const json& tap = taps[0];
  EXPECT_EQ(tap["time"].size(), tap["force"].size());
  EXPECT_NEAR(tap["time"].front().get<double>(), 100, 1 / kRate_hz);
  EXPECT_NEAR(tap["time"].back().get<double>(), kRise_s + kRiseTime_s + 0.25, 1 / kRate_hz);
  ASSERT_EQ(tap["moves"].size(), 6u) << "the lift is no part of it";
  EXPECT_EQ(tap["moves"][0]["z_r"], -1);
  EXPECT_EQ(tap["moves"][3]["accel"], 300);
  EXPECT_EQ(tap["moves"][0]["start_x"], 10);
}

TEST(TapBuilder, WaitsForForcesAndForMovesThatComeLate) {
  TapBuilder builder;
  for (const json& batch : Forces(95, 104)) builder.AddForces(batch);
  EXPECT_THAT(builder.Take(), IsEmpty());
  builder.AddMoves(TapMoves());
  EXPECT_THAT(builder.Take(), SizeIs(1));
  EXPECT_THAT(builder.Take(), IsEmpty()) << "each tap once";

  TapBuilder early;
  early.AddMoves(TapMoves());
  for (const json& batch : Forces(95, kRise_s + 0.3)) early.AddForces(batch);
  EXPECT_THAT(early.Take(), IsEmpty());
}

TEST(TapBuilder, FindsEveryTapOfARowOnce) {
  TapBuilder builder;
  std::size_t taps = 0;
  for (int i = 0; i < 5; ++i) {
    builder.AddMoves(TapMoves(5.0 * i));
    for (const json& batch : Forces(100 + 5.0 * i, 105 + 5.0 * i)) {
      builder.AddForces(batch);
      taps += builder.Take().size();
    }
  }
  EXPECT_EQ(taps, 5u);
}

TEST(TapBuilder, BatchesThatComeTwiceMakeOneTapWithEverySampleAndMoveOnce) {
  TapBuilder builder;
  builder.AddMoves(TapMoves());
  builder.AddMoves(TapMoves());  // the history again, behind itself
  std::vector<json> taps;
  for (const json& batch : Forces(95, 104)) {
    builder.AddForces(batch);
    builder.AddForces(batch);
    for (json& tap : builder.Take()) taps.push_back(std::move(tap));
  }
  builder.AddMoves(TapMoves());
  for (json& tap : builder.Take()) taps.push_back(std::move(tap));
  ASSERT_THAT(taps, SizeIs(1));
  EXPECT_THAT(taps[0]["moves"], SizeIs(6));
  const auto time_s = taps[0]["time"].get<std::vector<double>>();
  EXPECT_TRUE(std::adjacent_find(time_s.begin(), time_s.end(), std::greater_equal<>()) ==
              time_s.end());
}

TEST(TapBuilder, AMoveThatIsToldAgainShorterReplacesItsFirstVersion) {
  TapBuilder builder;
  json planned = TapMoves();
  planned["data"][1] = Move(100.01, 2.5, 2, 0, 2.09, -1);  // as if nothing had stopped it
  planned["data"].erase(planned["data"].begin() + 2, planned["data"].end());
  builder.AddMoves(planned);
  builder.AddMoves(TapMoves());
  for (const json& batch : Forces(95, 104)) builder.AddForces(batch);
  const auto taps = builder.Take();
  ASSERT_THAT(taps, SizeIs(1));
  ASSERT_THAT(taps[0]["moves"], SizeIs(6));
  EXPECT_EQ(taps[0]["moves"][1]["move_t"], 0.99);
}

TEST(TapBuilder, APrinterWhoseClockBeganAnewIsFollowedWithoutAWord) {
  TapBuilder builder;
  for (const json& batch : Forces(5000, 5001)) builder.AddForces(batch);
  builder.AddForces({{"data", {{1e300, 0.0}, {-1e300, 0.0}}}});
  for (const json& batch : Forces(95, 104)) builder.AddForces(batch);
  builder.AddMoves(TapMoves());
  EXPECT_THAT(builder.Take(), SizeIs(1));
}

TEST(TapBuilder, LeavesOutTapsFromBeforeTheForcesBegan) {
  TapBuilder builder;
  builder.AddMoves(TapMoves());
  for (const json& batch : Forces(kRise_s + 0.1, 104)) builder.AddForces(batch);
  EXPECT_THAT(builder.Take(), IsEmpty());
  builder.AddMoves(TapMoves(5));
  for (const json& batch : Forces(104, 109)) builder.AddForces(batch);
  EXPECT_THAT(builder.Take(), SizeIs(1));
}

TEST(TapBuilder, TakesLiftsAndTravelForNoTap) {
  TapBuilder builder;
  builder.AddMoves({{"data",
                     {Move(100, 1, 5, 0, 10, -1), Move(101.2, 2, 5, 0, 5, 1),  // 10 mm up
                      json::array({103.5, 1.0, 100.0, 0.0, {0, 0, 15}, {1, 0, 0}}),
                      Move(105, 0.2, 5, 0, 15, 1),  // up, but not after a descent
                      Move(106, 1, 2, 0, 2, -1), Move(107.2, 0.4, 5, 0, 0, 1)}}});  // homing's 2 mm
  for (const json& batch : Forces(99, 110)) builder.AddForces(batch);
  EXPECT_THAT(builder.Take(), IsEmpty());
}

TEST(TapBuilder, NonsenseIsSkipped) {
  TapBuilder builder;
  for (const json& batch :
       {json(), json(3), json::array(), json{{"data", 1}}, json{{"data", {1, "a", nullptr}}},
        json{{"data", {{1}, {"x", 2}, {nullptr, nullptr}, json::array()}}},
        json{{"data", {{1, 2, 3, 4, {1, 2}, {3}}}}}}) {
    builder.AddForces(batch);
    builder.AddMoves(batch);
  }
  EXPECT_THAT(builder.Take(), IsEmpty());
  json many = json::array();
  for (int i = 0; i < 500'000; ++i) many.push_back({static_cast<double>(i % 7), 1.0});
  builder.AddForces({{"data", many}});
  EXPECT_THAT(builder.Take(), IsEmpty());
}

}  // namespace
}  // namespace trammel::machine
