// Whole calibrations with the default pattern in real time, over real sockets, under the paper's
// twelve conditions: what `trammel pa calibrate` answers beside what the printer really is.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <future>
#include <nlohmann/json.hpp>
#include <semaphore>
#include <string>
#include <vector>

#include "base/random.h"
#include "frame_truth.h"
#include "machine_shop.h"
#include "sim/conditions.h"
#include "sim/world.h"
#include "support/temporary_folder.h"

namespace trammel::test {
namespace {

constexpr std::uint64_t kFirstSeed = 1000;
constexpr int kWidth = 4;  // each takes a quarter of a core, mostly the camera's
constexpr double kLimit_s = 600;
constexpr double kWithin_s = 0.002;
constexpr double kPlace_mm = 0.05;

// Low temperatures are reached sooner; pattern, speeds and scan are the defaults.
const char* const kSettings = R"([filament]
nozzle_temperature = 190
idle_nozzle_temperature = 170
bed_temperature = 40
[scan]
lights_off_gcode = "LIGHTS_OFF"
lights_on_gcode = "LIGHTS_ON"
)";

struct Row {
  std::uint64_t seed = 0;
  std::string condition;
  double truth_s = 0;
  std::string verdict;  ///< empty: trammel failed
  std::string said;
  double value_s = 0, low_s = 0, high_s = 0;
  double worst_mm = 0;  ///< of the scored frames' positions
  std::vector<std::string> faulty;
};

Row Calibrate(std::uint64_t seed, const sim::Condition& condition) {
  Row row;
  row.seed = seed;
  row.condition = sim::ToString(condition);
  row.truth_s = sim::TruthOf(seed, {0, 0.06});  // the default pattern tests 0 … 0.06
  ShopOptions options;
  options.seed = seed;
  options.pressure_advance_s = row.truth_s;
  options.camera.condition = condition;
  options.camera.frames_per_s = 30;
  options.camera.view.frame_width_px = 320;
  options.camera.view.frame_height_px = 240;
  options.camera.latency_jitter_s = 0.05;
  MachineShop shop(options);
  WriteWhole(shop.folder() / "full.toml", kSettings);
  const PrinterLook before = shop.Look();
  const ProcessEnd end = shop.Run({"pa", "calibrate", "--config", "full.toml", "--printer",
                                   shop.address(), "--out", "rec", "--json"},
                                  kLimit_s);
  row.faulty = shop.Faulty(before);
  const auto answer = nlohmann::json::parse(end.standard_output, nullptr, false);
  if (!answer.is_object()) {
    row.said = end.standard_error;
    return row;
  }
  row.verdict = answer["verdict"];
  row.said = answer["reason"];
  for (const double error_mm :
       CompareWithTruth(shop.folder() / "rec", shop.camera().truth()).error_mm) {
    row.worst_mm = std::max(row.worst_mm, std::abs(error_mm));
  }
  if (row.verdict != "good") return row;
  row.value_s = answer["pressure_advance_s"];
  row.low_s = answer["interval95_s"][0];
  row.high_s = answer["interval95_s"][1];
  return row;
}

std::vector<Row> CalibrateAll(int count) {
  std::counting_semaphore<kWidth> free(kWidth);
  std::vector<std::future<Row>> running;
  const auto conditions = sim::AllConditions();
  for (int i = 0; i < count; ++i) {
    const sim::Condition condition = conditions[static_cast<std::size_t>(i) % conditions.size()];
    running.push_back(std::async(std::launch::async, [&free, i, condition] {
      free.acquire();
      Row row = Calibrate(kFirstSeed + static_cast<std::uint64_t>(i), condition);
      free.release();
      return row;
    }));
  }
  std::vector<Row> rows;
  for (auto& one : running) rows.push_back(one.get());
  return rows;
}

TEST(CalibrationStudy, FindsWhatThePrinterReallyIs) {
  const char* asked = std::getenv("TRAMMEL_CALIBRATIONS");
  const std::vector<Row> rows = CalibrateAll(asked == nullptr ? 24 : std::max(1, std::atoi(asked)));
  int good = 0, within = 0, inside = 0;
  double worst_mm = 0;
  for (const Row& row : rows) {
    fmt::print("{} {:<22} truth {:.4f}  ", row.seed, row.condition, row.truth_s);
    if (row.verdict == "good") {
      ++good;
      within += std::abs(row.value_s - row.truth_s) <= kWithin_s;
      inside += row.low_s <= row.truth_s && row.truth_s <= row.high_s;
      fmt::print("{:.4f} ({:.4f} ... {:.4f})  {:+.1f} ms", row.value_s, row.low_s, row.high_s,
                 1e3 * (row.value_s - row.truth_s));
    } else {
      fmt::print("{}: {}", row.verdict.empty() ? "failed" : row.verdict, row.said);
    }
    fmt::print("; frames at most {:.3f} mm off\n", row.worst_mm);
    worst_mm = std::max(worst_mm, row.worst_mm);
    EXPECT_TRUE(row.faulty.empty()) << row.seed << ": " << row.faulty.front();
    EXPECT_FALSE(row.verdict.empty()) << row.seed << ": " << row.said;
  }
  fmt::print(
      "{} calibrations: {} good, {} within {:.0f} ms, {} inside the 95 % interval; frames at "
      "most {:.3f} mm off\n",
      rows.size(), good, within, 1e3 * kWithin_s, inside, worst_mm);
  EXPECT_LT(worst_mm, kPlace_mm);
  EXPECT_GE(within, 0.95 * good);
  EXPECT_GE(inside, 0.9 * good);
  EXPECT_GE(good, 0.9 * static_cast<double>(rows.size()));
}

}  // namespace
}  // namespace trammel::test
