// Several speeds of virtual printers whose lag depends on flow, by whatever law, or does not: what
// the table of `pa calibrate --speeds` makes of it. Prints what docs/calibrate.md quotes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/square.h"
#include "from_environment.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/flow/flow_table.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/pattern/pattern_presets.h"
#include "sim/camera/scan_recorder.h"
#include "sim/print/conditions.h"
#include "sim/print/printer.h"
#include "sim/print/world.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
using test::FromEnvironment;

constexpr double kSlow_mm_s = 10;  // of the default pattern
constexpr double kSpeeds_mm_s[] = {60, 100, 150};
constexpr double kBetween_mm_s[] = {75, 125};

// One printed, scanned and analysed pattern.
std::optional<pressure_advance::FlowPoint> Measure(const sim::PrinterTraits& traits,
                                                   double speed_mm_s, std::uint64_t seed,
                                                   const fs::path& folder) {
  pressure_advance::PatternConfig config;
  settings::ScanSettings scan;
  ApplyPreset(pressure_advance::kDefaultPreset, config, scan);
  config.material = "abs";
  EXPECT_EQ(config.segments.front().speed_mm_s, kSlow_mm_s);
  config.segments[1].speed_mm_s = speed_mm_s;
  const auto layout = pressure_advance::LayOut(config);
  const auto plan = sim::ParsePlan(
      files::FormatPlan(pressure_advance::MakePlan(layout, config, "pattern.gcode")));
  Random world(seed);
  Random print_random = world.Fork(static_cast<std::uint64_t>(speed_mm_s));
  const auto print =
      sim::PrintGcode(pressure_advance::WriteGcode(layout, config), traits, print_random);
  const auto conditions = sim::AllConditions();
  const sim::Condition& condition = conditions[seed % conditions.size()];
  Random random = sim::LaserEyeOf(seed, condition);
  const sim::LaserTraits eye = sim::DrawLaserTraits(condition, random);
  sim::ScanOptions options;
  options.scan_speed_mm_s = scan.scan_speed_mm_s;
  options.skip_mm = scan.skip_mm;
  options.frame_width_px = 160;
  options.frame_height_px = 120;
  fs::remove_all(folder);
  if (!print || !plan ||
      !sim::RecordScan(print->bed, *plan, condition, eye, options,
                       random.Fork(static_cast<std::uint64_t>(speed_mm_s)), folder)) {
    ADD_FAILURE() << "seed " << seed << " at " << speed_mm_s << " mm/s";
    return std::nullopt;
  }
  const auto run = app::AnalyseRecording(folder);
  fs::remove_all(folder);
  if (!run || !run->analysis.pressure_advance.good()) return std::nullopt;
  const double per_mm_s = Summarise(layout, config).peak_flow_mm3_s / speed_mm_s;
  return pressure_advance::FlowPoint{speed_mm_s * per_mm_s, kSlow_mm_s * per_mm_s,
                                     config.acceleration_mm_s2,
                                     run->analysis.pressure_advance.quantity()};
}

struct Outcome {
  std::optional<pressure_advance::FlowTable> table;
  sim::StorageLaw law;
  double miss_s = 0;         // of the law between the flows, root mean square
  double single_miss_s = 0;  // of the one value there
};

Outcome RunOne(std::uint64_t seed, const fs::path& scratch) {
  Random world(seed);
  Random truth = world.Fork(1), traits_random = world.Fork(2);
  sim::PrinterTraits traits = sim::DrawTraits(truth.Uniform(0.022, 0.045), traits_random);
  pressure_advance::PatternConfig config;
  const double per_mm_s =
      4 * pressure_advance::Summarise(pressure_advance::LayOut(config), config).peak_flow_mm3_s /
      (150 * std::numbers::pi * Square(traits.filament_diameter_mm));
  Outcome outcome;
  outcome.law = sim::ScaledTo(traits.law, traits.k_star_s, kSlow_mm_s * per_mm_s, 150 * per_mm_s);
  const auto ideal_s = [&](double speed_mm_s) {
    return sim::IdealPressureAdvance(outcome.law, kSlow_mm_s * per_mm_s, speed_mm_s * per_mm_s);
  };
  std::vector<pressure_advance::FlowPoint> points;
  for (const double speed : kSpeeds_mm_s) {
    traits.k_star_s = ideal_s(speed);
    const auto point =
        Measure(traits, speed, seed, scratch / fmt::format("{}-{:.0f}", seed, speed));
    if (point) points.push_back(*point);
  }
  auto table = pressure_advance::MakeFlowTable(points);
  if (!table) return outcome;
  for (const double speed : kBetween_mm_s) {
    const double area_mm2 = points.front().slow_flow_mm3_s / kSlow_mm_s;
    const double said_s =
        table->laws.firmware
            ? PressureAdvanceBetween(*table->laws.firmware, kSlow_mm_s * area_mm2, speed * area_mm2)
            : table->single_s.value;
    outcome.miss_s += Square(said_s - ideal_s(speed)) / std::size(kBetween_mm_s);
    outcome.single_miss_s +=
        Square(table->single_s.value - ideal_s(speed)) / std::size(kBetween_mm_s);
  }
  outcome.table = *std::move(table);
  return outcome;
}

TEST(FlowStudy, SaysHowTheValueGoesWithFlowWhateverTheExtruder) {
  const int seeds = FromEnvironment("TRAMMEL_STUDY_SEEDS", 40);
  const auto first =
      static_cast<std::uint64_t>(FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", 180000));
  const fs::path scratch = fs::temp_directory_path() / fmt::format("trammel-flow-{}", ::getpid());
  fs::create_directories(scratch);
  std::vector<Outcome> outcomes(static_cast<std::size_t>(seeds));
  std::atomic<std::size_t> next = 0;
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i) {
      threads.emplace_back([&] {
        for (std::size_t k = next++; k < outcomes.size(); k = next++) {
          outcomes[k] = RunOne(first + k, scratch);
        }
      });
    }
  }
  fs::remove_all(scratch);

  fmt::print(
      "\nlaw: printers, exponent told, its interval holds the truth (of a power), said to bend |\n"
      "answered at each speed, of these the rms miss between the speeds by the law (by the one "
      "value where it is said not to bend), by the one value (ms)\n");
  int powers = 0, held = 0, straight = 0, straight_bent = 0;
  for (const sim::StorageKind kind : {sim::StorageKind::kLinear, sim::StorageKind::kPower,
                                      sim::StorageKind::kTanh, sim::StorageKind::kReciprocal}) {
    int printers = 0, whole = 0, told = 0, holds = 0, bent = 0;
    double squares = 0, single_squares = 0;
    for (const Outcome& outcome : outcomes) {
      if (outcome.law.kind != kind || !outcome.table) continue;
      ++printers;
      const auto& laws = outcome.table->laws;
      if (outcome.table->rows.size() == std::size(kSpeeds_mm_s)) {
        ++whole;
        squares += outcome.miss_s, single_squares += outcome.single_miss_s;
      }
      bent += laws.bends;
      if (!laws.exponent.good()) continue;
      ++told;
      const double exponent = kind == sim::StorageKind::kPower ? outcome.law.exponent : 1;
      const Interval& interval = laws.exponent.quantity().interval95;
      holds += interval.lo <= exponent && exponent <= interval.hi;
    }
    const double n = std::max(1, whole);
    const bool is_power = kind == sim::StorageKind::kLinear || kind == sim::StorageKind::kPower;
    fmt::print("{:<10} {:>4} {:>4} {:>4} {:>4} | {:>4} {:.2f} {:.2f}\n", sim::ToString(kind),
               printers, told, is_power ? fmt::format("{}", holds) : "-", bent, whole,
               1e3 * std::sqrt(squares / n), 1e3 * std::sqrt(single_squares / n));
    if (is_power) powers += told, held += holds;
    if (kind == sim::StorageKind::kLinear) straight += printers, straight_bent += bent;
  }
  EXPECT_GE(held, 0.9 * powers);
  EXPECT_LE(straight_bent, 1 + 0.15 * straight);
}

}  // namespace
}  // namespace trammel
