// How wide, how bright and how dim a laser line may be before answers suffer, and what is said of
// it. Prints the table that docs/pressure-advance.md quotes.
//
// TRAMMEL_STUDY_SEEDS: prints per row and condition; TRAMMEL_STUDY_FIRST_SEED: of the first one.
// TRAMMEL_STUDY_ROW: only rows whose name holds it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "base/statistics.h"
#include "from_environment.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/files/plan_file.h"
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

/// Whether anything must be said of a line.
enum class Told { kNothing, kEither, kMostly };

/// One fault of the eye.
struct Fault {
  std::string name;
  Told told = Told::kEither;
  double widen = 1;     ///< times the line's width
  double brighten = 1;  ///< times the light of all of it
};

struct World {
  std::string gcode;
  sim::Plan plan;
  settings::ScanSettings scan;
};

World DefaultWorld() {
  pressure_advance::PatternConfig config;
  World world;
  ApplyPreset(pressure_advance::kDefaultPreset, config, world.scan);
  config.material = "abs";
  const auto layout = pressure_advance::LayOut(config);
  const auto plan = pressure_advance::MakePlan(layout, config, "pattern.gcode");
  world.gcode = pressure_advance::WriteGcode(layout, config);
  world.plan = sim::ParsePlan(files::FormatPlan(plan)).value();
  return world;
}

void Spoil(const Fault& fault, sim::LaserTraits& eye) {
  eye.stripe_sigma_px *= fault.widen;
  for (sim::Sheen* sheen : {&eye.plate, &eye.filament}) {
    sheen->peak *= fault.brighten / fault.widen;
    sheen->glow *= fault.brighten;
  }
}

struct Outcome {
  bool good = false;
  bool covered = false;
  double error_s = 0;
  double u_s = 0;
  double width_mm = 0;            ///< of the line as drawn, at half its height
  std::vector<std::string> said;  ///< reason and notices
};

bool Says(const Outcome& outcome, const char* what) {
  return std::any_of(outcome.said.begin(), outcome.said.end(),
                     [&](const std::string& text) { return text.find(what) != std::string::npos; });
}

/// Leaves the place of the bead in the picture to be found, as a calibration does.
void ForgetCrop(const fs::path& folder) {
  const fs::path path = folder / "scan.json";
  nlohmann::json scan = nlohmann::json::parse(std::ifstream(path));
  scan.erase("crop_px");
  std::ofstream(path) << scan.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Outcome RunOne(const World& world, std::uint64_t seed, const sim::Condition& condition,
               const Fault& fault, const fs::path& folder) {
  const Random random(seed);
  Random truth_random = random.Fork(1);
  Random traits_random = random.Fork(2);
  Random print_random = random.Fork(3);
  const double pa_s = truth_random.Uniform(0.033, 0.040);
  const auto print =
      sim::PrintGcode(world.gcode, sim::DrawTraits(pa_s, traits_random), print_random);
  Outcome outcome;
  if (!print) return outcome.said.push_back(print.error().message), outcome;
  Random eye_random = sim::LaserEyeOf(seed, condition);
  sim::LaserTraits eye = sim::DrawLaserTraits(condition, eye_random);
  Spoil(fault, eye);
  outcome.width_mm = 2.3548 * eye.stripe_sigma_px / eye.px_per_mm;
  sim::ScanOptions options;
  options.scan_speed_mm_s = world.scan.scan_speed_mm_s;
  options.skip_mm = world.scan.skip_mm;
  options.frame_width_px = 160;
  options.frame_height_px = 120;
  const auto recorded =
      sim::RecordScan(print->bed, world.plan, condition, eye, options, eye_random.Fork(1), folder);
  if (!recorded) return outcome.said.push_back(recorded.error().message), outcome;
  ForgetCrop(folder);
  const auto run = app::AnalyseRecording(folder);
  if (!run) return outcome.said.push_back(run.error().message), outcome;
  const Measured& answer = run->analysis.pressure_advance;
  outcome.said = run->analysis.notices;
  outcome.said.push_back(answer.reason());
  outcome.good = answer.good();
  if (!outcome.good) return outcome;
  const double truth_s = print->truth.pressure_advance_s;
  const Quantity& q = answer.quantity();
  outcome.error_s = q.value - truth_s;
  outcome.u_s = q.standard_uncertainty;
  outcome.covered = q.interval95.lo <= truth_s && truth_s <= q.interval95.hi;
  return outcome;
}

std::vector<Fault> Faults() {
  return {{"as drawn", Told::kNothing},
          {"1.5 times as wide, as bright", Told::kEither, 1.5, 1.5},
          {"2 times as wide, as bright", Told::kEither, 2, 2},
          {"2 times as wide, as much light", Told::kEither, 2, 1},
          {"3 times as wide, as bright", Told::kEither, 3, 3},
          {"3 times as wide, as much light", Told::kMostly, 3, 1},
          {"0.5 times the light", Told::kNothing, 1, 0.5},
          {"0.25 times the light", Told::kEither, 1, 0.25},
          {"0.12 times the light", Told::kMostly, 1, 0.12},
          {"0.06 times the light", Told::kMostly, 1, 0.06},
          {"2 times the light", Told::kEither, 1, 2},
          {"4 times the light", Told::kEither, 1, 4},
          {"8 times the light", Told::kMostly, 1, 8}};
}

double RootMeanSquare(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return values.empty() ? 0 : std::sqrt(squares / static_cast<double>(values.size()));
}

/// All prints of one row of the table.
struct Tally {
  int prints = 0, good = 0, covered = 0, wide = 0, burnt = 0, dim = 0;
  int too_wide = 0;  // refused for it
  int told = 0;      // any of these
  std::vector<double> error_ms, u_ms, width_mm;

  void Add(const Outcome& outcome) {
    ++prints;
    width_mm.push_back(outcome.width_mm);
    wide += Says(outcome, "line is out of focus") ? 1 : 0;
    too_wide += Says(outcome, "too wide for a picture") ? 1 : 0;
    burnt += Says(outcome, "line is overexposed") ? 1 : 0;
    dim += Says(outcome, "is dim") ? 1 : 0;
    told += Says(outcome, "laser line is") ? 1 : 0;
    if (!outcome.good) return;
    ++good;
    covered += outcome.covered ? 1 : 0;
    error_ms.push_back(1e3 * outcome.error_s);
    u_ms.push_back(1e3 * outcome.u_s);
  }
};

void PrintRow(const Fault& fault, const Tally& t) {
  fmt::print("| {} | {:.2f} | {} of {} | {:.2f}; {:.2f} | {} | {}, {}, {}, {} |\n", fault.name,
             Mean(t.width_mm), t.good, t.prints, RootMeanSquare(t.error_ms), RootMeanSquare(t.u_ms),
             t.covered, t.wide, t.too_wide, t.burnt, t.dim);
  std::fflush(stdout);
}

TEST(LaserSightStudy, WhatSpoilsAnswersIsNamedAndNothingElse) {
  const int seeds = FromEnvironment("TRAMMEL_STUDY_SEEDS", 4);
  const int first = FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", 1000);
  const char* only = std::getenv("TRAMMEL_STUDY_ROW");
  const World world = DefaultWorld();
  const auto conditions = sim::AllConditions();
  const fs::path scratch = fs::temp_directory_path() / fmt::format("trammel-sight-{}", ::getpid());
  fmt::print(
      "| line | its width, mm | answered | rms error; stated, ms | in the interval | told: out "
      "of focus, too wide, overexposed, dim |\n|---|---|---|---|---|---|\n");
  for (const Fault& fault : Faults()) {
    if (only != nullptr && fault.name.find(only) == std::string::npos) continue;
    std::vector<Outcome> outcomes(conditions.size() * static_cast<std::size_t>(seeds));
    ParallelFor(static_cast<int>(outcomes.size()), [&](int i) {
      const fs::path folder = scratch / std::to_string(i);
      const auto at = static_cast<std::size_t>(i);
      outcomes[at] = RunOne(world, static_cast<std::uint64_t>(first + i),
                            conditions[at % conditions.size()], fault, folder);
      fs::remove_all(folder);
    });
    Tally tally;
    for (const Outcome& outcome : outcomes) tally.Add(outcome);
    PrintRow(fault, tally);
    if (fault.told == Told::kNothing) {
      EXPECT_EQ(tally.told, 0) << fault.name;
    } else if (fault.told == Told::kMostly) {
      EXPECT_GE(2 * tally.told, tally.prints) << fault.name;
    }
  }
  fs::remove_all(scratch);
}

}  // namespace
}  // namespace trammel
