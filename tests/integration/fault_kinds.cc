#include "fault_kinds.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "sim/camera/camera_http.h"
#include "sim/moonraker/test_client.h"

namespace trammel::test {
namespace {

using sim::CameraFaultKind;
using sim::VirtualKlipper;

constexpr int kSoftwareBug = 70;
constexpr const char* kForeignFile = "somebody_elses.gcode";
constexpr double kForeignNozzle_c = 201;

RandomStrike Klipper(std::function<void(VirtualKlipper&)> change) {
  return [change](MachineShop& shop, TrammelProcess&, Random&) { shop.With(change); };
}

RandomStrike Signal(int signal) {
  return [signal](MachineShop&, TrammelProcess& process, Random&) { process.Send(signal); };
}

// A second signal comes while the first one's restoring goes on.
RandomStrike SignalTwice(int signal) {
  return [signal](MachineShop&, TrammelProcess& process, Random& random) {
    process.Send(signal);
    std::this_thread::sleep_for(std::chrono::duration<double>(random.Uniform(0, 0.5)));
    process.Send(signal);
  };
}

RandomStrike Camera(CameraFaultKind kind, bool brief = false) {
  return [=](MachineShop& shop, TrammelProcess&, Random& random) {
    sim::CameraFault fault;
    fault.kind = kind;
    if (brief) fault.duration_s = random.Uniform(0, 4);
    fault.fraction = random.Uniform(0.1, 0.9);
    fault.jump_s = random.Uniform(-5, 5);
    fault.width_px = fault.height_px = 96;
    shop.camera().Inject(fault);
  };
}

RandomStrike Disconnect(double min_s, double max_s) {
  return [=](MachineShop& shop, TrammelProcess&, Random& random) {
    sim::ServerFaults faults;
    faults.close_at_s = 0;
    faults.refuse_for_s = random.Uniform(min_s, max_s);
    shop.server().Inject(faults);
  };
}

RandomStrike ScriptFromScreen(const std::string& gcode) {
  return [gcode](MachineShop& shop, TrammelProcess&, Random&) {
    shop.With([&](VirtualKlipper& klipper) { klipper.RunScript(gcode); });
  };
}

// Another front end starts a job of its own. Klipper refuses it while a file is being printed.
void StartForeignPrint(MachineShop& shop, TrammelProcess& process, Random&) {
  std::string file = fmt::format("M104 S{}\n", kForeignNozzle_c);
  for (int i = 0; i < 1000; ++i) file += "G4 P1000\n";
  shop.With([&](VirtualKlipper& klipper) { klipper.files()[kForeignFile] = file; });
  sim::TestClient screen(shop.server().port());
  while (process.Running()) {  // trammel's own job, where there is one, has to end first
    bool printing = true;
    shop.With([&](VirtualKlipper& klipper) {
      printing = klipper.print.state == "printing" || klipper.print.state == "paused";
    });
    if (!printing) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const auto answer = screen.Call("printer.print.start", {{"filename", kForeignFile}});
  if (answer.contains("error")) {
    throw std::runtime_error("the other job was refused: " + answer.dump());
  }
}

// A second trammel is told that there is one already; it touches nothing.
void SecondTrammel(MachineShop& shop, TrammelProcess& process, Random&) {
  if (!process.Running()) return;
  const ProcessEnd second =
      shop.Run({"pa", "calibrate", "--out", "rec_second", "--printer", shop.address()});
  if (!process.Running()) return;  // the first one ended meanwhile: the second may do as it likes
  if (second.exit_code != 3 && second.exit_code != 4) {
    throw std::runtime_error(fmt::format("the second trammel ended with {}:\n{}", second.exit_code,
                                         second.standard_error));
  }
}

// Whatever the dead run left, the next one finds it, works, and leaves the printer safe.
void RunOnceMore(MachineShop& shop, Outcome& outcome) {
  const ProcessEnd second =
      shop.Run({"pa", "calibrate", "--out", "rec_second", "--printer", shop.address()});
  outcome.end.standard_error += "\n--- the next run ---\n" + second.standard_error;
  if (second.signal != 0 || (second.exit_code != 0 && second.exit_code != 2)) {
    throw std::runtime_error(
        fmt::format("the run after the dead one ended with {}", second.exit_code));
  }
}

std::vector<FaultKind> OfThePrinter() {
  return {
      {"move refused", Klipper([](VirtualKlipper& klipper) {
         klipper.faults().refuse_move = klipper.xy_moves + 1;
       })},
      {"nozzle heater fails",
       Klipper([](VirtualKlipper& klipper) { klipper.nozzle.highest_reach_c = 60; })},
      {"bed heater fails",
       Klipper([](VirtualKlipper& klipper) { klipper.bed.highest_reach_c = 20; })},
      {"_LASER_ON vanishes",
       Klipper([](VirtualKlipper& klipper) { klipper.macros().erase("_LASER_ON"); })},
      {"short disconnect", Disconnect(0, 4)},
      {"long disconnect", Disconnect(10, 30)},
      {"lost for good", Disconnect(1e5, 1e6), false},
      {"restart", Klipper([](VirtualKlipper& klipper) { klipper.Restart(); })},
      {"emergency stop", Klipper([](VirtualKlipper& klipper) { klipper.EmergencyStop(); })},
      {"M84 from the screen", ScriptFromScreen("M84")},
      {"another's job", StartForeignPrint, true, true},
      {"a second trammel", SecondTrammel},
  };
}

std::vector<FaultKind> OfTheProcess() {
  return {
      {"Ctrl-C", Signal(SIGINT)},
      {"Ctrl-C twice", SignalTwice(SIGINT)},
      {"SIGTERM", Signal(SIGTERM)},
      {"SIGHUP", Signal(SIGHUP)},
      {"SIGPIPE", Signal(SIGPIPE)},
      {"SIGQUIT", Signal(SIGQUIT)},
      {"SIGXFSZ", Signal(SIGXFSZ)},
      {"SIGXCPU", Signal(SIGXCPU)},
      {"SIGALRM", Signal(SIGALRM)},
      {"SIGUSR1", Signal(SIGUSR1)},
      {"SIGUSR2", Signal(SIGUSR2)},
      {"SIGVTALRM", Signal(SIGVTALRM)},
      {"SIGPROF", Signal(SIGPROF)},
      {"SIGKILL", Signal(SIGKILL), false},
      {.name = "nobody reads its output",
       .prepare = [](Scenario& scenario, Random&) { scenario.limits.nobody_reads = true; }},
      {.name = "disk full",
       .prepare =
           [](Scenario& scenario, Random& random) {
             scenario.limits.file_bytes = static_cast<std::uint64_t>(random.Uniform(2e4, 8e5));
           }},
      {.name = "too many open files",
       .prepare =
           [](Scenario& scenario, Random& random) {
             scenario.limits.open_files = static_cast<std::uint64_t>(random.Uniform(8, 32));
           }},
      {.name = "SIGKILL, then a run",
       .strike = Signal(SIGKILL),
       .prepare = [](Scenario& scenario, Random&) { scenario.after = RunOnceMore; }},
  };
}

std::vector<FaultKind> OfTheCamera() {
  return {
      {"camera stalls", Camera(CameraFaultKind::kStall, true)},
      {"camera closes", Camera(CameraFaultKind::kClose, true)},
      {"half a JPEG", Camera(CameraFaultKind::kHalfJpeg, true)},
      {"picture size changes", Camera(CameraFaultKind::kSizeChange)},
      {"capture times jump", Camera(CameraFaultKind::kTimeJump)},
      {"frames are dropped", Camera(CameraFaultKind::kDropFrames)},
      {"black frames", Camera(CameraFaultKind::kBlack, true)},
      {"laser unplugged", Camera(CameraFaultKind::kLaserAbsent)},
  };
}

// Until the stage has begun, and then for a part of it.
void WaitForStage(TrammelProcess& process, const std::string& word, Random& random) {
  constexpr std::chrono::milliseconds kLook(5);
  while (process.Running() && process.StandardErrorSoFar().find(word) == std::string::npos) {
    std::this_thread::sleep_for(kLook);
  }
  const auto until =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(random.Uniform(0, 1.5));
  while (process.Running() && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(kLook);
  }
}

// Heaters, limits and G-code state belong to a foreign job from its beginning: to bring them back
// would be to meddle with it. Laser and lights are trammel's own to the end.
bool OfForeignPrint(const std::string& fault) {
  return fault != "the laser is on" && fault.rfind("the lights are", 0) != 0;
}

// A dead run's heaters are off after the next run, or as they were before it. Heaters that an error
// of the print switched off stay off.
bool OffRatherThanBefore(const std::string& fault) {
  return fault.rfind("nozzle target is 0 ", 0) == 0 || fault.rfind("bed target is 0 ", 0) == 0;
}

void JudgeMachine(const FaultKind& kind, const Outcome& outcome, std::vector<std::string>& wrong) {
  // A restart that came before anything was touched took the user's values with it, not trammel.
  const bool touched =
      outcome.end.standard_error.find("bringing back what was set before") != std::string::npos;
  const bool restarted = outcome.after.restarts > outcome.before.restarts;
  const bool had_successor =
      outcome.end.standard_error.find("--- the next run ---") != std::string::npos;
  const bool said_off = outcome.end.standard_error.find("they stay off") != std::string::npos;
  if (kind.reachable && (touched || !restarted)) {
    for (const std::string& fault : outcome.faulty) {
      if (kind.foreign_print && OfForeignPrint(fault)) continue;
      if ((had_successor || said_off) && OffRatherThanBefore(fault)) continue;
      wrong.push_back("unsafe: " + fault);
    }
  }
  // The run after a dead one lights the laser, too.
  const bool too_long = !had_successor && outcome.laser_on_s > kLaserLimit_s + 0.1;
  if (outcome.after.laser || too_long) {
    wrong.push_back(fmt::format("unsafe: the laser was on for {:.1f} s", outcome.laser_on_s));
  }
  if (!kind.foreign_print || !outcome.problem.empty()) return;
  if (!outcome.after.printing || outcome.after.print_file != kForeignFile) {
    wrong.push_back("unsafe: the other's job was ended");
  } else if (outcome.after.nozzle_target_c != kForeignNozzle_c) {
    wrong.push_back(fmt::format("unsafe: the other's nozzle was set from {} to {} degC",
                                kForeignNozzle_c, outcome.after.nozzle_target_c));
  }
}

void JudgeRecording(const Outcome& outcome, std::vector<std::string>& wrong) {
  constexpr double kSlack_s = 0.002;  // beyond 95 %: one in twenty may lie outside
  const RecordingLook& recording = outcome.recording;
  if (recording.kept_frames < recording.told_frames) {
    wrong.push_back(fmt::format("lost: {} of {} frames",
                                recording.told_frames - recording.kept_frames,
                                recording.told_frames));
  }
  if (recording.scan && recording.exit_code != 0 && recording.exit_code != 2) {
    wrong.push_back("lost: scan.json cannot be read: " + recording.said);
  }
  if (recording.value_s &&
      (*recording.low_s > kTruth_s + kSlack_s || *recording.high_s < kTruth_s - kSlack_s)) {
    wrong.push_back(fmt::format("number: {:.4f} s within {:.4f} ... {:.4f}", *recording.value_s,
                                *recording.low_s, *recording.high_s));
  }
  if (recording.value_s && outcome.end.exit_code != 0 && recording.notices.empty()) {
    wrong.push_back("number: from a scan that was cut short, and nothing says so");
  }
}

}  // namespace

const std::vector<FaultKind>& FaultKinds() {
  static const std::vector<FaultKind> kinds = [] {
    std::vector<FaultKind> all = OfThePrinter();
    for (const auto& more : {OfTheProcess(), OfTheCamera()}) {
      all.insert(all.end(), more.begin(), more.end());
    }
    return all;
  }();
  return kinds;
}

const std::vector<std::string>& StageText() {
  static const std::vector<std::string> words = {"",
                                                 "checking the printer",
                                                 "looking at the camera",
                                                 "homing",
                                                 "uploading the pattern",
                                                 "heating heater_bed",
                                                 "heating extruder",
                                                 "printing the pattern",
                                                 "letting extruder cool",
                                                 "moving the camera",
                                                 "scanning line 1 of",
                                                 "scanning line 4 of",
                                                 "bringing back"};
  return words;
}

Scenario FaultInStage(const FaultKind& kind, const std::string& stage_word, std::uint64_t seed) {
  Random random(seed);
  Scenario scenario;
  scenario.prepare = [seed](ShopOptions& options) {
    options.seed = seed;
    options.pressure_advance_s = kTruth_s;
    options.klipper = QuickKlipper(kLaserLimit_s);
  };
  scenario.before = [](MachineShop& shop) { shop.Script(kWorkedWith); };
  scenario.patience_s = kind.reachable ? 5 : kLaserLimit_s + 1;
  if (kind.prepare) kind.prepare(scenario, random);
  if (!kind.strike) return scenario;
  scenario.strike = [=, strike = kind.strike](MachineShop& shop, TrammelProcess& process) mutable {
    WaitForStage(process, stage_word, random);
    strike(shop, process, random);
  };
  return scenario;
}

namespace {

// True if another's signal ended it before its first output: so young a process has no handler, and
// has done nothing yet.
bool EndedBeforeItBegan(const Outcome& outcome) {
  constexpr std::array kOwn = {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGSYS};
  const bool own = std::find(kOwn.begin(), kOwn.end(), outcome.end.signal) != kOwn.end();
  return !own && outcome.end.standard_error.empty();
}

}  // namespace

std::vector<std::string> Violations(const FaultKind& kind, const Outcome& outcome) {
  std::vector<std::string> wrong;
  if (!outcome.problem.empty()) wrong.push_back("did not come about: " + outcome.problem);
  if (outcome.end.timed_out) wrong.push_back("trammel did not end");
  if (outcome.end.signal != 0 && outcome.end.signal != SIGKILL && !EndedBeforeItBegan(outcome)) {
    wrong.push_back(fmt::format("trammel crashed with signal {}", outcome.end.signal));
  }
  if (outcome.end.exit_code == kSoftwareBug ||
      outcome.end.standard_error.find("this is a bug") != std::string::npos) {
    wrong.push_back("a bug in trammel");
  }
  JudgeMachine(kind, outcome, wrong);
  JudgeRecording(outcome, wrong);
  return wrong;
}

}  // namespace trammel::test
