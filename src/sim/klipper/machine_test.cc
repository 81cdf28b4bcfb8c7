#include "sim/klipper/machine.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/klipper/status.h"

namespace trammel::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A machine with a clock in the test's hand.
struct Bench {
  explicit Bench(KlipperFaults faults = {}, double laser_limit_s = 600)
      : klipper(DefaultKlipperConfig(laser_limit_s), std::move(faults)) {}

  struct Answer {
    bool done = false;
    std::optional<std::string> error;
    double after_s = 0;
    std::vector<std::string> responses;
  };

  void Collect(Answer& answer, std::uint64_t id) {
    for (const KlipperEvent& event : klipper.TakeEvents()) {
      if (event.kind == KlipperEvent::Kind::kResponse) answer.responses.push_back(event.text);
      if (event.kind == KlipperEvent::Kind::kScriptDone && event.script == id) {
        answer.done = true;
        answer.error = event.error;
      }
    }
  }

  // Runs a script until it answers or the time is up.
  Answer Run(const std::string& script, double limit_s = 120) {
    Answer answer;
    const double from_s = klipper.now_s();
    const std::uint64_t id = klipper.RunScript(script);
    Collect(answer, id);
    while (!answer.done && klipper.now_s() < from_s + limit_s) {
      klipper.Advance(klipper.now_s() + 0.0101);
      Collect(answer, id);
    }
    answer.after_s = klipper.now_s() - from_s;
    return answer;
  }

  void Pass(double seconds) { klipper.Advance(klipper.now_s() + seconds); }

  VirtualKlipper klipper;
};

TEST(VirtualKlipper, AnswersMovesAtOnceAndBlocksWhenTheLookAheadIsFull) {
  Bench bench;
  ASSERT_TRUE(bench.Run("G28").done);
  EXPECT_LT(bench.Run("G90\nG1 X200 Y100 F1200").after_s, 0.05);
  std::string many;
  for (int i = 0; i < 10; ++i) many += "G1 X100 F6000\nG1 X200 F6000\n";
  // 20 strokes of 1 s behind one of 11 s: 29 s have to pass before 2 s are left. What is left may
  // be a stroke more: the last one waits undecided for what follows.
  EXPECT_NEAR(bench.Run(many).after_s, 29, 1);
  EXPECT_NEAR(bench.Run("M400").after_s, 2.5, 1);
  EXPECT_NEAR(bench.klipper.TrueHead(bench.klipper.now_s()).position.x_mm, 200, 1e-9);
}

TEST(VirtualKlipper, HomesBeforeItMovesAndKnowsTrueFromBelievedPosition) {
  Bench bench;
  const auto refused = bench.Run("G1 X10 F600");
  EXPECT_EQ(refused.error, "Must home axis first: 10.000 0.000 0.000 [0.000]");
  EXPECT_THAT(refused.responses,
              ElementsAre("!! Must home axis first: 10.000 0.000 0.000 [0.000]"));
  EXPECT_DOUBLE_EQ(bench.klipper.TrueHead(0).position.x_mm, 60);
  ASSERT_FALSE(bench.Run("G28").error);
  EXPECT_EQ(ObjectStatus(bench.klipper, "toolhead")["homed_axes"], "xyz");
  EXPECT_NEAR(bench.klipper.TrueHead(bench.klipper.now_s()).position.x_mm, 0, 1e-9);
  const auto far = bench.Run("G1 X999 F6000");
  EXPECT_EQ(far.error, "Move out of range: 999.000 0.000 0.000 [0.000]");
  EXPECT_FALSE(bench.Run("G1 X50 YQ F1").error) << "Klipper reads YQ as an unknown letter";
}

TEST(VirtualKlipper, AWeakHeaterShutsThePrinterDownOrWaitsForEver) {
  KlipperFaults faults;
  faults.weak_heater = "extruder";
  Bench watched(faults);
  const auto stopped = watched.Run("M109 S210");
  ASSERT_TRUE(stopped.done);
  EXPECT_FALSE(stopped.error) << "the blocked script answers ok, as a real one";
  EXPECT_EQ(watched.klipper.state(), KlippyState::kShutdown);
  EXPECT_THAT(watched.klipper.state_message(), HasSubstr("not heating at expected rate"));
  faults.verify_heaters = false;
  Bench blind(faults);
  EXPECT_FALSE(blind.Run("M109 S210", 300).done);
}

TEST(VirtualKlipper, PinsChangeInStepWithTheMotion) {
  Bench bench;
  bench.Run("G28");
  const double from_s = bench.klipper.now_s();
  EXPECT_LT(bench.Run("G1 X100 F3000\n_LASER_ON").after_s, 0.05);
  bench.Pass(1);
  EXPECT_EQ(bench.klipper.pins.at("LASER"), 0);
  bench.Pass(2);
  EXPECT_EQ(bench.klipper.pins.at("LASER"), 1);
  // 100 mm at 50 mm/s, begun 0.25 s after it was queued and 0.1 s of priming.
  double on_s = 0;
  for (const Change& change : bench.klipper.history().changes) {
    if (change.name == "output_pin LASER" && change.value == 1) on_s = change.time_s;
  }
  EXPECT_NEAR(on_s - from_s, 2.35, 0.05);
}

TEST(VirtualKlipper, TheLaserGoesOffByItselfAfterItsLimit) {
  Bench bench({}, 20);
  bench.Run("_LASER_ON");
  bench.Pass(19);
  EXPECT_EQ(bench.klipper.pins.at("LASER"), 1);
  bench.Pass(2);
  EXPECT_EQ(bench.klipper.pins.at("LASER"), 0);
}

TEST(VirtualKlipper, EmergencyStopStandsStillAndEveryScriptFailsUntilTheRestart) {
  Bench bench;
  bench.Run("G28\nM104 S200\n_LASER_ON");
  const std::uint64_t id = bench.klipper.RunScript("G1 X200 F600\n_LASER_ON\nG4 P20000");
  bench.Pass(3);
  bench.klipper.EmergencyStop();
  const double x = bench.klipper.TrueHead(bench.klipper.now_s()).position.x_mm;
  EXPECT_GT(x, 10);
  EXPECT_EQ(bench.klipper.pins.at("LASER"), 0);
  Bench::Answer blocked;
  bench.Pass(1.1);
  bench.Collect(blocked, id);
  EXPECT_TRUE(blocked.done);
  EXPECT_FALSE(blocked.error);
  EXPECT_EQ(bench.klipper.TrueHead(bench.klipper.now_s()).position.x_mm, x);
  const auto home = bench.Run("G28");
  EXPECT_THAT(*home.error, StartsWith("Shutdown due to webhooks request\nOnce the underlying"));
  EXPECT_EQ(home.responses.back(), "!! Shutdown due to webhooks request");
  bench.Pass(30);
  EXPECT_EQ(bench.klipper.pins.at("LASER"), 0) << "a queued _LASER_ON must not outlive the stop";
  const double nozzle_c = bench.klipper.nozzle.temperature_c;
  bench.klipper.Restart();
  bench.Pass(0.1);
  EXPECT_EQ(bench.klipper.state(), KlippyState::kDisconnected);
  bench.Pass(3);
  EXPECT_EQ(bench.klipper.state(), KlippyState::kReady);
  EXPECT_LT(bench.klipper.nozzle.temperature_c, nozzle_c);
  EXPECT_EQ(ObjectStatus(bench.klipper, "toolhead")["homed_axes"], "");
  EXPECT_EQ(ObjectStatus(bench.klipper, "extruder")["pressure_advance"], 0.04);
  EXPECT_NEAR(bench.klipper.TrueHead(bench.klipper.now_s()).position.x_mm, x, 1e-9);
}

TEST(VirtualKlipper, RestoresWhatSaveGcodeStateKept) {
  Bench bench;
  bench.Run("G28\nG90\nM82\nG1 X50 Y50 Z5 F6000\nSAVE_GCODE_STATE NAME=t");
  bench.Run("G91\nM83\nM220 S50\nG92 X0\nSET_GCODE_OFFSET Z=1\nG1 X10\nRESTORE_GCODE_STATE NAME=t");
  const auto state = ObjectStatus(bench.klipper, "gcode_move");
  EXPECT_EQ(state["absolute_coordinates"], true);
  EXPECT_EQ(state["absolute_extrude"], true);
  EXPECT_EQ(state["speed_factor"], 1.0);
  EXPECT_EQ(state["homing_origin"][2], 0.0);
  EXPECT_EQ(state["gcode_position"][0], 60.0);
  EXPECT_EQ(bench.Run("RESTORE_GCODE_STATE NAME=none").error, "Unknown g-code state: none");
}

TEST(VirtualKlipper, ComesToTheSameEndHoweverOftenTheClockIsRead) {
  const auto backlash = [](double step_s) {
    Bench bench;
    bench.klipper.RunScript("G28\nG1 X80 Y30 F9000\nG1 X20\nG1 Y90\nM400\n_LASER_ON\nM104 S150");
    for (double time_s = 0; time_s < 30; time_s += step_s) bench.klipper.Advance(time_s);
    bench.klipper.Advance(30);
    return ExecutedGcode(bench.klipper.history(), 0, 30) +
           fmt::format("{:.9f}", bench.klipper.nozzle.temperature_c);
  };
  EXPECT_EQ(backlash(0.01), backlash(0.5));
}

TEST(VirtualKlipper, TheExecutedLogPlansTheSameMotionAgain) {
  Bench bench;
  bench.Run("G28\nM104 S210\nM109 S210\nM83\nG1 X20 Y20 Z0.3 F6000\nSET_VELOCITY_LIMIT ACCEL=3000");
  bench.Run("G1 X27.5 E0.4 F300\nG1 X42.5 E0.8 F9000\nG1 X50 E0.4 F300\nM400");
  const std::string text = ExecutedGcode(bench.klipper.history(), 0, bench.klipper.now_s());
  const auto program = InterpretGcode(text, {});
  ASSERT_TRUE(program) << program.error().message << text;
  const auto plan = PlanMotion(program->moves);
  const auto& moves = bench.klipper.history().moves;
  ASSERT_GE(plan.size(), 3U);
  for (std::size_t i = 1; i <= 3; ++i) {
    const TimedMove& again = plan[plan.size() - i];
    const TimedMove& made = moves[moves.size() - i].timed;
    EXPECT_NEAR(again.start_v_mm_s, made.start_v_mm_s, 1e-6);
    EXPECT_NEAR(again.cruise_v_mm_s, made.cruise_v_mm_s, 1e-6);
    EXPECT_NEAR(again.end_v_mm_s, made.end_v_mm_s, 1e-6);
  }
}

TEST(VirtualKlipperMotors, EachHasItsPressureAdvanceByItsSection) {
  KlipperConfig config = DefaultKlipperConfig();
  config.extruders = 2;
  config.extruder_steppers = {{"belted", "extruder1", 0.05, 0.03}};
  VirtualKlipper klipper(config, {});
  klipper.RunScript(
      "ACTIVATE_EXTRUDER EXTRUDER=extruder1\nSET_PRESSURE_ADVANCE ADVANCE=0.01\n"
      "SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE=0.02\n"
      "SYNC_EXTRUDER_MOTION EXTRUDER=belted MOTION_QUEUE=extruder");
  klipper.Advance(1);
  EXPECT_EQ(ObjectStatus(klipper, "extruder")["pressure_advance"], 0.04);
  EXPECT_EQ(ObjectStatus(klipper, "extruder1")["pressure_advance"], 0.01);
  EXPECT_EQ(ObjectStatus(klipper, "extruder_stepper belted"),
            (nlohmann::json{
                {"pressure_advance", 0.02}, {"smooth_time", 0.03}, {"motion_queue", "extruder"}}));
}

}  // namespace
}  // namespace trammel::sim
