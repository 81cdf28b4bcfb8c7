// Five hundred calibrations in which something goes wrong, each kind of fault in each stage in
// turn; and how well frames are placed and how much of the computer a scan takes at full size.
// Prints its figures; fails where a machine was left unsafe, a recording was lost or a broken scan
// gave a number.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <thread>

#include "fault_kinds.h"
#include "frame_truth.h"
#include "play_all.h"
#include "support/study.h"

namespace trammel::test {
namespace {

constexpr int kWidth = 5;
constexpr std::uint64_t kFirstSeed = 1000;

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
  fmt::print("{:<26}{:>5}{:>9}{:>7}{:>9}{:>8}{:>7}{:>9}{:>9}   {}\n", name, tally.runs,
             tally.unsafe, tally.lost, tally.numbers, tally.other, tally.recorded, tally.scans,
             tally.answers, exits);
}

TEST(FaultStudy, EveryPrinterIsLeftSafeNoRecordingIsLostNoBrokenScanGivesANumber) {
  const StudySeeds seeds = SeedsOfStudy(500, kFirstSeed);
  SideBySide side(kWidth);
  const auto& kinds = FaultKinds();
  const auto& stages = StageText();
  // The numbers of kinds and of stages have no common divisor: all pairs come in turn.
  ASSERT_EQ(std::gcd(kinds.size(), stages.size()), 1U);
  const auto kind_of = [&](std::uint64_t seed) -> const FaultKind& {
    return kinds[seed % kinds.size()];
  };
  const auto stage_of = [&](std::uint64_t seed) -> const std::string& {
    return stages[seed % stages.size()];
  };
  const std::uint64_t end = seeds.first + static_cast<std::uint64_t>(seeds.count);
  for (std::uint64_t seed = seeds.first; seed < end; ++seed) {
    Scenario scenario = FaultInStage(kind_of(seed), stage_of(seed), seed);
    scenario.name = std::to_string(seed);
    side.Start(scenario);
  }
  std::map<std::string, Tally> by_kind;
  Tally all;
  for (std::uint64_t seed = seeds.first; seed < end; ++seed) {
    const Outcome& outcome = side.Of(std::to_string(seed));
    const auto wrong = Violations(kind_of(seed), outcome);
    Count(outcome, wrong, by_kind[kind_of(seed).name]);
    Count(outcome, wrong, all);
    for (const std::string& one : wrong) {
      ADD_FAILURE() << "seed " << seed << ", " << kind_of(seed).name << " at \"" << stage_of(seed)
                    << "\": " << one << "\n"
                    << outcome.end.standard_error;
    }
  }
  fmt::print("{:<26}{:>5}{:>9}{:>7}{:>9}{:>8}{:>7}{:>9}{:>9}   {}\n", "fault", "runs", "unsafe",
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
      options.hurry = 1;
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
      const ProcessEnd end = processes[i]->Wait();
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
  constexpr double kMax_mb = 150;
  ShopOptions options;
  options.hurry = 1;
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
  EXPECT_LT(swept_mb, kMax_mb);
  EXPECT_LT(end.cpu_s / end.elapsed_s, 1);
}

}  // namespace
}  // namespace trammel::test
