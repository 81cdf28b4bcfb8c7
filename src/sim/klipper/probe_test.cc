// Behaviour of klipper-toolchanger's tool.py and toolchanger.py, with all quirks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "sim/klipper/machine.h"
#include "sim/klipper/status.h"

namespace trammel::sim {

namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kSurfaceMm = 0.0123;
constexpr double kTiltX = 1e-4;

KlipperConfig ConfigWithCell() {
  KlipperConfig config = DefaultKlipperConfig();
  config.load_cell.emplace();
  config.load_cell->surface_z_mm = kSurfaceMm;
  config.load_cell->tilt_x = kTiltX;
  return config;
}

KlipperConfig ConfigWithPullBack() {
  KlipperConfig config = ConfigWithCell();
  config.load_cell->pulls_back = true;
  return config;
}

// A homed machine above its bed, with a clock in the test's hand.
struct Bench {
  explicit Bench(const KlipperConfig& config = ConfigWithCell()) : klipper(config, {}) {
    (void)Run("G28");
    (void)Run("G1 X100 Y50 Z5 F6000");
  }

  // Runs a script to its end; its error, or nothing.
  std::optional<std::string> Run(const std::string& script) {
    constexpr double kLongestS = 600;
    responses.clear();
    const std::uint64_t id = klipper.RunScript(script);
    for (const double until_s = klipper.now_s() + kLongestS; klipper.now_s() < until_s;) {
      klipper.Advance(klipper.now_s() + 0.0501);
      for (const KlipperEvent& event : klipper.TakeEvents()) {
        if (event.kind == KlipperEvent::Kind::kResponse) responses.push_back(event.text);
        if (event.kind == KlipperEvent::Kind::kScriptDone && event.script == id) return event.error;
      }
    }
    return "it never ended";
  }

  VirtualKlipper klipper;
  std::vector<std::string> responses;
};

TEST(Probe, HaltsOnTheBedAndLeavesTheRiseToOthersAsKlipperDoes) {
  Bench bench;
  ASSERT_EQ(bench.Run("PROBE"), std::nullopt);
  const auto& taps = bench.klipper.history().taps;
  ASSERT_EQ(taps.size(), 1u);
  EXPECT_EQ(bench.klipper.commanded_mm[2], taps[0].reported_z_mm) << "the nozzle is pressed on";
  EXPECT_FALSE(taps[0].truth.has_value());
  ASSERT_FALSE(taps[0].force_g.empty());
  EXPECT_GT(taps[0].force_g.back(), 75);
  // The descent, and the marker where the head stands.
  ASSERT_EQ(taps[0].moves.size(), 3u);
  EXPECT_EQ(taps[0].moves[2].duration_s, 0);
  ASSERT_EQ(bench.Run("G91\nG1 Z0.2 F18\nG90\nM400"), std::nullopt);
  ASSERT_TRUE(taps[0].truth.has_value());
  EXPECT_NEAR(taps[0].truth->contact_z_mm, taps[0].surface_z_mm, 1e-9);
}

TEST(Probe, TapsTheBedAndTellsWhereItStoppedAsAForkDoes) {
  Bench bench(ConfigWithPullBack());
  ASSERT_EQ(bench.Run("PROBE"), std::nullopt);
  ASSERT_EQ(bench.klipper.history().taps.size(), 1u);
  const ProbedTap& tap = bench.klipper.history().taps[0];
  EXPECT_NEAR(tap.surface_z_mm, kSurfaceMm + 100 * kTiltX, 1e-12);
  EXPECT_THAT(bench.responses,
              ElementsAre(StartsWith("// probe: at 100.000,50.000 bed will contact at z="),
                          StartsWith("// Result: at 100.000,50.000 estimate contact at z=")));
  EXPECT_LT(tap.reported_z_mm, tap.surface_z_mm - 0.02);
  EXPECT_GT(tap.reported_z_mm, tap.surface_z_mm - 0.08);
  EXPECT_EQ(ObjectStatus(bench.klipper, "probe")["last_z_result"], tap.reported_z_mm);
  // It rests where the pull-back ended, and G-code goes on from there.
  EXPECT_NEAR(bench.klipper.commanded_mm[2], tap.reported_z_mm + 0.1, 1e-12);
  EXPECT_EQ(bench.klipper.gcode.last_mm, bench.klipper.commanded_mm);
  ASSERT_TRUE(tap.truth.has_value());
  EXPECT_NEAR(tap.truth->contact_z_mm, tap.surface_z_mm, 1e-9);
}

TEST(Probe, SamplesAreThePressAtTheTimesOfTheMoves) {
  KlipperConfig config = ConfigWithPullBack();
  config.load_cell->cell.disturbance.noise_g = 0;
  Bench bench(config);
  ASSERT_EQ(bench.Run("PROBE"), std::nullopt);
  const ProbedTap& tap = bench.klipper.history().taps[0];
  ASSERT_EQ(tap.moves.size(), 6u);
  ASSERT_EQ(tap.time_s.size(), tap.force_g.size());
  // Times are told to a microsecond, in which the approach presses by 7e-3 gf; half a count.
  constexpr double kAlikeG = 0.007 + 0.005;
  double highest_g = 0;
  for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
    const double depth_mm = tap.surface_z_mm - StateAt(tap.moves, tap.time_s[i]).z_mm;
    EXPECT_NEAR(tap.force_g[i], 3500 * std::max(0.0, depth_mm), kAlikeG);
    highest_g = std::max(highest_g, tap.force_g[i]);
  }
  EXPECT_GT(highest_g, 75);
  EXPECT_LT(tap.time_s.front(), tap.truth->touch_time_s - 0.1);
  EXPECT_GT(tap.time_s.back(), tap.moves.back().start_time_s + 0.3);
}

TEST(Probe, TheQueueTellsTheMovesOfTheTap) {
  Bench bench(ConfigWithPullBack());
  ASSERT_EQ(bench.Run("PROBE"), std::nullopt);
  const ProbedTap& tap = bench.klipper.history().taps[0];
  std::vector<TrapqEntry> entries;
  for (const PlannedMove& planned : bench.klipper.motion().decided()) {
    if (planned.timed.start_s < tap.moves[0].start_time_s - 1e-9) continue;
    for (const TrapqEntry& entry : ToolheadTrapq(planned)) entries.push_back(entry);
  }
  ASSERT_EQ(entries.size(), tap.moves.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    EXPECT_NEAR(entries[i].time_s, tap.moves[i].start_time_s, 1e-9);
    EXPECT_NEAR(entries[i].duration_s, tap.moves[i].duration_s, 1e-9);
    EXPECT_NEAR(entries[i].start_velocity, tap.moves[i].start_velocity_mm_s, 1e-9);
    EXPECT_NEAR(entries[i].acceleration, tap.moves[i].acceleration_mm_s2, 1e-9);
    EXPECT_NEAR(entries[i].start[2], tap.moves[i].start_z_mm, 1e-9);
    EXPECT_EQ(entries[i].direction[2], tap.moves[i].z_direction);
  }
}

TEST(Probe, WhatCannotBeProbedIsSaidInKlippersWords) {
  Bench bench;
  EXPECT_EQ(bench.Run("PROBE SAMPLES=0"),
            "Error on 'PROBE SAMPLES=0': SAMPLES must have minimum of "
            "1.0");
  (void)bench.Run("G1 Z0.0225");
  (void)bench.Run("PROBE");
  (void)bench.Run("G1 Z-0.2 F60");
  EXPECT_EQ(bench.Run("PROBE"), "Probe triggered prior to movement");
  EXPECT_EQ(bench.Run("M84\nPROBE"), "Must home before probe");
  KlipperConfig config = ConfigWithCell();
  config.load_cell->surface_z_mm = -20;
  Bench without_bed(config);
  EXPECT_EQ(without_bed.Run("PROBE PROBE_SPEED=10"), "No trigger on probe after full movement");
  EXPECT_DOUBLE_EQ(without_bed.klipper.commanded_mm[2], -5);
  Bench without_cell(DefaultKlipperConfig());
  ASSERT_EQ(without_cell.Run("PROBE"), std::nullopt);
  EXPECT_THAT(without_cell.responses, ElementsAre("// Unknown command:\"PROBE\""));
  EXPECT_TRUE(ObjectStatus(without_cell.klipper, "load_cell_probe").empty());
}

TEST(TapMacros, KeepWhatTheyAreToldAndFailWithoutAContact) {
  KlipperConfig config = ConfigWithCell();
  AddTapMacros(config);
  Bench bench(config);
  ASSERT_EQ(bench.Run("_TRAMMEL_TAP SAMPLES=2"), std::nullopt);
  const auto& taps = bench.klipper.history().taps;
  ASSERT_EQ(taps.size(), 1u) << "an answer is about one tap";
  ASSERT_TRUE(taps[0].truth.has_value()) << "the macro rises";
  EXPECT_NEAR(bench.klipper.commanded_mm[2], taps[0].reported_z_mm + 2.2, 1e-9) << "and lifts";
  EXPECT_TRUE(bench.klipper.gcode.absolute);
  ASSERT_EQ(bench.Run("TRAMMEL_TAP_RESULT VERDICT=good Z=0.01 U=0.001"), std::nullopt);
  EXPECT_EQ(bench.klipper.kept["TRAMMEL_TAP_RESULT"]["Z"], "0.01");
  EXPECT_EQ(bench.Run("TRAMMEL_TAP_RESULT VERDICT=refused REASON=no_break"),
            "trammel: no contact, refused: no_break");
  EXPECT_FALSE(bench.klipper.kept["TRAMMEL_TAP_RESULT"].contains("Z")) << "nothing of before";
}

class KlipperTools : public testing::Test {
 protected:
  KlipperTools() { klipper_ = Make({}); }

  static std::unique_ptr<VirtualKlipper> Make(const KlipperFaults& faults) {
    KlipperConfig config = DefaultKlipperConfig();
    config.tools = {{1, "tool T1", {0.25, -0.5, 0}}, {0, "tool T0", {}}};
    auto klipper = std::make_unique<VirtualKlipper>(config, faults);
    klipper->Advance(0.1);
    return klipper;
  }
  // The error of a script; empty where it had none.
  std::string Run(const std::string& script) {
    const std::uint64_t id = klipper_->RunScript(script);
    std::string error = "no answer";
    for (int i = 0; i < 100; ++i) {
      for (const KlipperEvent& event : klipper_->TakeEvents()) {
        if (event.kind == KlipperEvent::Kind::kScriptDone && event.script == id) {
          return event.error.value_or("");
        }
      }
      klipper_->Advance(klipper_->now_s() + 0.01);
    }
    return error;
  }
  [[nodiscard]] nlohmann::json Tool() const { return ObjectStatus(*klipper_, "tool T1"); }

  std::unique_ptr<VirtualKlipper> klipper_;
};

TEST_F(KlipperTools, TellTheirOffsetsAndTheirNumbers) {
  EXPECT_EQ(Tool()["gcode_x_offset"], 0.25);
  EXPECT_EQ(Tool()["gcode_y_offset"], -0.5);
  EXPECT_EQ(Tool()["tool_number"], 1);
  const nlohmann::json changer = ObjectStatus(*klipper_, "toolchanger");
  EXPECT_THAT(changer["tool_numbers"], ElementsAre(0, 1));
  EXPECT_THAT(changer["tool_names"], ElementsAre("tool T0", "tool T1"));
  const auto names = ObjectNames(*klipper_);
  EXPECT_THAT(names, testing::IsSupersetOf({"toolchanger", "tool T0", "tool T1"}));
}

TEST_F(KlipperTools, SaveToolParameterWaitsForSaveConfig) {
  EXPECT_THAT(Run("SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset"),
              HasSubstr("Tool does not have parameter gcode_x_offset"));
  EXPECT_EQ(Run("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.3\n"
                "SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset"),
            "");
  EXPECT_EQ(ObjectStatus(*klipper_, "configfile")["save_config_pending"], true);
  EXPECT_EQ(Run("SAVE_CONFIG"), "");
  klipper_->Advance(klipper_->now_s() + 10);
  EXPECT_EQ(klipper_->state(), KlippyState::kReady);
  EXPECT_EQ(Tool()["gcode_x_offset"], 0.3);
  EXPECT_EQ(Tool()["gcode_y_offset"], -0.5);
  EXPECT_EQ(ObjectStatus(*klipper_, "configfile")["save_config_pending"], false);
}

TEST_F(KlipperTools, ASectionInAnIncludedFileCannotBeSaved) {
  KlipperFaults faults;
  faults.included_tools = true;
  klipper_ = Make(faults);
  EXPECT_EQ(Run("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.3\n"
                "SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset"),
            "");
  EXPECT_THAT(Run("SAVE_CONFIG"), HasSubstr("'tool T1' option 'gcode_x_offset' conflicts with"));
}

TEST_F(KlipperTools, WrongToolsAndWrongValuesAreToldAsTheRealOneTellsThem) {
  EXPECT_THAT(Run("SET_TOOL_PARAMETER T=7 PARAMETER=gcode_x_offset VALUE=0"),
              HasSubstr("T7 not found"));
  EXPECT_THAT(Run("SET_TOOL_PARAMETER PARAMETER=gcode_x_offset VALUE=0"),
              HasSubstr("no active tool"));
  EXPECT_THAT(Run("SET_TOOL_PARAMETER T=1 VALUE=0"), HasSubstr("missing PARAMETER"));
  // Python's own errors stop Klipper.
  EXPECT_THAT(Run("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=abc"),
              HasSubstr("Internal error on command"));
  EXPECT_EQ(klipper_->state(), KlippyState::kShutdown);
}

TEST_F(KlipperTools, ATMovesTheActiveExtruderAndTheOffsetOfGcode) {
  EXPECT_THAT(Run("T1"), HasSubstr("axis not homed"));
  klipper_->homed = {true, true, true};
  EXPECT_EQ(Run("T1"), "");
  EXPECT_EQ(ObjectStatus(*klipper_, "toolchanger")["tool_number"], 1);
  EXPECT_EQ(ObjectStatus(*klipper_, "toolhead")["extruder"], "extruder1");
  EXPECT_EQ(ObjectStatus(*klipper_, "gcode_move")["homing_origin"][0], 0.25);
  EXPECT_EQ(Run("SELECT_TOOL T=0"), "");
  EXPECT_EQ(ObjectStatus(*klipper_, "toolhead")["extruder"], "extruder");
  EXPECT_EQ(ObjectStatus(*klipper_, "gcode_move")["homing_origin"][0], 0.0);
}

}  // namespace

}  // namespace trammel::sim
