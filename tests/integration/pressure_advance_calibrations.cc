// Whole calibrations in real time over real sockets: what `trammel pa calibrate` answers beside
// what the virtual printer really is, with and without other work on the computer.
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "frame_truth.h"
#include "machine_shop.h"
#include "sim/print/conditions.h"
#include "sim/print/printer.h"
#include "support/study.h"

namespace trammel::test {
namespace {

constexpr double kWithin_s = 0.002;
constexpr double kPlace_mm = 0.15;  // at 20 mm/s: 7 ms

// Low temperatures are reached sooner; pattern, speeds and scan are the defaults.
const char* const kSettings = R"([filament]
nozzle_temperature = 190
idle_nozzle_temperature = 170
bed_temperature = 40
[scan]
lights_off_gcode = "LIGHTS_OFF"
lights_on_gcode = "LIGHTS_ON"
)";

struct Picture {
  int width_px = 320;
  int height_px = 240;
};

StudyAnswer Calibrate(std::uint64_t seed, const Picture& picture, bool places) {
  const auto conditions = sim::AllConditions();
  ShopOptions options;
  options.hurry = 1;
  options.seed = seed;
  options.pressure_advance_s = sim::TruthOf(seed);
  options.camera.condition = conditions[seed % conditions.size()];
  options.camera.frames_per_s = 30;
  options.camera.view.frame_width_px = picture.width_px;
  options.camera.view.frame_height_px = picture.height_px;
  options.camera.latency_jitter_s = 0.05;
  MachineShop shop(options);
  WriteWhole(shop.folder() / "full.toml", kSettings);
  const PrinterLook before = shop.Look();
  const ProcessEnd end = shop.Run({"pa", "calibrate", "--config", "full.toml", "--printer",
                                   shop.address(), "--out", "rec", "--json"});
  for (const std::string& fault : shop.Faulty(before)) ADD_FAILURE() << seed << ": " << fault;
  StudyAnswer result{Measured::Refused(end.standard_error),
                     {sim::TruthOf(seed), sim::TruthOf(seed)}};
  const auto answer = nlohmann::json::parse(end.standard_output, nullptr, false);
  EXPECT_TRUE(answer.is_object()) << seed << ": " << end.standard_error;
  if (!answer.is_object()) return result;
  if (answer["verdict"] == "good") {
    result.measured = Measured::Good({answer["pressure_advance_s"],
                                      answer["standard_uncertainty_s"],
                                      {answer["interval95_s"][0], answer["interval95_s"][1]}});
  } else {
    result.measured = Measured::CannotTell(answer["reason"]);
  }
  if (!places) return result;
  for (const double error_mm :
       CompareWithTruth(shop.folder() / "rec", shop.camera().truth()).error_mm) {
    EXPECT_LT(std::abs(error_mm), kPlace_mm) << seed << ": a frame's place";
  }
  return result;
}

/// Processes that do nothing but take the processor's time.
class BusyLoops {
 public:
  explicit BusyLoops(int count) {
    const pid_t parent = getpid();
    for (int i = 0; i < count; ++i) {
      const pid_t child = fork();
      if (child == 0) Spin(parent);
      if (child > 0) children_.push_back(child);
    }
  }
  BusyLoops(const BusyLoops&) = delete;
  BusyLoops& operator=(const BusyLoops&) = delete;
  ~BusyLoops() {
    for (const pid_t child : children_) {
      kill(child, SIGKILL);
      waitpid(child, nullptr, 0);
    }
  }
  [[nodiscard]] std::size_t count() const { return children_.size(); }

 private:
  [[noreturn]] static void Spin(pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    volatile unsigned turns = 0;
    for (;;) {
      turns = turns + 1;
      if (turns % 1000000 == 0 && getppid() != parent) _exit(0);
    }
  }
  std::vector<pid_t> children_;
};

TEST(PressureAdvanceCalibrations, FindWhatThePrinterReallyIs) {
  const StudyTally tally = TallyOf(
      RunSeeds(SeedsOfStudy(24), [](std::uint64_t seed) { return Calibrate(seed, {}, true); }));
  PrintStudyHead("ms");
  tally.Print("calibrations", 1e3);
  EXPECT_GE(tally.answered, 0.9 * tally.runs);
  EXPECT_GE(tally.Within(kWithin_s), 0.95 * tally.answered);
  EXPECT_GE(tally.held, 0.9 * tally.answered);
}

// The computer beside Klipper has other work; eight loops are more than two cores get done.
TEST(PressureAdvanceCalibrations, HoldBesideEightBusyLoops) {
  constexpr int kLoops = 8;
  const BusyLoops loops(kLoops);
  ASSERT_EQ(loops.count(), std::size_t{kLoops});
  const StudySeeds seeds = SeedsOfStudy(10, 2000);
  StudyTally tally;
  for (int i = 0; i < seeds.count; ++i) {
    const auto seed = seeds.first + static_cast<std::uint64_t>(i);
    const StudyAnswer answer = Calibrate(seed, {640, 480}, false);
    tally.Add(answer);
    if (answer.measured.good()) continue;
    EXPECT_NE(answer.measured.reason().find("busy"), std::string::npos)
        << seed << ": " << answer.measured.reason();
  }
  PrintStudyHead("ms");
  tally.Print("beside eight busy loops", 1e3);
  EXPECT_EQ(tally.Within(kWithin_s), tally.answered);
  EXPECT_GE(tally.answered, 0.9 * tally.runs);
}

}  // namespace
}  // namespace trammel::test
