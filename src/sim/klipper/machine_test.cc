#include "sim/klipper/machine.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

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

TEST(VirtualKlipper, TellsThePrintTimeOfTheMomentItIsAskedAtNotOfItsGrid) {
  Bench bench;
  bench.Pass(5);
  const double print_time_of_0_s = bench.klipper.PrintTimeAt(0);
  for (const double time_s : {6.0005, 6.0019, 7.0031}) {
    bench.klipper.Advance(time_s);
    EXPECT_NEAR(ObjectStatus(bench.klipper, "toolhead")["estimated_print_time"].get<double>(),
                print_time_of_0_s + time_s, 1e-9);
  }
}

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

TEST(VirtualKlipper, LiveVelocityIsTheMovesFeedInTheMiddleOfASweep) {
  Bench bench;
  ASSERT_TRUE(bench.Run("G28\nG1 X100 Y100 Z5 F6000\nM400").done);
  bench.Run("G1 X130 F400");
  bench.Pass(2);
  const auto report = ObjectStatus(bench.klipper, "motion_report");
  EXPECT_NEAR(report["live_velocity"].get<double>(), 400.0 / 60, 1e-9);
  const double x = report["live_position"][0];
  bench.Pass(0.1);
  const double later = ObjectStatus(bench.klipper, "motion_report")["live_position"][0];
  EXPECT_NEAR(later - x, 0.1 * 400 / 60, 0.02);
}

TEST(VirtualKlipper, RefusesColdFilamentAndReportsWhileItHeats) {
  Bench bench;
  bench.Run("G28\nM83");
  const auto cold = bench.Run("G1 X60 E2 F300");
  EXPECT_THAT(cold.responses,
              ElementsAre("// Extrude below minimum temp\n// See the 'min_extrude_temp' config "
                          "option for details",
                          "!! Extrude below minimum temp"));
  EXPECT_EQ(cold.error,
            "Extrude below minimum temp\nSee the 'min_extrude_temp' config option for details");
  const auto heat = bench.Run("M104 S210\nM109 S210");
  ASSERT_TRUE(heat.done);
  EXPECT_FALSE(heat.error);
  EXPECT_GT(heat.responses.size(), 10U);
  EXPECT_THAT(heat.responses.front(), StartsWith("B:25.0 /0.0 T0:25.0 /210.0"));
  EXPECT_FALSE(bench.Run("G1 X60 E2 F300").error);
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

TEST(VirtualKlipper, UnknownCommandsAnswerOkAndOnlyTell) {
  Bench bench;
  const auto answer = bench.Run("FOO_BAR");
  EXPECT_TRUE(answer.done);
  EXPECT_FALSE(answer.error);
  EXPECT_THAT(answer.responses, ElementsAre("// Unknown command:\"FOO_BAR\""));
}

TEST(VirtualKlipper, AnErrorDropsLaterLinesAndKeepsEarlierMoves) {
  Bench bench;
  bench.Run("G28");
  const auto answer = bench.Run("G1 X50 F6000\nSET_PRESSURE_ADVANCE ADVANCE=-1\nG1 X100");
  EXPECT_EQ(answer.error,
            "Error on 'SET_PRESSURE_ADVANCE ADVANCE=-1': ADVANCE must have minimum of 0.0");
  bench.Run("M400");
  EXPECT_NEAR(bench.klipper.TrueHead(bench.klipper.now_s()).position.x_mm, 50, 1e-9);
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

TEST(VirtualKlipper, PrintsAFileAndTellsItsProgress) {
  Bench bench;
  bench.klipper.files()["a.gcode"] = "G28\nG1 X50 F6000\nG1 X10 F6000\n";
  ASSERT_FALSE(bench.Run("SDCARD_PRINT_FILE FILENAME=\"a.gcode\"").error);
  EXPECT_EQ(ObjectStatus(bench.klipper, "print_stats")["state"], "printing");
  EXPECT_TRUE(bench.Run("SDCARD_PRINT_FILE FILENAME=a.gcode").error);
  bench.Pass(40);
  EXPECT_EQ(ObjectStatus(bench.klipper, "print_stats")["state"], "complete");
  EXPECT_EQ(bench.Run("SDCARD_PRINT_FILE FILENAME=none").error, "Unable to open file");
}

TEST(VirtualKlipper, TurnsHeatersOffWhenItIsLeftAlone) {
  Bench bench;
  bench.Run("G28\nM104 S100");
  bench.Pass(595);
  EXPECT_EQ(bench.klipper.nozzle.target_c, 100);
  bench.Pass(10);  // Klipper's own time-out is 600 s
  EXPECT_EQ(bench.klipper.nozzle.target_c, 0);
  EXPECT_FALSE(bench.klipper.homed[0]);
  EXPECT_EQ(ObjectStatus(bench.klipper, "idle_timeout")["state"], "Idle");
}

TEST(VirtualKlipper, WithoutPauseResumeAPrintEndsByClosingItsFile) {
  KlipperConfig config = DefaultKlipperConfig();
  config.pause_resume = false;
  VirtualKlipper klipper(config, {});
  klipper.files()["a.gcode"] = "G28\nG4 P60000\n";
  klipper.RunScript("SDCARD_PRINT_FILE FILENAME=a.gcode");
  klipper.Advance(1);
  klipper.RunScript("CANCEL_PRINT");
  klipper.Advance(2);
  EXPECT_EQ(ObjectStatus(klipper, "print_stats")["state"], "printing");
  klipper.RunScript("SDCARD_RESET_FILE");
  klipper.Advance(100);
  EXPECT_EQ(ObjectStatus(klipper, "print_stats")["state"], "standby");
  EXPECT_EQ(ObjectStatus(klipper, "pause_resume"), nlohmann::json::object());
}

TEST(VirtualKlipper, CallsARegisteredAgentAndNobodyElse) {
  Bench bench;
  (void)bench.klipper.TakeEvents();
  bench.klipper.RunScript("CALL_AGENT WHAT=start T=1.5");
  for (const KlipperEvent& event : bench.klipper.TakeEvents()) {
    EXPECT_NE(event.kind, KlipperEvent::Kind::kRemoteCall);
  }
  bench.klipper.RegisterRemoteMethod("calib_agent_event");
  bench.klipper.RunScript("CALL_AGENT WHAT=start T=1.5");
  const std::vector<KlipperEvent> events = bench.klipper.TakeEvents();
  ASSERT_EQ(events.front().kind, KlipperEvent::Kind::kRemoteCall);
  EXPECT_EQ(events.front().arguments[0].text, "start");
  EXPECT_EQ(events.front().arguments[1].number, 1.5);
}

TEST(VirtualKlipper, ComesToTheSameEndHoweverOftenTheClockIsRead) {
  const auto play = [](double step_s) {
    Bench bench;
    bench.klipper.RunScript("G28\nG1 X80 Y30 F9000\nG1 X20\nG1 Y90\nM400\n_LASER_ON\nM104 S150");
    for (double time_s = 0; time_s < 30; time_s += step_s) bench.klipper.Advance(time_s);
    bench.klipper.Advance(30);
    return ExecutedGcode(bench.klipper.history(), 0, 30) +
           fmt::format("{:.9f}", bench.klipper.nozzle.temperature_c);
  };
  EXPECT_EQ(play(0.01), play(0.5));
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
