// What klipper-toolchanger's tool.py and toolchanger.py do, quirks and all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/klipper/machine.h"
#include "sim/klipper/status.h"

namespace trammel::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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

TEST_F(KlipperTools, AnOffsetThatIsSetIsToldAtOnceAndGoneAfterARestart) {
  EXPECT_EQ(Run("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=-0.125"), "");
  EXPECT_EQ(Tool()["gcode_x_offset"], -0.125);
  EXPECT_EQ(ObjectStatus(*klipper_, "tool T0")["gcode_x_offset"], 0.0);
  klipper_->Restart();
  klipper_->Advance(klipper_->now_s() + 10);
  EXPECT_EQ(Tool()["gcode_x_offset"], 0.25);
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

TEST_F(KlipperTools, ResetGoesBackToWhatWasSetBeforeTheSecondTime) {
  EXPECT_EQ(Run("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.3\n"
                "RESET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset"),
            "");
  EXPECT_EQ(Tool()["gcode_x_offset"], 0.3);  // the first value was never a parameter
  EXPECT_EQ(Run("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.4\n"
                "RESET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset"),
            "");
  EXPECT_EQ(Tool()["gcode_x_offset"], 0.3);
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

TEST_F(KlipperTools, EachHeatsItsOwnNozzle) {
  EXPECT_EQ(Run("M104 T1 S200"), "");
  EXPECT_EQ(ObjectStatus(*klipper_, "extruder1")["target"], 200.0);
  EXPECT_EQ(ObjectStatus(*klipper_, "extruder")["target"], 0.0);
  EXPECT_THAT(ObjectStatus(*klipper_, "heaters")["available_heaters"],
              testing::Contains("extruder1"));
  EXPECT_THAT(Run("M104 T7 S200"), HasSubstr("Extruder not configured"));
  EXPECT_EQ(Run("TURN_OFF_HEATERS"), "");
  EXPECT_EQ(ObjectStatus(*klipper_, "extruder1")["target"], 0.0);
}

TEST(KlipperWithoutTools, KnowsNeitherTheCommandsNorTheObjects) {
  const VirtualKlipper klipper(DefaultKlipperConfig(), {});
  EXPECT_TRUE(ObjectStatus(klipper, "toolchanger").empty());
  EXPECT_TRUE(ObjectStatus(klipper, "tool T1").empty());
}

}  // namespace
}  // namespace trammel::sim
