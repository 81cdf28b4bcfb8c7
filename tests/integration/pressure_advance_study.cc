// Pressure advance over many virtual printers: coverage, bias and refusals, row by row.
//
// Scans: patterns printed by src/sim under the paper's twelve conditions, and with faults of the
// laser line. Laws and Melt: profiles of extruders by two other authors (extruder_world.h,
// melt_world.h), whose laws the response fit was not built on.
// TRAMMEL_STUDY_PRESET: whose pattern and scan (quick, paper); left out: the default's.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "extruder_world.h"
#include "melt_rows.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/response.h"
#include "sim/camera/scan_recorder.h"
#include "sim/print/conditions.h"
#include "sim/print/printer.h"
#include "support/study.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;
namespace pa = pressure_advance;

constexpr double kNear_s = 0.002;
constexpr double kMs = 1e3;
constexpr Interval kTested_s{0, 0.06};

pa::PatternPreset Preset() {
  const char* name = std::getenv("TRAMMEL_STUDY_PRESET");
  return pa::ParsePatternPreset(name == nullptr ? "" : name).value_or(pa::kDefaultPreset);
}

std::vector<double> Values(const Interval& range_s, int lines) {
  std::vector<double> values;
  for (int i = 0; i < lines; ++i) {
    values.push_back(std::lerp(range_s.lo, range_s.hi, static_cast<double>(i) / (lines - 1)));
  }
  return values;
}

// Scans.

struct Pattern {
  pa::PatternConfig config;
  settings::ScanSettings scan;
  std::string gcode;
  sim::Plan plan;
};

Pattern PatternOfPreset() {
  Pattern pattern;
  ApplyPreset(Preset(), pattern.config, pattern.scan);
  pattern.config.material = "abs";
  const auto layout = pa::LayOut(pattern.config);
  const auto plan = pa::MakePlan(layout, pattern.config, "pattern.gcode");
  pattern.gcode = pa::WriteGcode(layout, pattern.config);
  pattern.plan = sim::ParsePlan(files::FormatPlan(plan)).value();
  return pattern;
}

/// A laser line wider or brighter than it should be.
struct StripeFault {
  std::string name;
  double widen = 1;
  double brighten = 1;
  enum { kSilent, kEither, kMostlyNamed } named = kEither;
};

/// Readings of a scan relative to the truth: each line's median.
struct Readings {
  std::vector<double> areas, heights;
};

Readings ReadingsOf(const pa::Analysis& analysis, const sim::Print& print, const Pattern& pattern) {
  constexpr double kSame_mm = 0.05;
  Readings readings;
  std::size_t i = 0;
  for (const sim::PlannedLine& line : pattern.plan.lines) {
    if (line.pattern != 0 || i == analysis.profiles.size()) continue;
    const pa::LineProfile& profile = analysis.profiles[i++];
    const auto from_start_mm = [&](const sim::BeadSample& bead) {
      return std::hypot(bead.x_mm - line.start_x_mm, bead.y_mm - line.start_y_mm);
    };
    const auto strand = std::find_if(
        print.bed.strands.begin(), print.bed.strands.end(),
        [&](const sim::Strand& one) { return from_start_mm(one.samples.front()) <= kSame_mm; });
    if (strand == print.bed.strands.end()) continue;
    std::vector<double> seen_mm2, heights_mm, laid_mm2;
    for (const pa::ProfileSample& sample : profile.samples) {
      if (!sample.area.seen() || !sample.height.seen()) continue;
      seen_mm2.push_back(sample.area.value);
      heights_mm.push_back(sample.height.value);
      // The bead at the same place: samples lie closer where the nozzle is slow.
      const auto bead = std::partition_point(
          strand->samples.begin(), strand->samples.end() - 1,
          [&](const sim::BeadSample& one) { return from_start_mm(one) < sample.position; });
      laid_mm2.push_back(bead->area_mm2);
    }
    if (seen_mm2.empty()) continue;
    readings.areas.push_back(Median(seen_mm2) / Median(laid_mm2));
    readings.heights.push_back(Median(heights_mm) / pattern.config.layer_height_mm);
  }
  return readings;
}

StudyAnswer Scan(const Pattern& pattern, std::uint64_t seed, const sim::Condition& condition,
                 const StripeFault& observation, Readings* readings = nullptr) {
  // The truth lies evenly over one step of the paper's list, the one with its own answers.
  constexpr Interval kStep_s{0.06 * 5 / 9, 0.06 * 6 / 9};
  const Random world(seed);
  Random truth_random = world.Fork(1), traits_random = world.Fork(2), print_random = world.Fork(3);
  const auto traits = sim::DrawTraits(truth_random.Uniform(kStep_s.lo, kStep_s.hi), traits_random);
  const auto print = sim::PrintGcode(pattern.gcode, traits, print_random);
  Random optics_random = sim::LaserRandom(seed, condition);
  sim::LaserTraits optics = sim::DrawLaserTraits(condition, optics_random);
  optics.stripe_sigma_px *= observation.widen;
  for (sim::Sheen* sheen : {&optics.plate, &optics.filament}) {
    sheen->peak *= observation.brighten / observation.widen;
    sheen->glow *= observation.brighten;
  }
  sim::ScanOptions options;
  options.scan_speed_mm_s = pattern.scan.scan_speed_mm_s;
  options.skip_mm = pattern.scan.skip_mm;
  options.frame_width_px = 160;
  options.frame_height_px = 120;
  const fs::path folder =
      fs::temp_directory_path() / fmt::format("trammel-study-{}-{}", ::getpid(), seed);
  fs::remove_all(folder);
  StudyAnswer answer;
  if (!print || !sim::RecordScan(print->bed, pattern.plan, condition, optics, options,
                                 optics_random.Fork(1), folder)) {
    ADD_FAILURE() << "seed " << seed << " was not printed or recorded";
    return answer;
  }
  const auto run = app::AnalyseRecording(folder);
  fs::remove_all(folder);
  if (!run) {
    ADD_FAILURE() << "seed " << seed << ": " << run.error().message;
    return answer;
  }
  const double truth_s = print->truth.pressure_advance_s;
  answer = {run->analysis.pressure_advance, {truth_s, truth_s}, run->analysis.notices};
  answer.said.push_back(answer.measured.reason());
  if (readings != nullptr) *readings = ReadingsOf(run->analysis, *print, pattern);
  return answer;
}

// @param share  standard uncertainty that answers state of a reading
void ExpectScatter(const char* name, const std::vector<double>& readings, double share) {
  double squares = 0;
  for (const double reading : readings) squares += (reading - 1) * (reading - 1);
  const double rms = std::sqrt(squares / static_cast<double>(readings.size()));
  fmt::print("{} as read over what is there: rms error {:.3f}, stated {:.2f}\n", name, rms, share);
  EXPECT_LE(rms, 1.1 * share) << name;
}

TEST(PressureAdvanceStudy, ScansAnswerWithin2MillisecondsUnderTheTwelveConditions) {
  const auto conditions = sim::AllConditions();
  const int each = SeedsOfStudy(20).count;
  const StudySeeds seeds{each * static_cast<int>(conditions.size()), SeedsOfStudy(20).first};
  const Pattern pattern = PatternOfPreset();
  // Every condition gets its own printers, so that all prints are independent.
  const auto condition_of = [&](std::uint64_t seed) {
    return conditions[(seed - seeds.first) % conditions.size()];
  };
  std::vector<Readings> readings(static_cast<std::size_t>(seeds.count));
  const auto answers = RunSeeds(seeds, [&](std::uint64_t seed) {
    return Scan(pattern, seed, condition_of(seed), {}, &readings[seed - seeds.first]);
  });
  PrintStudyHead("ms");
  StudyTally all;
  for (const sim::Condition& condition : conditions) {
    StudyTally tally;
    for (std::size_t i = 0; i < answers.size(); ++i) {
      if (sim::ToString(condition_of(seeds.first + i)) == sim::ToString(condition)) {
        tally.Add(answers[i]);
      }
    }
    tally.Print(sim::ToString(condition), kMs);
    all.Add(tally);
  }
  all.Print("all", kMs);
  fmt::print("within {} ms: {} of {}\n", kMs * kNear_s, all.Within(kNear_s), all.answered);
  EXPECT_GE(all.answered, 0.95 * all.runs);
  EXPECT_GE(all.Within(kNear_s), 0.95 * all.answered);
  EXPECT_GE(all.held, 0.93 * all.answered);
  Readings read;
  for (const Readings& one : readings) {
    read.areas.insert(read.areas.end(), one.areas.begin(), one.areas.end());
    read.heights.insert(read.heights.end(), one.heights.begin(), one.heights.end());
  }
  ExpectScatter("heights", read.heights, pa::kHeightReadingShare);
  ExpectScatter("areas", read.areas, pa::kAreaReadingShare);
}

TEST(PressureAdvanceStudy, FaultsOfTheLaserLineAreNamedAndNothingElse) {
  const auto conditions = sim::AllConditions();
  const StudySeeds given = SeedsOfStudy(4);
  const StudySeeds seeds{given.count * static_cast<int>(conditions.size()), given.first};
  const Pattern pattern = PatternOfPreset();
  PrintStudyHead("ms");
  for (const StripeFault& observation :
       {StripeFault{"line as drawn", 1, 1, StripeFault::kSilent},
        StripeFault{"half the light", 1, 0.5, StripeFault::kSilent},
        StripeFault{"2 times as wide, as bright", 2, 2},
        StripeFault{"3 times as wide, as much light", 3, 1, StripeFault::kMostlyNamed},
        StripeFault{"0.12 times the light", 1, 0.12, StripeFault::kMostlyNamed},
        StripeFault{"0.06 times the light", 1, 0.06, StripeFault::kMostlyNamed},
        StripeFault{"8 times the light", 1, 8, StripeFault::kMostlyNamed}}) {
    if (!RowIsWanted(observation.name)) continue;
    const auto answers = RunSeeds(seeds, [&](std::uint64_t seed) {
      return Scan(pattern, seed, conditions[(seed - seeds.first) % conditions.size()], observation);
    });
    TallyOf(answers).Print(observation.name, kMs);
    const auto named = std::count_if(answers.begin(), answers.end(), [](const auto& answer) {
      return std::any_of(answer.said.begin(), answer.said.end(), [](const std::string& text) {
        return text.find("laser line is") != std::string::npos;
      });
    });
    fmt::print("  named in {} of {}\n", named, seeds.count);
    if (observation.named == StripeFault::kSilent) EXPECT_EQ(named, 0) << observation.name;
    if (observation.named == StripeFault::kMostlyNamed)
      EXPECT_GE(2 * named, seeds.count) << observation.name;
  }
}

// Flow ratio.

/// What is wrong with the print and the set-up, beside the flow: half widths of even draws.
struct FlowFault {
  std::string name;
  double gap_mm = 0.05;         ///< the nozzle's height over the plate, in both prints
  double tilt = 3e-4;           ///< of the bed, in x and y
  bool set_up = true;           ///< scale and angle have uncertainties
  double gap_repeat_mm = 0.01;  ///< the nozzle's height from print to print
};

struct FlowAnswers {
  StudyAnswer by_plate, by_reference;
};

/// Prints with a flow factor and scans it, on an opaque plate as its owner states it.
Result<void> ScanFlow(const Pattern& pattern, const sim::Condition& condition, double flow_factor,
                      sim::PrinterTraits traits, const FlowFault& fault, Random random,
                      const sim::LaserTraits& optics, const std::optional<sim::SetUpScale>& set_up,
                      const fs::path& folder) {
  Random print_random = random.Fork(2);
  traits.flow_factor = flow_factor;
  traits.gap_error_mm += random.Uniform(-fault.gap_repeat_mm, fault.gap_repeat_mm);
  const auto print = sim::PrintGcode(pattern.gcode, traits, print_random);
  if (!print) return tl::unexpected(print.error());
  sim::ScanOptions options;
  options.scan_speed_mm_s = pattern.scan.scan_speed_mm_s;
  options.skip_mm = pattern.scan.skip_mm;
  options.frame_width_px = 160;
  options.frame_height_px = 120;
  options.opaque_plate = condition.plate != sim::Plate::kPei;
  options.set_up = set_up;
  return sim::RecordScan(print->bed, pattern.plan, condition, optics, options, random.Fork(3),
                         folder);
}

/// A world: one printer prints with a known flow ratio, then with a hidden one, under one camera.
FlowAnswers FlowOf(const Pattern& pattern, std::uint64_t seed, const sim::Condition& condition,
                   const FlowFault& fault) {
  constexpr Interval kFactors{0.85, 1.15};
  const Random world(seed);
  Random factors = world.Fork(1), optics_random = sim::LaserRandom(seed, condition);
  const sim::LaserTraits optics = sim::DrawLaserTraits(condition, optics_random);
  Random set_up_random = world.Fork(2);
  std::optional<sim::SetUpScale> set_up;
  if (fault.set_up) set_up = sim::DrawSetUpScale(optics, set_up_random);
  const double known = factors.Uniform(kFactors.lo, kFactors.hi);
  const double hidden = factors.Uniform(kFactors.lo, kFactors.hi);
  Random traits_random = world.Fork(5);
  auto traits = sim::DrawTraits(factors.Uniform(0.015, 0.045), traits_random);
  traits.gap_error_mm = factors.Uniform(-fault.gap_mm, fault.gap_mm);
  traits.plate_tilt_x += factors.Uniform(-fault.tilt, fault.tilt);
  traits.plate_tilt_y += factors.Uniform(-fault.tilt, fault.tilt);
  const fs::path folder =
      fs::temp_directory_path() / fmt::format("trammel-flow-{}-{}", ::getpid(), seed);
  fs::remove_all(folder);
  fs::create_directories(folder);
  const Interval truth{1 / hidden, 1 / hidden};
  FlowAnswers answers{{Measured(), truth}, {Measured(), truth}};
  const fs::path first = folder / "known", second = folder / "hidden";
  if (!ScanFlow(pattern, condition, known, traits, fault, world.Fork(3), optics, set_up, first) ||
      !ScanFlow(pattern, condition, hidden, traits, fault, world.Fork(4), optics, set_up, second)) {
    ADD_FAILURE() << "seed " << seed << " was not printed or recorded";
    return answers;
  }
  const auto by_plate = app::AnalyseRecording(second);
  const auto by_reference = app::AnalyseRecording(second, app::FlowReference{first, 1 / known});
  fs::remove_all(folder);
  if (!by_plate || !by_reference) {
    ADD_FAILURE() << "seed " << seed << " was not analysed";
    return answers;
  }
  const auto ratio = [](const report::AnalysisRun& run) {
    return run.analysis.flow ? run.analysis.flow->ratio : Measured::Refused("not analysed");
  };
  answers.by_plate.measured = ratio(*by_plate);
  answers.by_reference.measured = ratio(*by_reference);
  return answers;
}

TEST(PressureAdvanceStudy, FlowRatiosLieInTheirIntervals) {
  constexpr double kPercent = 100;
  const auto conditions = sim::AllConditions();
  const StudySeeds seeds = SeedsOfStudy(60);
  const Pattern pattern = PatternOfPreset();
  const auto condition_of = [&](std::size_t i) { return conditions[(seeds.first + i) % 12]; };
  PrintStudyHead("%");
  for (const FlowFault& fault :
       {FlowFault{"drawn"}, FlowFault{"gap +-0.1 mm", 0.1}, FlowFault{"tilt +-2 mm/m", 0.05, 2e-3},
        FlowFault{"no set-up", 0.05, 3e-4, false}}) {
    if (!RowIsWanted(fault.name)) continue;
    std::vector<FlowAnswers> answers(static_cast<std::size_t>(seeds.count));
    (void)RunSeeds(seeds, [&](std::uint64_t seed) {
      const std::size_t i = seed - seeds.first;
      answers[i] = FlowOf(pattern, seed, condition_of(i), fault);
      return StudyAnswer{};
    });
    for (const auto& [kind, member] : {std::pair{"by plate", &FlowAnswers::by_plate},
                                       std::pair{"by reference", &FlowAnswers::by_reference}}) {
      StudyTally all;
      for (const sim::Condition& condition : conditions) {
        StudyTally tally;
        for (std::size_t i = 0; i < answers.size(); ++i) {
          if (sim::ToString(condition_of(i)) == sim::ToString(condition)) {
            tally.Add(answers[i].*member);
          }
        }
        tally.Print(fmt::format("  {}", sim::ToString(condition)), kPercent);
        all.Add(tally);
      }
      all.Print(fmt::format("{}, {}", fault.name, kind), kPercent);
      if (all.answered >= 100) EXPECT_GE(all.held, 0.93 * all.answered) << fault.name << kind;
      if (!fault.set_up && member == &FlowAnswers::by_plate) EXPECT_EQ(all.answered, 0);
    }
  }
}

// Laws of the extruder's lag.

struct StorageRow {
  std::string name;
  ExtruderWorld world;
  int lines = 10;
  Interval range_s = kTested_s;
  Interval part{0.25, 0.75};                         ///< of the range, to draw the lag
  std::optional<Interval> exponents = std::nullopt;  ///< range of the drawn power laws
  double min_answered = 0.9;                         ///< share of the patterns
  double min_held = 0.88;                            ///< share of the answers
};

void ScaleNoise(ExtruderWorld& world, double by) {
  world.lag_scatter_s *= by;
  world.flow_scatter *= by;
  world.flow_noise *= by;
  world.reading_noise *= by;
}

std::vector<StorageRow> StorageRows() {
  std::vector<StorageRow> rows;
  const auto add = [&rows](const std::string& name,
                           const std::function<void(StorageRow&)>& change) {
    StorageRow row{name, WorldOf(Preset())};
    change(row);
    rows.push_back(row);
  };
  add("linear", [](StorageRow&) {});
  for (const double exponent : {0.3, 0.4, 0.5, 0.67}) {
    add(fmt::format("power {}", exponent),
        [=](StorageRow& row) { row.world.law = PowerLaw(exponent); });
  }
  add("tanh 0.7, 40 mm/s", [](StorageRow& row) { row.world.law = TanhLaw(0.7, 40); });
  add("two stages, 30 %", [](StorageRow& row) { row.world.second_share = 0.3; });
  for (const double slip : {0.025, 0.05, 0.1}) {
    add(fmt::format("slip {} %", 100 * slip), [=](StorageRow& row) { row.world.slip = slip; });
  }
  for (const double drift : {-0.4, -0.2, 0.2, 0.4}) {
    add(fmt::format("lag drifts {:+} %", 100 * drift),
        [=](StorageRow& row) { row.world.lag_drift = drift; });
  }
  // Up to the smoothing that session/print_needs.cc lets a print have.
  for (const double smooth_time_s : {0.005, 0.02, 0.06}) {
    for (const double exponent : {1.0, 0.5}) {
      add(fmt::format("smoothing {} s, power {}", smooth_time_s, exponent), [=](StorageRow& row) {
        row.world.smooth_time_s = smooth_time_s;
        row.world.law = PowerLaw(exponent);
      });
    }
  }
  add("3/80 mm/s", [](StorageRow& row) { row.world.slow_mm_s = 3, row.world.fast_mm_s = 80; });
  add("20/100 mm/s", [](StorageRow& row) { row.world.slow_mm_s = 20, row.world.fast_mm_s = 100; });
  add("10/200 mm/s, 4000 mm/s^2", [](StorageRow& row) {
    row.world.slow_mm_s = 10, row.world.fast_mm_s = 200;
    row.world.acceleration_mm_s2 = 4000;  // at 3000 there is no steady segment
  });
  add("100 mm/s, 1500 mm/s^2",
      [](StorageRow& row) { row.world.fast_mm_s = 100, row.world.acceleration_mm_s2 = 1500; });
  add("lines of 60 mm", [](StorageRow& row) { row.world.length_mm = 60; });
  for (const int lines : {5, 6, 8, 20}) {
    for (const double exponent : {1.0, 0.5}) {
      add(fmt::format("{} lines, power {}", lines, exponent), [=](StorageRow& row) {
        row.lines = lines;
        row.world.law = PowerLaw(exponent);
      });
    }
  }
  add("0.02 to 0.12 s", [](StorageRow& row) { row.range_s = {0.02, 0.12}; });
  add("0 to 0.02 s", [](StorageRow& row) {
    row.range_s = {0, 0.02};
    row.world.lag_scatter_s = 0.0005;
  });
  add("5 lines, 0.02 to 0.08 s", [](StorageRow& row) {
    row.lines = 5, row.range_s = {0.02, 0.08};
  });
  for (const double at : {0.02, 0.1, 0.2, 0.8, 0.9, 0.98}) {
    add(fmt::format("truth at {:.0f} % of the range", 100 * at), [=](StorageRow& row) {
      row.part = {at, at};
      row.exponents = Interval{0.4, 1};
      row.min_answered = 0;  // near an end of the range an interval does not fit
      row.min_held = 0.92;
    });
  }
  for (const double by : {0.2, 0.5, 2.0}) {
    add(fmt::format("noise x {}", by), [=](StorageRow& row) { ScaleNoise(row.world, by); });
  }
  add("noise x 0.2, power 0.3", [](StorageRow& row) {
    ScaleNoise(row.world, 0.2);
    row.world.law = PowerLaw(0.3);
  });
  add("noise x 0.2, slip 5 %", [](StorageRow& row) {
    ScaleNoise(row.world, 0.2);
    row.world.slip = 0.05;
  });
  return rows;
}

// Half of the printers refill their gaps and half draw in air.
StudyAnswer PrintAndFit(const StorageRow& row, std::uint64_t seed, bool photo = false) {
  Random random(seed);
  ExtruderWorld world = row.world;
  if (row.exponents) world.law = PowerLaw(random.Uniform(row.exponents->lo, row.exponents->hi));
  world.pressure_advance_s = Values(row.range_s, row.lines);
  world.k_star_s =
      std::lerp(row.range_s.lo, row.range_s.hi, random.Uniform(row.part.lo, row.part.hi));
  world.gaps_are_lost = random.Uniform() < 0.5;
  std::vector<pa::LineProfile> profiles = PrintPattern(world, random);
  pa::LineMotion motion = world.Motion();
  if (photo) {
    profiles = SeenInAPhoto(std::move(profiles), world.length_mm);
    motion.length_mm.reset();
    motion.acceleration_mm_s2.reset();
  }
  const double truth_s = TruePressureAdvance(world);
  return {pa::FitResponse(profiles, motion).response.pressure_advance, {truth_s, truth_s}};
}

TEST(PressureAdvanceStudy, LawsThatItWasNotBuiltOnLieInTheInterval) {
  constexpr int kEnough = 200;  // determines a share of 0.95 to 0.015 (1 sigma)
  const StudySeeds seeds = SeedsOfStudy(kEnough);
  PrintStudyHead("ms");
  StudyTally all;
  for (const StorageRow& row : StorageRows()) {
    if (!RowIsWanted(row.name)) continue;
    const StudyTally tally =
        TallyOf(RunSeeds(seeds, [&](std::uint64_t seed) { return PrintAndFit(row, seed); }));
    tally.Print(row.name, kMs);
    all.Add(tally);
    if (tally.runs < kEnough) continue;
    EXPECT_GE(tally.answered, row.min_answered * tally.runs) << row.name;
    EXPECT_GE(tally.held, row.min_held * tally.answered) << row.name;
  }
  all.Print("all rows", kMs);
  EXPECT_GE(all.held, 0.92 * all.answered);
}

TEST(PressureAdvanceStudy, NothingBeyondTheTestedRangeIsAnswered) {
  const StudySeeds seeds = SeedsOfStudy(1000);
  PrintStudyHead("ms");
  for (const bool photo : {false, true}) {
    for (const auto& [range_s, part] : {std::pair{Interval{0, 0.06}, Interval{1.01, 1.1}},
                                        {Interval{0, 0.06}, {1.1, 2}},
                                        {Interval{0.06, 0.12}, {-0.1, -0.01}},
                                        {Interval{0.06, 0.12}, {-1, -0.1}}}) {
      const StorageRow row{fmt::format("{}: {:.2f} to {:.2f} of the range",
                                       photo ? "photo" : "laser", part.lo, part.hi),
                           WorldOf(Preset()),
                           10,
                           range_s,
                           part,
                           Interval{0.4, 1}};
      const StudyTally tally = TallyOf(
          RunSeeds(seeds, [&](std::uint64_t seed) { return PrintAndFit(row, seed, photo); }));
      tally.Print(row.name, kMs);
      EXPECT_EQ(tally.answered, 0) << row.name;
    }
  }
}

// Melts by another author.

// If the melt's memory is longer than a line takes, no one value is right for long and for short
// stretches: the truth is the range between.
StudyAnswer PrintAndFit(MeltWorld world, std::uint64_t seed) {
  Random random(seed);
  world.pressure_advance_s = Values(kTested_s, 10);
  world.physics.lag_s = std::lerp(kTested_s.lo, kTested_s.hi, random.Uniform(0.25, 0.75));
  const auto [lo_s, hi_s] = std::minmax({SteadyPressureAdvance(world), LinePressureAdvance(world)});
  const auto profiles = PrintMeltPattern(world, random);
  return {pa::FitResponse(profiles, world.Motion()).response.pressure_advance, {lo_s, hi_s}};
}

TEST(PressureAdvanceStudy, MeltsByAnotherAuthorLieInTheInterval) {
  constexpr double kInEachRow = 0.5;
  const StudySeeds seeds = SeedsOfStudy(10);
  PrintStudyHead("ms");
  StudyTally all;
  for (const MeltRow& row : MeltRows(MeltWorldOf(Preset()))) {
    if (!RowIsWanted(row.name)) continue;
    const StudyTally tally =
        TallyOf(RunSeeds(seeds, [&](std::uint64_t seed) { return PrintAndFit(row.world, seed); }));
    tally.Print(row.name, kMs);
    EXPECT_GE(tally.held, kInEachRow * tally.answered) << row.name;
    all.Add(tally);
  }
  all.Print("all rows", kMs);
  EXPECT_GE(all.held, 0.92 * all.answered);
}

TEST(MeltWorld, ConservesFilamentInEachRow) {
  for (const MeltRow& row : MeltRows(MeltWorldOf(Preset()))) {
    const MeltPrint print = PrintLines(row.world, {0.01, 0.05}, {0.9, 1.1});
    EXPECT_NEAR(print.driven_mm,
                print.laid_mm + print.oozed_mm + print.slipped_mm + print.stored_mm, 1e-9)
        << row.name;
    EXPECT_GT(print.laid_mm, 0.9 * 4 * row.world.line.length_mm) << row.name;  // two fill it
  }
}

TEST(MeltWorld, HasTheLagForItsTruthWhereTheExtruderIsLinear) {
  for (const double lag_s : {0.02, 0.04}) {
    MeltWorld world = MeltWorldOf(Preset());
    world.physics.lag_s = lag_s;
    EXPECT_NEAR(SteadyPressureAdvance(world), lag_s, 1e-6);
    EXPECT_NEAR(LinePressureAdvance(world), lag_s, 3e-4);
  }
}

}  // namespace
}  // namespace trammel::test
