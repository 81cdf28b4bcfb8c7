// State of a shared printer after a calibration: a run that crashed before it, another's job,
// another trammel, motors switched off, a restart, an interruption in the middle of a print.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "fault_scenario.h"
#include "machine_shop.h"
#include "session/session.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::test {
namespace {

using sim::VirtualKlipper;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kMachine = 3, kInterrupted = 130;
constexpr const char* kVase = "vase.gcode";

// Heating takes some seconds, for others to come in between.
ShopOptions SlowHeaters() {
  ShopOptions options;
  options.klipper.nozzle.rate_c_s = 25;
  options.klipper.nozzle.gain_window_s = 20;
  return options;
}

class LeftSafe : public testing::Test {
 protected:
  void Open(const ShopOptions& options = {}) {
    shop_ = std::make_unique<MachineShop>(options);
    shop_->Script(kWorkedWith);
    before_ = shop_->Look();
  }
  [[nodiscard]] std::unique_ptr<TrammelProcess> CalibrateInto(const std::string& folder) const {
    return std::make_unique<TrammelProcess>(
        std::vector<std::string>{"pa", "calibrate", "--printer", shop_->address(), "--out", folder},
        shop_->folder());
  }
  void WaitUntilHeating(TrammelProcess& process) {
    shop_->WaitUntil(
        [](VirtualKlipper& klipper) {
          return klipper.nozzle.target_c > 100 &&
                 klipper.nozzle.temperature_c < klipper.nozzle.target_c - 50;
        },
        "the nozzle was being heated", process);
  }
  // Another's job begins, as if from the printer's own screen.
  void PrintVase() {
    shop_->With([](VirtualKlipper& klipper) {
      std::string gcode = "M104 S151\nG90\nG1 Z10 F600\n";
      for (int i = 0; i < 200; ++i) gcode += "G1 X200 Y50 F6000\nG1 X50 Y200 F6000\n";
      klipper.files()[kVase] = gcode;
      klipper.RunScript(std::string("SDCARD_PRINT_FILE FILENAME=") + kVase);
    });
  }
  void ExpectNothingUploadedIsLeft() {
    shop_->With([](VirtualKlipper& klipper) {
      for (const auto& [name, text] : klipper.files()) EXPECT_EQ(name, kVase);
    });
  }

  std::unique_ptr<MachineShop> shop_;
  PrinterLook before_;
};

TEST_F(LeftSafe, ARunAfterAKilledOneBringsBackWhatThatLeftAndSwitchesItsHeatersOff) {
  Open();
  const auto killed = shop_->Calibrate();
  shop_->WaitUntilSweeping(1, *killed);
  killed->Send(SIGKILL);
  static_cast<void>(killed->Wait());
  ASSERT_GT(shop_->Look().nozzle_target_c, 0);
  EXPECT_THAT(shop_->Run({"doctor", "--printer", shop_->address()}).standard_output,
              Containing("died here: the next run brings back", "target of extruder"));
  ASSERT_GT(shop_->Look().nozzle_target_c, 0) << "doctor changes nothing";
  const auto next = CalibrateInto("again");
  WaitUntilHeating(*next);
  next->Send(SIGINT);
  EXPECT_THAT(next->Wait(),
              Fails(kInterrupted, "died here: brought back", "target of extruder", "-> off"));
  PrinterLook wanted = before_;
  wanted.bed_target_c = 0;
  EXPECT_THAT(shop_->Faulty(wanted), IsEmpty());
  ExpectNothingUploadedIsLeft();
  EXPECT_THAT(shop_->Run({"doctor", "--printer", shop_->address()}).standard_output,
              HasSubstr("none left anything"));
}

TEST_F(LeftSafe, ARunAfterOneThatWasKilledInItsPrintEndsThatPrint) {
  Open();
  const auto killed = shop_->Calibrate({"--set", "park_lift=15"});
  shop_->WaitUntilPrinting(*killed);
  // However long a busy computer takes to start the next one.
  shop_->With([](VirtualKlipper& klipper) {
    auto& lines = klipper.print.lines;
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(klipper.print.next), 600, "G4 P1000");
  });
  killed->Send(SIGKILL);
  static_cast<void>(killed->Wait());
  ASSERT_TRUE(shop_->Look().printing);
  const auto next = CalibrateInto("again");
  WaitUntilHeating(*next);
  next->Send(SIGINT);
  EXPECT_THAT(next->Wait(), Fails(kInterrupted, "its print is still under way", "brought back"));
  PrinterLook wanted = before_;
  wanted.bed_target_c = 0;
  EXPECT_THAT(shop_->Faulty(wanted), IsEmpty());
  ExpectNothingUploadedIsLeft();
}

TEST_F(LeftSafe, ARunAfterAKilledOneLeavesWhatTheOwnerSetSince) {
  Open(SlowHeaters());
  const auto killed = shop_->Calibrate();
  WaitUntilHeating(*killed);
  killed->Send(SIGKILL);
  static_cast<void>(killed->Wait());
  shop_->Script(std::string(procedure::kRelease) +
                "\nSET_GCODE_OFFSET Z=0.2\nSET_VELOCITY_LIMIT ACCEL=4321\nM140 S33\nM104 S0\n"
                "SET_PRESSURE_ADVANCE ADVANCE=0.044\nM220 S80");
  PrinterLook wanted = shop_->Look();
  wanted.nozzle_target_c = 0;
  const auto next = CalibrateInto("again");
  WaitUntilHeating(*next);
  next->Send(SIGINT);
  const ProcessEnd end = next->Wait();
  EXPECT_THAT(end, Fails(kInterrupted, "left as they are", "offset z 0.2 mm",
                         "acceleration limit 4321", "target of heater_bed 33"));
  EXPECT_THAT(shop_->Faulty(wanted), IsEmpty()) << end.standard_error;
}

TEST_F(LeftSafe, AHeaterThatTheIdleTimeOutSwitchesOffEndsTheRunWithThatCause) {
  ShopOptions options = SlowHeaters();
  options.klipper.nozzle.rate_c_s = 10;
  options.klipper.idle_timeout_s = 3;
  Open(options);
  EXPECT_THAT(shop_->Calibrate()->Wait(),
              Fails(kMachine, "extruder was switched off in the middle", "[idle_timeout] timeout"));
}

TEST_F(LeftSafe, AHeaterThatSomebodySwitchesOffEndsTheRunWithThatCause) {
  Open(SlowHeaters());
  const auto process = shop_->Calibrate();
  WaitUntilHeating(*process);
  shop_->With([](VirtualKlipper& klipper) { klipper.RunScript("TURN_OFF_HEATERS"); });
  EXPECT_THAT(process->Wait(), Fails(kMachine, "Cooldown",
                                     "stay off; before, these were on: heater_bed "
                                     "32 degC"));
  EXPECT_THAT(shop_->Faulty(before_), ElementsAre("bed target is 0 and was 32"));
}

TEST_F(LeftSafe, APrintThatIsInterruptedWithoutPauseResumeIsEndedByClosingItsFile) {
  ShopOptions options;
  options.klipper.pause_resume = false;
  Open(options);
  const auto process = shop_->Calibrate({"--set", "park_lift=15"});
  shop_->WaitUntilPrinting(*process);
  process->Send(SIGINT);
  const ProcessEnd end = process->Wait();
  EXPECT_EQ(end.exit_code, kInterrupted) << end.standard_error;
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty()) << end.standard_error;
  shop_->With([](VirtualKlipper& klipper) { EXPECT_EQ(klipper.print.state, "standby"); });
  ExpectNothingUploadedIsLeft();
}

TEST_F(LeftSafe, APatternThatIsPrintedByHandLeavesPressureAdvanceAndLimitsAsTheyWere) {
  Open();
  ASSERT_THAT(shop_->Run({"pa", "pattern"}),
              Prints(0, "afterwards pressure advance and acceleration come back as they were"));
  const std::string gcode = ReadWhole(shop_->folder() / "pattern.gcode");
  const auto settings = [this] { return shop_->Look().settings; };
  shop_->With([&](VirtualKlipper& klipper) {
    klipper.files()[kVase] = gcode;
    klipper.RunScript(std::string("SDCARD_PRINT_FILE FILENAME=") + kVase);
  });
  bool changed = false, printing = true;
  for (int i = 0; i < 6000 && printing; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    changed = changed || settings() != before_.settings;
    printing = shop_->Look().printing;
  }
  EXPECT_FALSE(printing);
  EXPECT_TRUE(changed) << "it prints at values of its own";
  EXPECT_EQ(settings(), before_.settings);
  EXPECT_EQ(shop_->Look().gcode, before_.gcode);
}

TEST_F(LeftSafe, APatternThatIsPrintedByHandAndCancelledDoesSoToo) {
  Open();
  ASSERT_EQ(shop_->Run({"pa", "pattern"}).exit_code, 0);
  const std::string gcode = ReadWhole(shop_->folder() / "pattern.gcode");
  const auto settings = [this] { return shop_->Look().settings; };
  shop_->With([&](VirtualKlipper& klipper) {
    klipper.files()[kVase] = gcode;
    klipper.RunScript(std::string("SDCARD_PRINT_FILE FILENAME=") + kVase);
  });
  const auto until = [](const std::function<bool()>& so) {
    for (int i = 0; i < 6000 && !so(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return so();
  };
  ASSERT_TRUE(until([&] { return settings() != before_.settings; }));
  shop_->With([](VirtualKlipper& klipper) { klipper.RunScript("CANCEL_PRINT"); });
  EXPECT_TRUE(until([&] { return settings() == before_.settings; }));
}

TEST_F(LeftSafe, AnothersJobThatBeginsWhileItHeatsIsLeftAlone) {
  Open(SlowHeaters());
  const auto process = shop_->Calibrate();
  WaitUntilHeating(*process);
  PrintVase();
  EXPECT_THAT(process->Wait(), Fails(kMachine, "no longer free", kVase));
  shop_->With([](VirtualKlipper& klipper) {
    EXPECT_EQ(klipper.print.state, "printing");
    EXPECT_EQ(klipper.print.filename, kVase);
    EXPECT_EQ(klipper.nozzle.target_c, 151);
    EXPECT_EQ(TimesRead(klipper, "CANCEL_PRINT"), 0);
  });
  ExpectNothingUploadedIsLeft();
}

TEST_F(LeftSafe, AnothersJobThatBeginsInASweepIsNotMovedAndItsLaserIsOff) {
  ShopOptions options;
  options.config["scan"] = "lines_at_once = 8\n";
  Open(options);
  const auto process = shop_->Calibrate();
  shop_->WaitUntilSweeping(1, *process);
  PrintVase();
  double begun_s = 0;
  shop_->With([&](VirtualKlipper& klipper) { begun_s = klipper.now_s(); });
  const ProcessEnd end = process->Wait();
  EXPECT_THAT(end, Fails(kMachine, "no longer free", kVase));
  EXPECT_FALSE(shop_->Look().laser) << end.standard_error;
  shop_->With([&](VirtualKlipper& klipper) {
    const auto& lines = klipper.history().lines;
    const auto sweeps = std::count_if(lines.begin(), lines.end(), [&](const sim::ReadLine& line) {
      return line.time_s > begun_s && line.text.starts_with("G1 ") &&
             !line.text.ends_with(" F6000") && !line.text.ends_with(" F600");
    });
    EXPECT_LE(sweeps, 1) << "but for the one that was on its way";
    EXPECT_EQ(klipper.print.state, "printing");
    EXPECT_EQ(TimesRead(klipper, "CANCEL_PRINT"), 0);
  });
}

TEST_F(LeftSafe, ASecondTrammelIsRefusedOnThisComputerAndFromAnother) {
  ShopOptions options = SlowHeaters();
  options.klipper.nozzle.rate_c_s = 3;  // still heats once a busy computer has started two others
  Open(options);
  const auto first = shop_->Calibrate();
  WaitUntilHeating(*first);
  EXPECT_THAT(CalibrateInto("second")->Wait(), Fails(kMachine, "another trammel on this computer"));
  const TemporaryFolder elsewhere;
  WriteWhole(elsewhere.path() / "trammel.toml", ReadWhole(shop_->folder() / "trammel.toml"));
  EXPECT_THAT(
      TrammelProcess({"pa", "calibrate", "--printer", shop_->address()}, elsewhere.path()).Wait(),
      Fails(kMachine, testing::AnyOf(HasSubstr("another trammel has this printer"),
                                     HasSubstr("is printing; wait for its end or cancel it"),
                                     HasSubstr("is printing, by somebody else"))));
  EXPECT_TRUE(first->Running()) << first->StandardErrorSoFar();
  first->Send(SIGINT);
  EXPECT_EQ(first->Wait().exit_code, kInterrupted);
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
}

TEST_F(LeftSafe, MotorsSwitchedOffInASweepDoNotLeaveTheHeatersOn) {
  Open();
  const auto process = shop_->Calibrate();
  shop_->WaitUntilSweeping(1, *process);
  shop_->With([](VirtualKlipper& klipper) { klipper.RunScript("M84"); });
  EXPECT_THAT(process->Wait(), Fails(kMachine, "motors"));
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
}

TEST_F(LeftSafe, ARestartWhileTheHeadStandsInASweepIsNamed) {
  Open();
  const auto process = shop_->Calibrate();
  shop_->WaitUntilSweeping(2, *process);
  shop_->WaitUntil(
      [](VirtualKlipper& klipper) {
        return klipper.pins.at("LASER") > 0 && klipper.TrueHead(klipper.now_s()).speed_mm_s == 0;
      },
      "the head stood", *process);
  shop_->With([](VirtualKlipper& klipper) { klipper.Restart(); });
  EXPECT_THAT(process->Wait(), Fails(kMachine, "the printer was restarted in the middle",
                                     Not(HasSubstr("motion_report"))));
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
}

TEST_F(LeftSafe, AnInterruptedPrintIsLeftWithTheNozzleLiftedAndParked) {
  Open();
  const auto process = shop_->Calibrate({"--set", "park_lift=15"});
  shop_->WaitUntilPrinting(*process);
  process->Send(SIGINT);
  EXPECT_THAT(process->Wait(), Ends(kInterrupted));
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  shop_->With([](VirtualKlipper& klipper) {
    EXPECT_EQ(klipper.print.state, "cancelled");
    const sim::HeadState head = klipper.TrueHead(klipper.now_s());
    EXPECT_GT(head.position.z_mm, 14.9);
    EXPECT_LT(head.position.y_mm, 30) << "in front";
  });
  ExpectNothingUploadedIsLeft();
}

}  // namespace
}  // namespace trammel::test
