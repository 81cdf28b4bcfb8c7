// Two hundred calibrations in which something goes wrong at a random moment; and how well frames
// are placed and how much of the computer a scan takes at full size. Prints its figures; fails
// where a machine was left unsafe, a recording was lost or a broken scan gave a number.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>

#include "base/random.h"
#include "frame_truth.h"
#include "play_all.h"
#include "sim/camera_http.h"

namespace trammel::test {
namespace {

using sim::CameraFaultKind;
using sim::VirtualKlipper;

constexpr double kTruth_s = 0.03;
constexpr double kLaserLimit_s = 8;
constexpr double kLongest_s = 42;  // moments are drawn within the length of a quick calibration
constexpr double kSlack_s = 0.002;
constexpr int kWidth = 5;
constexpr std::uint64_t kFirstSeed = 1000;

int FromEnvironment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::max(1, std::atoi(text));
}

using Strike = std::function<void(MachineShop&, TrammelProcess&, Random&)>;

struct Kind {
  const char* name;
  Strike strike;
  bool reachable = true;  ///< the printer can be reached, at last
};

Strike Klipper(std::function<void(VirtualKlipper&)> change) {
  return [change](MachineShop& shop, TrammelProcess&, Random&) { shop.With(change); };
}
Strike Signal(int signal) {
  return [signal](MachineShop&, TrammelProcess& process, Random&) { process.Send(signal); };
}
Strike Camera(CameraFaultKind kind, bool brief = false) {
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
Strike Disconnect(double least_s, double most_s) {
  return [=](MachineShop& shop, TrammelProcess&, Random& random) {
    sim::ServerFaults faults;
    faults.close_at_s = 0;
    faults.refuse_for_s = random.Uniform(least_s, most_s);
    shop.server().Inject(faults);
  };
}

const std::vector<Kind>& Kinds() {
  static const std::vector<Kind> kinds = {
      {"move refused", Klipper([](VirtualKlipper& klipper) {
         klipper.faults().refuse_move = klipper.xy_moves + 1;
       })},
      {"nozzle heater fails",
       Klipper([](VirtualKlipper& klipper) { klipper.nozzle.highest_reach_c = 60; })},
      {"bed heater fails",
       Klipper([](VirtualKlipper& klipper) { klipper.bed.highest_reach_c = 20; })},
      {"LASER_ON vanishes",
       Klipper([](VirtualKlipper& klipper) { klipper.macros().erase("LASER_ON"); })},
      {"short disconnect", Disconnect(0, 4)},
      {"long disconnect", Disconnect(10, 30)},
      {"lost for good", Disconnect(1e5, 1e6), false},
      {"restart", Klipper([](VirtualKlipper& klipper) { klipper.Restart(); })},
      {"emergency stop", Klipper([](VirtualKlipper& klipper) { klipper.EmergencyStop(); })},
      {"Ctrl-C", Signal(SIGINT)},
      {"SIGTERM", Signal(SIGTERM)},
      {"SIGKILL", Signal(SIGKILL), false},
      {"camera stalls", Camera(CameraFaultKind::kStall, true)},
      {"camera closes", Camera(CameraFaultKind::kClose, true)},
      {"half a JPEG", Camera(CameraFaultKind::kHalfJpeg, true)},
      {"picture size changes", Camera(CameraFaultKind::kSizeChange)},
      {"capture times jump", Camera(CameraFaultKind::kTimeJump)},
      {"frames are dropped", Camera(CameraFaultKind::kDropFrames)},
      {"black frames", Camera(CameraFaultKind::kBlack, true)},
      {"laser unplugged", Camera(CameraFaultKind::kLaserAbsent)},
      {"disk full", {}},
  };
  return kinds;
}

Scenario RandomFault(int number, const Kind& kind) {
  const std::uint64_t seed = kFirstSeed + static_cast<std::uint64_t>(number);
  Scenario scenario;
  scenario.name = std::to_string(number);
  scenario.prepare = [seed](ShopOptions& options) {
    options.seed = seed;
    options.pressure_advance_s = kTruth_s;
    options.klipper = QuickKlipper(kLaserLimit_s);
  };
  scenario.before = [](MachineShop& shop) { shop.Script(kWorkedWith); };
  scenario.patience_s = kind.reachable ? 5 : kLaserLimit_s + 1;
  Random random(seed);
  const double moment_s = random.Uniform(0, kLongest_s);
  if (!kind.strike) {
    scenario.limits.file_bytes = static_cast<std::uint64_t>(random.Uniform(2e4, 8e5));
    return scenario;
  }
  scenario.strike = [=, strike = kind.strike](MachineShop& shop, TrammelProcess& process) mutable {
    const double until_s = sim::MonotonicNow() + moment_s;
    while (process.Running() && sim::MonotonicNow() < until_s) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    strike(shop, process, random);
  };
  return scenario;
}

// What is wrong with an outcome; empty where nothing is.
std::vector<std::string> Violations(const Kind& kind, const Outcome& outcome) {
  std::vector<std::string> wrong;
  if (!outcome.problem.empty()) wrong.push_back("did not come about: " + outcome.problem);
  if (outcome.end.timed_out) wrong.push_back("trammel did not end");
  if (outcome.end.signal != 0 && outcome.end.signal != SIGKILL) {
    wrong.push_back(fmt::format("trammel crashed with signal {}", outcome.end.signal));
  }
  if (outcome.end.standard_error.find("this is a bug") != std::string::npos) {
    wrong.push_back("a bug in trammel");
  }
  // A restart that came before anything was touched took the user's values with it, not trammel.
  const bool touched =
      outcome.end.standard_error.find("bringing back what was set before") != std::string::npos;
  const bool restarted = outcome.after.restarts > outcome.before.restarts;
  if (kind.reachable && (touched || !restarted)) {
    for (const std::string& fault : outcome.faulty) wrong.push_back("unsafe: " + fault);
  }
  if (outcome.after.laser || outcome.laser_on_s > kLaserLimit_s + 0.1) {
    wrong.push_back(fmt::format("unsafe: the laser was on for {:.1f} s", outcome.laser_on_s));
  }
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
  return wrong;
}

struct Tally {
  int runs = 0, unsafe = 0, lost = 0, numbers = 0, other = 0;
  int recorded = 0, scans = 0, answers = 0;
  std::map<int, int> exits;
};

void Count(const Outcome& outcome, const std::vector<std::string>& wrong, Tally& tally) {
  const auto any = [&](const char* begin) {
    return std::any_of(wrong.begin(), wrong.end(),
                       [&](const std::string& one) { return one.rfind(begin, 0) == 0; });
  };
  ++tally.runs;
  tally.unsafe += any("unsafe");
  tally.lost += any("lost");
  tally.numbers += any("number");
  tally.other += any("did not") || any("trammel") || any("a bug");
  tally.recorded += outcome.recording.videos > 0;
  tally.scans += outcome.recording.scan;
  tally.answers += outcome.recording.value_s.has_value();
  ++tally.exits[outcome.end.signal != 0 ? -outcome.end.signal : outcome.end.exit_code];
}

void PrintRow(const std::string& name, const Tally& tally) {
  std::string exits;
  for (const auto& [code, count] : tally.exits) exits += fmt::format(" {}x{}", code, count);
  fmt::print("{:<22}{:>5}{:>9}{:>7}{:>9}{:>8}{:>7}{:>9}{:>9}   {}\n", name, tally.runs,
             tally.unsafe, tally.lost, tally.numbers, tally.other, tally.recorded, tally.scans,
             tally.answers, exits);
}

TEST(FaultStudy, EveryPrinterIsLeftSafeNoRecordingIsLostNoBrokenScanGivesANumber) {
  const int runs = FromEnvironment("TRAMMEL_STUDY_RUNS", 200);
  SideBySide side(std::min(SideBySide::kMost, FromEnvironment("TRAMMEL_STUDY_WIDTH", kWidth)));
  const auto& kinds = Kinds();
  const auto kind_of = [&](int number) -> const Kind& {
    return kinds[static_cast<std::size_t>(number) % kinds.size()];
  };
  for (int i = 0; i < runs; ++i) side.Start(RandomFault(i, kind_of(i)));
  std::map<std::string, Tally> by_kind;
  Tally all;
  for (int i = 0; i < runs; ++i) {
    const Outcome& outcome = side.Of(std::to_string(i));
    const auto wrong = Violations(kind_of(i), outcome);
    Count(outcome, wrong, by_kind[kind_of(i).name]);
    Count(outcome, wrong, all);
    for (const std::string& one : wrong) {
      ADD_FAILURE() << "seed " << kFirstSeed + static_cast<std::uint64_t>(i) << ", "
                    << kind_of(i).name << ": " << one << "\n"
                    << outcome.end.standard_error;
    }
  }
  fmt::print("{:<22}{:>5}{:>9}{:>7}{:>9}{:>8}{:>7}{:>9}{:>9}   {}\n", "fault", "runs", "unsafe",
             "lost", "numbers", "crashes", "videos", "scan.json", "answers",
             "exit codes x runs (negative: signals)");
  for (const auto& [name, tally] : by_kind) PrintRow(name, tally);
  PrintRow("all", all);
}

struct Mode {
  const char* name;
  sim::CameraHeaders headers;
};

TEST(FaultStudy, EveryFrameIsWithin50MicronsWith50MillisecondsOfJitter) {
  constexpr double kPlace_mm = 0.05;
  constexpr int kSeeds = 4;
  for (const Mode& mode : {Mode{"ustreamer 6", sim::CameraHeaders::kUstreamer6},
                           Mode{"ustreamer 4", sim::CameraHeaders::kUstreamer4},
                           Mode{"no times", sim::CameraHeaders::kNone}}) {
    std::vector<std::unique_ptr<MachineShop>> shops;
    std::vector<std::unique_ptr<TrammelProcess>> processes;
    for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + kSeeds; ++seed) {
      ShopOptions options;
      options.seed = seed;
      options.camera.headers = mode.headers;
      options.camera.latency_jitter_s = 0.05;
      options.camera.frames_per_s = 30;
      options.config["camera"] = "";
      shops.push_back(std::make_unique<MachineShop>(options));
      processes.push_back(shops.back()->Calibrate(
          {"--set", "speed=6.6667", "--set", "fps=30", "--set",
           "pressure_advances=[0.015,0.018,0.021,0.024,0.027,0.03,0.033,0.036,0.039,0.042]"}));
    }
    double worst_mm = 0;
    std::size_t frames = 0, unplaced = 0;
    for (std::size_t i = 0; i < shops.size(); ++i) {
      const ProcessEnd end = processes[i]->Wait(240);
      const auto folder = shops[i]->folder() / "rec";
      if (!std::filesystem::exists(folder / "scan.json")) {
        ADD_FAILURE() << mode.name << ": no scan.json: " << end.standard_error;
        continue;
      }
      const PlacedFrames placed = CompareWithTruth(folder, shops[i]->camera().truth());
      EXPECT_EQ(placed.unmatched, 0) << mode.name;
      for (const double error_mm : placed.error_mm) {
        worst_mm = std::max(worst_mm, std::abs(error_mm));
      }
      frames += placed.error_mm.size();
      unplaced += static_cast<std::size_t>(placed.unplaced);
    }
    fmt::print("{:<12} {} scans, {} frames placed, {} not, largest error {:.4f} mm\n", mode.name,
               shops.size(), frames, unplaced, worst_mm);
    EXPECT_GT(frames, 0U) << mode.name;
    EXPECT_LE(worst_mm, kPlace_mm) << mode.name;
  }
}

TEST(FaultStudy, AScanAtFullSizeTakesLessThan150MegabytesAndLessThanOneCore) {
  constexpr double kMost_mb = 150;
  ShopOptions options;
  options.camera = {};
  MachineShop shop(options);
  const auto process = shop.Calibrate({"--set", "speed=6.6667", "--set", "fps=30"});
  double swept_mb = 0;
  while (process->Running()) {
    if (process->StandardErrorSoFar().find("bringing back") == std::string::npos) {
      swept_mb = process->PeakMemorySoFar_mb();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const ProcessEnd end = process->Wait(1);
  fmt::print(
      "1280 x 720 px at 30 frames/s: {:.0f} MB until the last sweep, {:.0f} MB with the "
      "analysis; {:.1f} s of processor in {:.1f} s: {:.2f} cores; exit code {}\n",
      swept_mb, end.peak_memory_mb, end.cpu_s, end.elapsed_s, end.cpu_s / end.elapsed_s,
      end.exit_code);
  EXPECT_EQ(end.exit_code, 0) << end.standard_error;
  EXPECT_LT(swept_mb, kMost_mb);
  EXPECT_LT(end.cpu_s / end.elapsed_s, 1);
}

}  // namespace
}  // namespace trammel::test
