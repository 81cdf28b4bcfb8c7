// The accuracy study: many virtual printers under the paper's twelve conditions, both methods
// beside each other, and what no method can do better. Prints the table that README.md and
// docs/pressure-advance.md quote.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/square.h"
#include "base/statistics.h"
#include "from_environment.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/pattern/pattern_presets.h"
#include "pressure_advance/response/response.h"
#include "pressure_advance_bound.h"
#include "sim/camera/scan_recorder.h"
#include "sim/print/conditions.h"
#include "sim/print/printer.h"
#include "sim/print/world.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
using test::FromEnvironment;

constexpr double kNear_s = 0.002;
constexpr std::uint64_t kFirstReportedSeed = 1000;  // CONVENTIONS.md: below it is development
// The truth lies evenly over one step of the paper's list, the one that holds its own answers.
constexpr Interval kStep_s{0.06 * 5 / 9, 0.06 * 6 / 9};

// How one interval did.
struct Value {
  double error_s = 0;
  double pull = 0;
  double u_s = 0;
  bool covered = false;
};

struct Outcome {
  bool failed = false;
  std::string text;  // error or reason
  std::optional<Value> value, acceleration, deceleration;
  std::optional<Value> slow_lag, fast_lag, slip;  // of the learnt law; slip is no time
  double bound_s = 0;
  double mean_bound_s = 0;
  std::optional<double> bead_error_s;  // of the same fit on the beads themselves
  std::vector<double> read_areas;      // of each line, over the beads' own
  std::vector<double> read_heights;    // over the layer's
  std::optional<double> best_error_s;
  std::optional<double> cubic_error_s;
};

Value Judge(const Quantity& q, double truth) {
  return {q.value - truth, (q.value - truth) / q.standard_uncertainty, q.standard_uncertainty,
          q.interval95.lo <= truth && truth <= q.interval95.hi};
}

std::optional<Value> Judge(const Measured& measured, double truth_s) {
  if (!measured.good()) return std::nullopt;
  return Judge(measured.quantity(), truth_s);
}

struct World {
  double fast_flow_mm3_s = 0;
  double layer_height_mm = 0;
  std::string gcode;
  sim::Plan plan;
  settings::ScanSettings scan;
};

Outcome Failed(const Error& error) {
  Outcome outcome;
  outcome.failed = true;
  outcome.text = error.message;
  return outcome;
}

// TRAMMEL_STUDY_PRESET: whose pattern and scan; left out: the default's.
World DefaultWorld() {
  const char* name = std::getenv("TRAMMEL_STUDY_PRESET");
  pressure_advance::PatternConfig config;
  World world;
  ApplyPreset(pressure_advance::ParsePatternPreset(name == nullptr ? "" : name)
                  .value_or(pressure_advance::kDefaultPreset),
              config, world.scan);
  config.material = "abs";
  const auto layout = pressure_advance::LayOut(config);
  const auto plan = pressure_advance::MakePlan(layout, config, "pattern.gcode");
  world.layer_height_mm = config.layer_height_mm;
  world.fast_flow_mm3_s = Summarise(layout, config).peak_flow_mm3_s;
  world.gcode = pressure_advance::WriteGcode(layout, config);
  world.plan = sim::ParsePlan(files::FormatPlan(plan)).value();
  return world;
}

// The cross-section that the printer laid at a distance along a planned line.
double AreaAt(const sim::Strand& strand, const sim::PlannedLine& line, double along_mm) {
  const auto distance = [&](const sim::BeadSample& sample) {
    return std::hypot(sample.x_mm - line.start_x_mm, sample.y_mm - line.start_y_mm);
  };
  const auto& samples = strand.samples;
  const auto next = std::partition_point(
      samples.begin() + 1, samples.end() - 1,
      [&](const sim::BeadSample& sample) { return distance(sample) < along_mm; });
  const auto before = next - 1;
  const double share = (along_mm - distance(*before)) / (distance(*next) - distance(*before));
  return std::lerp(before->area_mm2, next->area_mm2, std::clamp(share, 0.0, 1.0));
}

// The profiles that an eye without any error would have read.
std::vector<pressure_advance::LineProfile> BeadsOf(
    const sim::Print& print, const sim::Plan& plan,
    std::vector<pressure_advance::LineProfile> profiles) {
  constexpr double kExact_mm2 = 1e-5;
  constexpr double kNear_mm = 0.05;
  std::size_t i = 0;
  for (const sim::PlannedLine& line : plan.lines) {
    if (line.pattern != 0) continue;
    pressure_advance::LineProfile& profile = profiles.at(i++);
    profile.unusable.clear();
    for (const sim::Strand& strand : print.bed.strands) {
      const sim::BeadSample& first = strand.samples.front();
      const sim::BeadSample& last = strand.samples.back();
      if (std::hypot(first.x_mm - line.start_x_mm, first.y_mm - line.start_y_mm) > kNear_mm ||
          std::hypot(last.x_mm - line.end_x_mm, last.y_mm - line.end_y_mm) > kNear_mm) {
        continue;
      }
      for (pressure_advance::ProfileSample& sample : profile.samples) {
        sample.area = {AreaAt(strand, line, sample.position), kExact_mm2};
        sample.gap = sample.cut_off = false;
      }
    }
  }
  return profiles;
}

void CompareReadings(const std::vector<pressure_advance::LineProfile>& seen,
                     const std::vector<pressure_advance::LineProfile>& exact,
                     double layer_height_mm, Outcome& outcome) {
  for (std::size_t i = 0; i < exact.size(); ++i) {
    std::vector<double> areas_mm2, there_mm2, heights_mm;
    for (std::size_t k = 0; k < exact[i].samples.size(); ++k) {
      const pressure_advance::ProfileSample& sample = seen[i].samples[k];
      if (!sample.area.seen() || !sample.height.seen()) continue;
      areas_mm2.push_back(sample.area.value);
      there_mm2.push_back(exact[i].samples[k].area.value);
      heights_mm.push_back(sample.height.value);
    }
    if (areas_mm2.empty()) continue;
    outcome.read_areas.push_back(Median(areas_mm2) / Median(there_mm2));
    outcome.read_heights.push_back(Median(heights_mm) / layer_height_mm);
  }
}

// What the learnt law says of the extruder, beside what it is.
void JudgeLaw(const pressure_advance::Analysis& analysis, const World& world,
              const sim::PrinterTraits& traits, Outcome& outcome) {
  if (!analysis.response.law || !analysis.pressure_advance.good()) return;
  constexpr double kSlipAt_mm3_s = 15;
  const auto& segments = analysis.motion.segments;
  const double per_mm2 = 4 / (std::numbers::pi * Square(traits.filament_diameter_mm));
  const double fast_mm_s = world.fast_flow_mm3_s * per_mm2;
  const double slow_mm_s = fast_mm_s * segments[0].speed_mm_s / segments[1].speed_mm_s;
  const sim::StorageLaw law = sim::ScaledTo(traits.law, traits.k_star_s, slow_mm_s, fast_mm_s);
  const auto lag_s = [&](double flow_mm_s) {
    return 1 / sim::FlowFromStored(law, sim::Stored(law, flow_mm_s)).slope_per_s;
  };
  outcome.slow_lag = Judge(analysis.response.law->slow_lag_s, lag_s(slow_mm_s));
  outcome.fast_lag = Judge(analysis.response.law->fast_lag_s, lag_s(fast_mm_s));
  outcome.slip = Judge(analysis.response.law->slip,
                       traits.slip * Square(world.fast_flow_mm3_s / kSlipAt_mm3_s));
}

Outcome RunOne(const World& world, std::uint64_t seed, const sim::Condition& condition,
               const fs::path& scratch) {
  Outcome outcome;
  const Random world_random(seed);
  Random truth_random = world_random.Fork(1);
  Random traits_random = world_random.Fork(2);
  Random print_random = world_random.Fork(3);
  const sim::PrinterTraits traits =
      sim::DrawTraits(truth_random.Uniform(kStep_s.lo, kStep_s.hi), traits_random);
  const auto print = sim::PrintGcode(world.gcode, traits, print_random);
  if (!print) return Failed(print.error());
  const fs::path folder = scratch / fmt::format("{}-{}", seed, sim::ToString(condition));
  fs::remove_all(folder);
  Random random = sim::LaserEyeOf(seed, condition);
  const sim::LaserTraits eye = sim::DrawLaserTraits(condition, random);
  sim::ScanOptions options;
  options.scan_speed_mm_s = world.scan.scan_speed_mm_s;
  options.skip_mm = world.scan.skip_mm;
  options.frame_width_px = 160;
  options.frame_height_px = 120;
  const auto recorded =
      sim::RecordScan(print->bed, world.plan, condition, eye, options, random.Fork(1), folder);
  if (!recorded) return Failed(recorded.error());
  const auto run = app::AnalyseRecording(folder);
  fs::remove_all(folder);
  if (!run) return Failed(run.error());
  const double truth = print->truth.pressure_advance_s;
  const auto& analysis = run->analysis;
  if (analysis.deviation.best_s) outcome.best_error_s = *analysis.deviation.best_s - truth;
  if (analysis.deviation.cubic_minimum_s) {
    outcome.cubic_error_s = *analysis.deviation.cubic_minimum_s - truth;
  }
  outcome.bound_s = test::BoundOf(traits);
  outcome.mean_bound_s = test::MeanBoundOf(traits);
  const auto exact = BeadsOf(*print, world.plan, analysis.profiles);
  CompareReadings(analysis.profiles, exact, world.layer_height_mm, outcome);
  const auto beads = pressure_advance::FitResponse(exact, analysis.motion);
  if (beads.response.pressure_advance.good()) {
    outcome.bead_error_s = beads.response.pressure_advance.quantity().value - truth;
  }
  outcome.text = analysis.pressure_advance.reason();
  outcome.value = Judge(analysis.pressure_advance, truth);
  outcome.acceleration = Judge(analysis.response.acceleration.pressure_advance, truth);
  outcome.deceleration = Judge(analysis.response.deceleration.pressure_advance, truth);
  JudgeLaw(analysis, world, traits, outcome);
  return outcome;
}

double RootMeanSquare(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return values.empty() ? 0 : std::sqrt(squares / static_cast<double>(values.size()));
}

int Near(const std::vector<double>& errors_ms) {
  int count = 0;
  for (const double error : errors_ms) count += std::abs(error) <= 1e3 * kNear_s;
  return count;
}

double MeanOrZero(const std::vector<double>& sample) { return sample.empty() ? 0 : Mean(sample); }

// One kind of interval over many prints.
struct Intervals {
  int covered = 0;
  std::vector<double> error_ms, pull, u_ms;

  void Add(const std::optional<Value>& value) {
    if (!value) return;
    covered += value->covered;
    error_ms.push_back(1e3 * value->error_s);
    pull.push_back(value->pull);
    u_ms.push_back(1e3 * value->u_s);
  }
  [[nodiscard]] int good() const { return static_cast<int>(error_ms.size()); }
  [[nodiscard]] double share() const { return 100.0 * covered / std::max(1, good()); }
};

struct Tally {
  int runs = 0;
  Intervals value, acceleration, deceleration, slow_lag, fast_lag, slip;
  std::vector<double> bound_ms, mean_bound_ms, bead_ms, best_ms, cubic_ms;
  std::vector<double> read_areas, read_heights;

  void Add(const Outcome& outcome) {
    ++runs;
    if (outcome.best_error_s) best_ms.push_back(1e3 * *outcome.best_error_s);
    if (outcome.cubic_error_s) cubic_ms.push_back(1e3 * *outcome.cubic_error_s);
    read_areas.insert(read_areas.end(), outcome.read_areas.begin(), outcome.read_areas.end());
    read_heights.insert(read_heights.end(), outcome.read_heights.begin(),
                        outcome.read_heights.end());
    value.Add(outcome.value);
    acceleration.Add(outcome.acceleration);
    deceleration.Add(outcome.deceleration);
    slow_lag.Add(outcome.slow_lag);
    fast_lag.Add(outcome.fast_lag);
    slip.Add(outcome.slip);
    if (outcome.bead_error_s) bead_ms.push_back(1e3 * *outcome.bead_error_s);
    if (!outcome.value) return;
    bound_ms.push_back(1e3 * outcome.bound_s);
    mean_bound_ms.push_back(1e3 * outcome.mean_bound_s);
  }
};

void PrintRow(const std::string& name, const Tally& t) {
  const double rms = RootMeanSquare(t.value.error_ms);
  const double bound = RootMeanSquare(t.bound_ms);
  const double best = RootMeanSquare(t.best_ms);
  fmt::print(
      "{:<22} {:>5} {:>5} | {:>5.2f} {:>5.2f} {:>5.2f} {:>5.2f} {:>5.2f} {:>5.2f} | {:>5.1f} "
      "{:>5.1f} {:>5.1f} "
      "{:>5.2f} | {:>5.2f} {:>5.2f} {:>5.2f} | {:>4} {:>4} {:>4} | {:>5.2f}\n",
      name, t.runs, t.runs - t.value.good(), MeanOrZero(t.value.error_ms), rms, bound,
      bound > 0 ? rms / bound : 0, RootMeanSquare(t.bead_ms), RootMeanSquare(t.mean_bound_ms),
      t.value.share(), t.acceleration.share(), t.deceleration.share(),
      StandardDeviation(t.value.pull), best, RootMeanSquare(t.cubic_ms), best > 0 ? rms / best : 0,
      Near(t.value.error_ms), Near(t.best_ms), Near(t.cubic_ms), RootMeanSquare(t.value.u_ms));
}

void PrintLaw(const char* name, const Intervals& told) {
  fmt::print(
      "{:<28} {:>4} learnt, {:>5.1f} % hold the truth; mean and rms error {:>5.2f}, {:.2f}, "
      "standard uncertainty {:.2f}, sd of error/u {:.2f}\n",
      name, told.good(), told.share(), MeanOrZero(told.error_ms), RootMeanSquare(told.error_ms),
      RootMeanSquare(told.u_ms), StandardDeviation(told.pull));
}

// @param share  standard uncertainty that the answer states of it
void PrintReading(const char* name, const std::vector<double>& read, double share) {
  double squares = 0;
  for (const double value : read) squares += Square(value - 1);
  const double rms = std::sqrt(squares / static_cast<double>(read.size()));
  fmt::print(
      "{} as read over what is there: {:.2f} on average, 95 % in {:.2f} to {:.2f}; rms error "
      "{:.3f}, stated {:.2f}\n",
      name, Mean(read), Quantile(read, 0.025), Quantile(read, 0.975), rms, share);
  EXPECT_LE(rms, 1.1 * share) << name;
}

TEST(PressureAdvanceStudy, ResponseIsWithin2MillisecondsOfTheTruthUnderTheTwelveConditions) {
  const int seeds = FromEnvironment("TRAMMEL_STUDY_SEEDS", 20);
  const auto first = static_cast<std::uint64_t>(
      FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", static_cast<int>(kFirstReportedSeed)));
  const World world = DefaultWorld();
  const auto conditions = sim::AllConditions();
  const fs::path scratch = fs::temp_directory_path() / fmt::format("trammel-study-{}", ::getpid());
  fs::create_directories(scratch);

  // Every condition gets its own printers, so that all prints are independent.
  std::vector<Outcome> outcomes(conditions.size() * static_cast<std::size_t>(seeds));
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < outcomes.size(); i = next++) {
      outcomes[i] = RunOne(world, first + i, conditions[i % conditions.size()], scratch);
    }
  };
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i) {
      threads.emplace_back(work);
    }
  }
  fs::remove_all(scratch);

  std::array<Tally, 12> tally;
  Tally all;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const std::size_t c = i % conditions.size();
    ASSERT_FALSE(outcomes[i].failed) << "seed " << first + i << ": " << outcomes[i].text;
    tally[c].Add(outcomes[i]);
    all.Add(outcomes[i]);
    if (!outcomes[i].value) {
      fmt::print("seed {} {}: {}\n", first + i, sim::ToString(conditions[c]), outcomes[i].text);
    } else if (std::abs(outcomes[i].value->error_s) > kNear_s) {
      fmt::print("seed {} {}: off by {:+.2f} ms, {:+.1f} u\n", first + i,
                 sim::ToString(conditions[c]), 1e3 * outcomes[i].value->error_s,
                 outcomes[i].value->pull);
    }
  }
  fmt::print(
      "\nresponse: prints, without an answer | mean and rms error, bound (ms), rms over bound, rms "
      "error on the beads themselves, bound of a mean (ms) |"
      "\nin the 95 % interval of the answer, of the acceleration, of the deceleration (%), sd of "
      "error/u |"
      "\ndeviation: rms error of the best line, of the cubic's minimum (ms), response over best "
      "line |"
      "\nwithin 2 ms: response, best line, cubic | standard uncertainty of the answer, rms (ms)\n");
  for (std::size_t c = 0; c < conditions.size(); ++c) {
    PrintRow(sim::ToString(conditions[c]), tally[c]);
  }
  PrintRow("all", all);
  PrintReading("heights", all.read_heights, pressure_advance::kHeightReadingShare);
  PrintReading("areas", all.read_areas, pressure_advance::kAreaReadingShare);
  PrintLaw("the acceleration's answer, ms", all.acceleration);
  PrintLaw("the deceleration's answer, ms", all.deceleration);
  PrintLaw("lag at the slow speed, ms", all.slow_lag);
  PrintLaw("lag at the fast speed, ms", all.fast_lag);
  PrintLaw("slip at the fast speed, 0.1 %", all.slip);
  for (const Intervals* told : {&all.slow_lag, &all.fast_lag, &all.slip}) {
    EXPECT_GE(told->covered, 0.9 * told->good());
  }
  EXPECT_GE(Near(all.value.error_ms), 0.95 * all.value.good());
  EXPECT_GE(all.value.covered, 0.93 * all.value.good());
  EXPECT_LE(RootMeanSquare(all.value.error_ms), 0.3 * RootMeanSquare(all.best_ms));
  // "The ten easier conditions": all but the two that refuse most.
  std::vector<int> refused;
  for (const Tally& t : tally) refused.push_back(t.runs - t.value.good());
  std::sort(refused.begin(), refused.end());
  int easier = 0;
  for (int i = 0; i < 10; ++i) easier += refused[i];
  fmt::print("refused in the ten easier conditions: {} of {}\n", easier, 10 * seeds);
  EXPECT_LE(easier, 0.05 * 10 * seeds);
}

}  // namespace
}  // namespace trammel
