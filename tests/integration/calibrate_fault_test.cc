// Faults of a printer, its camera and the disk, before and during a calibration over real sockets.
// After each: a message with cause and remedy, the right exit code, the machine safe and restored,
// the recording so far preserved, and no number.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <memory>
#include <string>

#include "play_all.h"
#include "sim/moonraker/test_client.h"
#include "support/matchers.h"
#include "support/scripted_http.h"

namespace trammel::test {
namespace {

using sim::CameraFault;
using sim::CameraFaultKind;
using sim::VirtualKlipper;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kWidth = 4;  // parallel runs; each takes a fifth of a core
constexpr int kUsage = 1, kNotTrusted = 2, kMachine = 3, kUnsafe = 4, kInterrupted = 130;

constexpr double kRunTruth_s = 0.03;

enum class Recorded { kNoFolder, kNothing, kSomeLines };
using Judge = std::function<void(const Outcome&)>;

struct Case {
  Scenario scenario;
  int exit_code = kMachine;
  std::vector<std::string> words = {};  // all of them on standard error
  Recorded recorded = Recorded::kNothing;
  Judge judge = {};  // instead of all that
};

void WorkedWith(MachineShop& shop) { shop.Script(kWorkedWith); }

// Event and its time.
using Strike = std::function<void(MachineShop&, TrammelProcess&)>;
Strike InPrint(Strike strike) {
  return [strike](MachineShop& shop, TrammelProcess& process) {
    shop.WaitUntilPrinting(process);
    strike(shop, process);
  };
}
Strike InSweep(Strike strike) {
  return [strike](MachineShop& shop, TrammelProcess& process) {
    shop.WaitUntilSweeping(3, process);
    strike(shop, process);
  };
}
Strike InFirstSweep(Strike strike) {
  return [strike](MachineShop& shop, TrammelProcess& process) {
    shop.WaitUntilSweeping(1, process);
    strike(shop, process);
  };
}
Strike Limit(int resource, std::uint64_t value) {
  return [=](MachineShop&, TrammelProcess& process) { process.Limit(resource, value); };
}
Strike Klipper(std::function<void(VirtualKlipper&)> change) {
  return [change](MachineShop& shop, TrammelProcess&) { shop.With(change); };
}
Strike Signal(int signal) {
  return [signal](MachineShop&, TrammelProcess& process) { process.Send(signal); };
}
Strike Camera(CameraFaultKind kind, double duration_s = 1e6) {
  return [=](MachineShop& shop, TrammelProcess&) {
    CameraFault fault;
    fault.kind = kind;
    fault.duration_s = duration_s;
    fault.jump_s = 3;
    fault.width_px = 96;
    fault.height_px = 96;
    shop.camera().Inject(fault);
  };
}
// Again and again while everything is brought back.
void Impatient(MachineShop&, TrammelProcess& process) {
  while (process.Running()) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) process.Send(signal);
    usleep(20'000);
  }
}
void EmergencyStop(MachineShop& shop, TrammelProcess&) {
  sim::TestClient screen(shop.server().port());
  static_cast<void>(screen.Call("printer.emergency_stop"));
}
void RefuseNextMove(VirtualKlipper& klipper) {
  klipper.faults().refuse_move = klipper.xy_moves + 1;
}
Strike Disconnect(double refuse_for_s) {
  return [=](MachineShop& shop, TrammelProcess&) {
    sim::ServerFaults faults;
    faults.close_at_s = 0;
    faults.refuse_for_s = refuse_for_s;
    shop.server().Inject(faults);
  };
}

// Good and right, or no number at all.
void RightOrSilent(const Outcome& outcome) {
  constexpr double kSlack_s = 0.002;  // beyond 95 %: one in twenty may lie outside
  EXPECT_FALSE(outcome.end.timed_out);
  EXPECT_THAT(outcome.faulty, IsEmpty());
  EXPECT_EQ(outcome.laser_on_s, 0);
  const RecordingLook& recording = outcome.recording;
  if (outcome.end.exit_code == 0) {
    ASSERT_TRUE(recording.value_s);
    EXPECT_GT(*recording.high_s, kRunTruth_s - kSlack_s);
    EXPECT_LT(*recording.low_s, kRunTruth_s + kSlack_s);
  } else {
    EXPECT_EQ(outcome.end.exit_code, kNotTrusted);
    EXPECT_FALSE(recording.value_s) << *recording.value_s;
  }
}

// A printer that answers like something else.
std::function<void(ShopOptions&)> Instead(ScriptedHttp::Script script) {
  return [script](ShopOptions& options) {
    const auto server = std::make_shared<ScriptedHttp>(script);
    options.config["moonraker"] =
        "address = \"127.0.0.1:" + std::to_string(server->port()) + "\"\n";
    options.neighbour = server;
  };
}

std::vector<std::string> At(const std::string& printer) {
  return {"pa", "calibrate", "--printer", printer, "--out", "rec"};
}

std::vector<Case> BeforeItBegins() {
  std::vector<Case> cases;
  cases.push_back({{"WrongAddress", {}, {}, {}, At("no-such-printer.invalid")},
                   kMachine,
                   {"no-such-printer.invalid"}});
  const std::string unused = "127.0.0.1:" + std::to_string(UnusedPort());
  cases.push_back({{"WrongPort", {}, {}, {}, At(unused)}, kMachine, {unused, "refuses"}});
  const std::vector<std::string> configured = {"pa", "calibrate", "--out", "rec"};
  cases.push_back({{"NotMoonraker",
                    Instead([](const std::string&, HttpPeer& peer) {
                      peer.Send("HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhello");
                    }),
                    {},
                    {},
                    configured},
                   kMachine,
                   {"Moonraker"}});
  cases.push_back({{"SilentServer",
                    Instead([](const std::string&, HttpPeer& peer) { peer.WaitForClose(); }),
                    {},
                    {},
                    configured},
                   kMachine,
                   {"127.0.0.1"}});
  cases.push_back({{"FolderCannotBeMade", {}, WorkedWith}, kUsage, {"/proc/no/rec"}});
  cases.back().scenario.arguments = {"pa", "calibrate", "--out", "/proc/no/rec", "--printer"};
  cases.push_back({{"WrongKey",
                    [](ShopOptions& options) {
                      options.api_key = "right";
                      options.config["moonraker"] = "api_key = \"wrong\"\n";
                    }},
                   kMachine,
                   {"Unauthorized", "API key"}});
  cases.push_back({{"NoKey", [](ShopOptions& options) { options.api_key = "right"; }},
                   kMachine,
                   {"Unauthorized", "API key"}});
  cases.push_back({{"KlipperStarts", [](ShopOptions& options) { options.faults.startup_s = 1e6; }},
                   kMachine,
                   {"to be ready", "startup"}});
  cases.push_back(
      {{"KlipperInError", [](ShopOptions& options) { options.faults.error_at_start = true; }},
       kMachine,
       {"not ready", "error",
        std::string(sim::kConfigError).substr(0, std::string(sim::kConfigError).find('\n'))}});
  cases.push_back({{"KlipperShutDown",
                    {},
                    [](MachineShop& shop) {
                      shop.With([](VirtualKlipper& klipper) { klipper.EmergencyStop(); });
                    }},
                   kMachine,
                   {"shutdown", "FIRMWARE_RESTART"}});
  cases.push_back(
      {{"AnotherJobRuns", [](ShopOptions& options) { options.faults.printing_at_start = true; }},
       kMachine,
       {"busy", "someone_elses_vase.gcode"}});
  cases.push_back(
      {{"NoLaserMacro", [](ShopOptions& options) { options.klipper.macros.erase("_LASER_ON"); },
        WorkedWith},
       kMachine,
       {"laser_on_gcode", "_LASER_ON"}});
  cases.push_back({{"UnknownStartMacro",
                    [](ShopOptions& options) {
                      options.config["printer"] =
                          "start_gcode = \"PRINT_START_MISSING\\nG28\\n"
                          "M109 S{nozzle_temperature_c}\\n\"\n";
                    },
                    WorkedWith},
                   kMachine,
                   {"PRINT_START_MISSING"}});
  cases.push_back({{"NozzleTooColdToExtrude",
                    [](ShopOptions& options) { options.klipper.min_extrude_temp_c = 195; }},
                   kUnsafe,
                   {"nozzle_temperature = 190", "min_extrude_temp = 195"}});
  cases.push_back(
      {{"BedTooHotForThePrinter", [](ShopOptions& options) { options.klipper.bed.highest_c = 35; }},
       kUnsafe,
       {"bed_temperature = 40", "max_temp of the bed = 35"}});
  cases.push_back({{"NoCamera",
                    [](ShopOptions& options) {
                      options.with_camera = false;
                      options.config["camera"] =
                          "url = \"http://127.0.0.1:" + std::to_string(UnusedPort()) +
                          "/stream\"\n";
                    },
                    WorkedWith},
                   kMachine,
                   {"/stream", "refuses"}});
  cases.push_back({{"ListedCameraIsNotThere",
                    [](ShopOptions& options) { options.with_camera = false; }, WorkedWith},
                   kMachine,
                   {"/webcam/"}});
  cases.push_back(
      {{"SilentCamera",
        [](ShopOptions& options) { options.camera.faults.push_back({CameraFaultKind::kStall}); },
        WorkedWith},
       kMachine,
       {"action=stream", "within 5 s"}});
  cases.push_back({{"LaserIsUnplugged",
                    [](ShopOptions& options) {
                      options.camera.faults.push_back({CameraFaultKind::kLaserAbsent});
                    },
                    WorkedWith},
                   kMachine,
                   {"does not see the laser", "_LASER_ON"}});
  // A refusal before the print creates no files.
  for (Case& one : cases) {
    const std::string& name = one.scenario.name;
    if (name != "LaserIsUnplugged" && name != "UnknownStartMacro")
      one.recorded = Recorded::kNoFolder;
  }
  return cases;
}

constexpr double kRunLaserLimit_s = 6;
constexpr double kTicks_s = 0.1;
void ShortLaserLimit(ShopOptions& options) { options.klipper = QuickKlipper(kRunLaserLimit_s); }

// Longer than the printer's own limit.
Case LongLost() {
  Case lost{{"LongDisconnectInSweep", ShortLaserLimit, WorkedWith, InSweep(Disconnect(15))},
            kMachine,
            {"connection"},
            Recorded::kSomeLines};
  return lost;
}

int Count(const std::string& text, const std::string& word) {
  int count = 0;
  for (auto at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

Case Killed() {
  Case killed{{"KillInSweep", ShortLaserLimit, WorkedWith, InSweep(Signal(SIGKILL))}};
  killed.scenario.patience_s = kRunLaserLimit_s + 1;
  killed.judge = [](const Outcome& outcome) {
    EXPECT_EQ(outcome.end.signal, SIGKILL);
    EXPECT_GT(outcome.laser_on_s, 0) << "the printer's own limit had nothing to do";
    EXPECT_LT(outcome.laser_on_s, kRunLaserLimit_s + kTicks_s);
    EXPECT_FALSE(outcome.after.laser);
    // It dies in the third sweep; a busy computer sweeps a line again, into the same video.
    const int swept_again = Count(outcome.end.standard_error, " again: ");
    EXPECT_GE(outcome.recording.videos, 3 - swept_again);
    EXPECT_EQ(outcome.recording.exit_code, kNotTrusted) << outcome.recording.said;
    EXPECT_FALSE(outcome.recording.value_s);
  };
  return killed;
}

Case KilledInTheFirstSweep() {
  Case killed{{"KillInFirstSweep", ShortLaserLimit, WorkedWith, InFirstSweep(Signal(SIGKILL))}};
  killed.scenario.patience_s = kRunLaserLimit_s + 1;
  killed.judge = [](const Outcome& outcome) {
    EXPECT_EQ(outcome.end.signal, SIGKILL);
    EXPECT_EQ(outcome.recording.videos, 1);
    EXPECT_GT(outcome.recording.told_frames, 5);
    EXPECT_EQ(outcome.recording.exit_code, kNotTrusted);
    EXPECT_THAT(outcome.recording.said,
                Containing("ended in its first sweep", "frames in line0.avi"));
  };
  return killed;
}

std::vector<Case> InTheMiddle() {
  const auto quick = [](ShopOptions&) {};
  const auto case_of = [&](const std::string& name, const Strike& strike, int exit_code,
                           std::vector<std::string> words, Recorded recorded) {
    return Case{{name, quick, WorkedWith, strike}, exit_code, std::move(words), recorded};
  };
  const auto printing = [&](const std::string& name, const Strike& strike, int exit_code,
                            std::vector<std::string> words) {
    return case_of(name + "InPrint", InPrint(strike), exit_code, std::move(words),
                   Recorded::kNothing);
  };
  const auto sweeping = [&](const std::string& name, const Strike& strike, int exit_code,
                            std::vector<std::string> words) {
    return case_of(name + "InSweep", InSweep(strike), exit_code, std::move(words),
                   Recorded::kSomeLines);
  };
  const auto restart = Klipper([](VirtualKlipper& klipper) { klipper.Restart(); });
  // Above min_extrude_temp of 170: below it, the print's next line may be refused first.
  const auto weak_nozzle =
      Klipper([](VirtualKlipper& klipper) { klipper.nozzle.highest_reach_c = 175; });
  const auto weak_bed = Klipper([](VirtualKlipper& klipper) { klipper.bed.highest_reach_c = 20; });
  std::vector<Case> cases = {
      printing("MoveRefused", Klipper(RefuseNextMove), kMachine, {"Move out of range"}),
      sweeping("MoveRefused", Klipper(RefuseNextMove), kMachine, {"Move out of range"}),
      printing("HeaterFails", weak_nozzle, kMachine, {"extruder", "not heating"}),
      sweeping("HeaterFails", weak_bed, kMachine, {"heater_bed", "not heating"}),
      sweeping("MacroVanishes",
               Klipper([](VirtualKlipper& klipper) { klipper.macros().erase("_LASER_ON"); }),
               kMachine, {"the printer does not know '_LASER_ON'", "add the macro"}),
      sweeping("LaserOffVanishes",
               [](MachineShop& shop, TrammelProcess& process) {
                 shop.With([](VirtualKlipper& klipper) { klipper.macros().erase("LASER_OFF"); });
                 process.Send(SIGINT);
               },
               kInterrupted, {"LASER_OFF", "stopped instead", "FIRMWARE_RESTART"}),
      sweeping("Disconnect", Disconnect(2), kMachine, {"connection"}),
      printing("Restart", restart, kMachine, {"restart"}),
      sweeping("Restart", restart, kMachine, {"restart"}),
      printing("EmergencyStop", EmergencyStop, kMachine,
               {"NOT AS IT WAS: the printer has shut down", "FIRMWARE_RESTART"}),
      sweeping("EmergencyStop", EmergencyStop, kMachine, {"shut", "FIRMWARE_RESTART"}),
      printing("Interrupt", Signal(SIGINT), kInterrupted, {"stopped"}),
      sweeping("Interrupt", Signal(SIGINT), kInterrupted, {"stopped"}),
      sweeping("Terminate", Signal(SIGTERM), kInterrupted, {"stopped"}),
      sweeping("ClosedTerminal", Signal(SIGHUP), kInterrupted, {"stopped"}),
      printing("Quit", Signal(SIGQUIT), kInterrupted, {"stopped"}),
      sweeping("ImpatientInterrupt", Impatient, kInterrupted, {"stopped"}),
      sweeping("CameraStalls", Camera(CameraFaultKind::kStall), kMachine, {"no frame within 5 s"}),
      sweeping("CameraCloses", Camera(CameraFaultKind::kClose), kMachine, {"the stream ended"}),
      sweeping("CameraSizeChanges", Camera(CameraFaultKind::kSizeChange), kMachine,
               {"96x96", "160x120"}),
      sweeping("HalfPicture", Camera(CameraFaultKind::kHalfJpeg, 0), kMachine,
               {"the stream ended"}),
  };
  // Klipper switches the heaters off where a line of a print fails.
  cases.front().judge = [](const Outcome& outcome) {
    EXPECT_EQ(outcome.end.exit_code, kMachine);
    EXPECT_THAT(
        outcome.end.standard_error,
        Containing("Move out of range", "they stay off; before, these were on: heater_bed"));
    EXPECT_THAT(outcome.faulty, ElementsAre("bed target is 0 and was 32"));
  };
  for (const auto& [name, kind] : {std::pair{"TimeJumps", CameraFaultKind::kTimeJump},
                                   std::pair{"FramesAreDropped", CameraFaultKind::kDropFrames},
                                   std::pair{"FramesAreBlack", CameraFaultKind::kBlack},
                                   std::pair{"LaserIsUnplugged", CameraFaultKind::kLaserAbsent}}) {
    cases.push_back(sweeping(name, Camera(kind), 0, {}));
    cases.back().judge = RightOrSilent;
  }
  Case unread = case_of("NobodyReads", {}, 0, {}, Recorded::kSomeLines);
  unread.scenario.limits.nobody_reads = true;
  unread.judge = RightOrSilent;
  cases.push_back(unread);
  // The print goes on by itself, and so does trammel once the connection is back.
  cases.push_back(printing("Disconnect", Disconnect(2), 0, {}));
  cases.back().judge = RightOrSilent;
  cases.push_back(LongLost());
  cases.push_back(Killed());
  cases.push_back(KilledInTheFirstSweep());
  // The limits come in the third sweep: two lines are safe, and it is said how to analyse them.
  cases.push_back(case_of("NoMoreFilesInSweep", InSweep(Limit(RLIMIT_NOFILE, 3)), kUsage,
                          {"Too many open files", "2 lines are safe: trammel pa analyze"},
                          Recorded::kSomeLines));
  cases.push_back(case_of("FullDiskInThirdSweep", InSweep(Limit(RLIMIT_FSIZE, 100'000)), kUsage,
                          {"File too large", "2 lines are safe: trammel pa analyze"},
                          Recorded::kSomeLines));
  cases.back().scenario.limits.file_bytes = std::uint64_t{1} << 40;
  Case weak{{"HeaterNeverGetsThere",
             [](ShopOptions& options) {
               options.faults.weak_heater = "extruder";
               options.faults.weak_heater_c = 120;
               options.faults.verify_heaters = false;
             },
             WorkedWith},
            kMachine,
            {"extruder", "190", "120"}};
  cases.push_back(weak);
  Case full =
      case_of("FullDiskInSweep", {}, kUsage,
              {"line0.avi", "File too large", "frames before it are safe"}, Recorded::kNothing);
  full.scenario.limits.file_bytes = 150'000;
  cases.push_back(full);
  return cases;
}

const std::vector<Case>& AllCases() {
  static const std::vector<Case> all = [] {
    std::vector<Case> cases = BeforeItBegins();
    for (Case& one : InTheMiddle()) cases.push_back(std::move(one));
    return cases;
  }();
  return all;
}

void PrintTo(const Case& one, std::ostream* stream) { *stream << one.scenario.name; }

class CalibrateWith : public testing::TestWithParam<Case> {
 protected:
  // All that are asked for at once.
  static void SetUpTestSuite() {
    running_ = std::make_unique<SideBySide>(kWidth);
    const testing::TestSuite& suite = *testing::UnitTest::GetInstance()->current_test_suite();
    for (const Case& one : AllCases()) {
      for (int i = 0; i < suite.total_test_count(); ++i) {
        const testing::TestInfo& info = *suite.GetTestInfo(i);
        const std::string name = info.name();
        if (info.should_run() && name.substr(name.rfind('/') + 1) == one.scenario.name) {
          running_->Start(one.scenario);
        }
      }
    }
  }
  static void TearDownTestSuite() { running_.reset(); }
  static std::unique_ptr<SideBySide> running_;
};

std::unique_ptr<SideBySide> CalibrateWith::running_;

TEST_P(CalibrateWith, EndsSafeAndSaysWhy) {
  const Case& one = GetParam();
  const Outcome& outcome = running_->Of(one.scenario.name);
  const std::string& said = outcome.end.standard_error;
  SCOPED_TRACE(said);
  EXPECT_EQ(outcome.problem, "");
  if (one.judge) return one.judge(outcome);
  EXPECT_FALSE(outcome.end.timed_out);
  EXPECT_EQ(outcome.end.exit_code, one.exit_code) << "signal " << outcome.end.signal;
  for (const std::string& word : one.words) EXPECT_THAT(said, HasSubstr(word));
  EXPECT_EQ(outcome.end.standard_output, "");
  EXPECT_THAT(outcome.faulty, IsEmpty());
  EXPECT_EQ(outcome.laser_on_s, 0);
  const RecordingLook& recording = outcome.recording;
  EXPECT_FALSE(recording.value_s) << *recording.value_s;
  if (one.recorded == Recorded::kNoFolder) {
    EXPECT_FALSE(recording.folder);
  }
  if (one.recorded == Recorded::kSomeLines) {
    EXPECT_GE(recording.videos, 2);
    EXPECT_GT(recording.told_frames, 100);
    EXPECT_GE(recording.sweeps, 2);
    // None where a busy computer told too little of the frames' times.
    if (recording.scan) {
      EXPECT_EQ(recording.exit_code, kNotTrusted) << recording.said;
    }
    EXPECT_THAT(said, HasSubstr("rec"));
  }
}

INSTANTIATE_TEST_SUITE_P(Fault, CalibrateWith, testing::ValuesIn(AllCases()),
                         [](const auto& one) { return one.param.scenario.name; });

}  // namespace
}  // namespace trammel::test
