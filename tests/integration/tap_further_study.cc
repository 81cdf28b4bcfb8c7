// Sweeps the contact method over the further worlds, and draws taps that combine them.
//
// TRAMMEL_TAPS: taps per row, 100 without it; reported figures have 1000. TRAMMEL_TAPS_SEED: the
// first seed. TRAMMEL_TAPS_ONLY: rows whose name contains this.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/statistics.h"
#include "tap/samples/finding.h"
#include "tap_further_rows.h"
#include "tap_miss_bound.h"
#include "tap_study_answers.h"

namespace trammel {
namespace {

// 93 % at kReportedTaps good ones: so many standard deviations of a share below the 95 % that are
// stated.
constexpr double kCoverageDeviations = 2.9;
constexpr std::size_t kReportedTaps = 1000;
constexpr double kMostBiasUm = 0.30;
constexpr double kMostBiasOfBound = 0.30;  // where the bound is no better than 1 um
constexpr double kBiasDeviations = 3;      // of the mean of so many taps
constexpr double kMostRefused = 0.05;      // where only white noise acts
constexpr double kLeastOfDraws = 0.80;     // as it stands
constexpr std::size_t kFewestOfDraw = 100;
constexpr std::size_t kFewest = 10;  // good taps that are judged
constexpr double kVisible = 5;       // deviations apart: no noise hides that

constexpr tap::Method kContact[] = {tap::Method::kContact};

double LeastCoverage(std::size_t good) {
  return 0.95 - kCoverageDeviations * std::sqrt(0.95 * 0.05 / static_cast<double>(good));
}

// Whether the samples' noise is white, and all else the same with it and without.
bool IsWhite(const TapRow& row) {
  const sim::DisturbanceTraits& d = row.cell.disturbance;
  return d.pink_g == 0 && d.wander_g == 0 && row.cell.faults.held_share == 0;
}

// Whether intervals on the nearest smooth press excuse so many misses.
bool IsExcused(const TapAnswers& a, const MissBound& bound) {
  const double n = a.taps();
  const double least = bound.LeastMissed(LeastCoverage(static_cast<std::size_t>(a.taps())));
  const double missed = (static_cast<double>(a.error_um.size()) - a.covered) / n;
  return missed <= least + kCoverageDeviations * std::sqrt(least * (1 - least) / n);
}

// What a row falls short of beyond what noise hides; empty where it keeps everything.
std::string Shortfall(const TapRow& row, const RowAnswers& answers, const MissBound& bound) {
  const TapAnswers& a = answers.of[0];
  std::string text;
  if (row.demand != Demand::kDisturbed && a.RefusedShare() > kMostRefused) text += " refused";
  if (a.error_um.size() < kFewest || IsExcused(a, bound)) return text;
  if (a.Coverage() < LeastCoverage(a.error_um.size())) text += " coverage";
  const double chance_um = kBiasDeviations * StandardDeviation(a.error_um) /
                           std::sqrt(static_cast<double>(a.error_um.size()));
  const double most_um = row.demand == Demand::kExact
                             ? std::max(kMostBiasUm, kMostBiasOfBound * answers.bound_um[2])
                             : Mean(a.half_width_um);
  if (std::abs(Mean(a.error_um)) > most_um + chance_um) text += " bias";
  return text;
}

// Beginnings of the names of rows that may be missed in favour of others, since noise hides too
// much to hold all.
constexpr const char* kMissedForOthers[] = {
    "toe 3 um at 0.2 of k, 0.5 gf",
    "toe 5 um at 0.5 of k, 2 gf",
    "toe 7.5 um at 0.2 of k, 2 gf",
    "toe 7.5 um at 0.5 of k, 2 gf",
    "toe 10 um at 0.1 of k, 2 gf",
    "toe 20 um at 0.1 of k, 2 gf",
    "toe rounded over 0, 5 um at 0.1 of k, 0.5 gf",
};

bool IsHidden(const std::string& name, const MissBound& misses, int taps) {
  const bool for_others = std::any_of(std::begin(kMissedForOthers), std::end(kMissedForOthers),
                                      [&](const char* start) { return name.rfind(start, 0) == 0; });
  return misses.HiddenByNoise(LeastCoverage(static_cast<std::size_t>(taps)),
                              LeastCoverage(kReportedTaps)) ||
         (for_others && misses.HiddenAmongOthers());
}

void PrintHead(const char* what) {
  fmt::print(
      "\n| {} | good | covered | bias | sd | worst | half-width | bound | nearest smooth press: "
      "misfit, shift | missed there, held, half-width | missed here, at least | to be kept, "
      "held there too, half-width wider by | half-width if all toes are kept, as read | refused "
      "because | "
      "misses: seed, error over half-width | |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      what);
}

void PrintRow(const TapRow& row, const RowAnswers& answers, const SmoothPress& smooth,
              const MissBound& misses, const std::string& shortfall, bool hidden) {
  const TapAnswers& a = answers.of[0];
  fmt::print("| {} | {:.0f} % | ", row.name, 100 * (1 - a.RefusedShare()));
  if (a.error_um.size() < 2) {
    fmt::print("- | - | - | - | - | ");
  } else {
    fmt::print("{:.1f} | {:+.2f} | {:.2f} | {:.2f} | {:.2f} | ", 100 * a.Coverage(),
               Mean(a.error_um), StandardDeviation(a.error_um), a.Worst(), Mean(a.half_width_um));
  }
  const char* mark = shortfall.empty() ? "" : hidden ? "HIDDEN" : "BROKEN";
  fmt::print("{:.2f} | {:.1f}, {:+.1f} | ", answers.bound_um[2], smooth.misfit,
             kUmPerMm * smooth.shift_mm);
  if (!misses.distance.empty()) {
    const double missed = misses.LeastMissed(LeastCoverage(static_cast<std::size_t>(a.taps())));
    const double kept = LeastCoverage(kReportedTaps);
    fmt::print("{:.0f} %, {:.0f} %, {:.2f} | {:.1f} % | {:.0f} %, {:.2f} | {:.2f} of {:.2f} | ",
               100 * misses.left_out, 100 * misses.held, misses.half_width_um, 100 * missed,
               100 * misses.LeastHolding(kept), misses.LeastWidening_um(kept),
               misses.joint.least_um, misses.joint.read_um);
  } else {
    fmt::print("- | - | - | - | ");
  }
  fmt::print("{} | {} | {}{} |\n", a.Reasons(2), a.WorstSeeds(3), mark, shortfall);
  std::fflush(stdout);
}

bool Asked(const std::string& name) {
  const char* only = std::getenv("TRAMMEL_TAPS_ONLY");
  return only == nullptr || name.find(only) != std::string::npos;
}

// Rows of one input, which their names begin with.
struct Range {
  int rows = 0;
  int kept = 0;
  int hidden = 0;  // by noise: not kept, and not to be
  double least_good = 1;
  double coverage[2] = {1, 0};
  double bias_um[2] = {0, 0};
  double half_width_um[2] = {1e9, 0};
  double worst_um = 0;
};

std::string InputOf(const std::string& name) {
  const std::string input = name.substr(0, name.find_first_of("0123456789"));
  const std::size_t end = input.find_last_not_of(" +-^");
  return end == std::string::npos ? "inputs that meet" : input.substr(0, end + 1);
}

void AddTo(Range& range, const TapAnswers& a, bool kept, bool hidden) {
  ++range.rows;
  range.kept += kept;
  range.hidden += hidden;
  range.least_good = std::min(range.least_good, 1 - a.RefusedShare());
  if (a.error_um.size() < kFewest) return;
  range.coverage[0] = std::min(range.coverage[0], a.Coverage());
  range.coverage[1] = std::max(range.coverage[1], a.Coverage());
  range.bias_um[0] = std::min(range.bias_um[0], Mean(a.error_um));
  range.bias_um[1] = std::max(range.bias_um[1], Mean(a.error_um));
  range.half_width_um[0] = std::min(range.half_width_um[0], Mean(a.half_width_um));
  range.half_width_um[1] = std::max(range.half_width_um[1], Mean(a.half_width_um));
  range.worst_um = std::max(range.worst_um, a.Worst());
}

void PrintRanges(const std::map<std::string, Range>& ranges) {
  fmt::print(
      "\n| input | rows | kept | hidden by noise | good, at least | covered | bias | half-width | "
      "worst |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [input, r] : ranges) {
    fmt::print("| {} | {} | {} | {} | {:.0f} % | ", input, r.rows, r.kept, r.hidden,
               100 * r.least_good);
    if (r.worst_um == 0) {
      fmt::print("- | - | - | - |\n");
      continue;
    }
    fmt::print("{:.0f}-{:.0f} % | {:+.2f} to {:+.2f} | {:.2f}-{:.2f} | {:.1f} |\n",
               100 * r.coverage[0], 100 * r.coverage[1], r.bias_um[0], r.bias_um[1],
               r.half_width_um[0], r.half_width_um[1], r.worst_um);
  }
}

void StudyRows(const char* what, const std::vector<TapRow>& rows) {
  const int taps = std::max(1, static_cast<int>(FromEnvironment("TRAMMEL_TAPS", 100)));
  const std::uint64_t seed = FromEnvironment("TRAMMEL_TAPS_SEED", kReportedTapSeed);
  fmt::print("\n{} taps a row, seeds from {}; um.\n", taps, seed);
  PrintHead(what);
  std::map<std::string, Range> ranges;
  for (const TapRow& row : rows) {
    if (!Asked(row.name)) continue;
    const RowAnswers answers = StudyRow(row, taps, seed, kContact);
    const QuietTap quiet = TakeQuietTap(row, seed);
    const SmoothPress smooth =
        quiet.height_mm.empty() ? SmoothPress{} : NearestSmoothPress(quiet.Press());
    // The bound is asked for where it could excuse anything.
    MissBound misses;
    if (IsWhite(row) && !Shortfall(row, answers, misses).empty() && smooth.misfit < kVisible) {
      misses = BoundMisses(row, taps, seed, LeastCoverage(static_cast<std::size_t>(taps)));
    }
    const std::string shortfall = Shortfall(row, answers, misses);
    const bool hidden = !shortfall.empty() && IsHidden(row.name, misses, taps);
    PrintRow(row, answers, smooth, misses, shortfall, hidden);
    AddTo(ranges[InputOf(row.name)], answers.of[0], shortfall.empty(), hidden);
    if (!hidden) {
      EXPECT_EQ(shortfall, "") << row.name;
    }
  }
  PrintRanges(ranges);
}

TEST(TapFurtherStudy, IntervalsHoldOverEachInput) { StudyRows("one input", FurtherRows()); }

TEST(TapFurtherStudy, IntervalsHoldWhereInputsMeet) { StudyRows("inputs", CrossedRows()); }

// What the answers of a draw are filed under.
struct Group {
  std::string name;
  bool (*has)(const TapRow& row);
};

std::string Octave(double value) {
  const double lo = std::exp2(std::floor(std::log2(value)));
  return fmt::format("{:.3g} - {:.3g}", lo, 2 * lo);
}

bool IsUndisturbed(const TapRow& row) {
  const sim::CellTraits& c = row.cell;
  const sim::DisturbanceTraits& d = c.disturbance;
  return row.latency_known && c.press.law.toe_mm == 0 && d.mode_share == 0 && d.swing_g == 0 &&
         c.press.strand_g == 0 && d.slip_g == 0 && c.faults.held_share == 0 &&
         c.faults.jitter == 0 && d.pink_g == 0 && d.wander_g == 0 && d.hum_g == 0 &&
         c.converter.latency_s == 0 && c.converter.creep_share == 0 &&
         c.press.onset == sim::Onset::kInstant && c.press.creep_share == 0 &&
         c.converter.counts_per_g > 50 && d.drift_g_s == 0 && c.faults.drop_share == 0;
}

template <sim::ContactKind... kinds>
bool IsUndisturbedOf(const TapRow& row) {
  return IsUndisturbed(row) && ((row.cell.press.law.kind == kinds) || ...);
}

using enum sim::ContactKind;
const Group kGroups[] = {
    {"nothing else, latency known", IsUndisturbed},
    {"the same, polynomial press", IsUndisturbedOf<kLinear, kQuadratic, kCubic>},
    {"the same, press by a power", IsUndisturbedOf<kPower>},
    {"the same, two slopes", IsUndisturbedOf<kTwoSlope>},
    {"the same, yielding press", IsUndisturbedOf<kYielding>},
    {"toe", [](const TapRow& r) { return r.cell.press.law.toe_mm > 0; }},
    {"ringing", [](const TapRow& r) { return r.cell.disturbance.mode_share > 0; }},
    {"swing", [](const TapRow& r) { return r.cell.disturbance.swing_g > 0; }},
    {"strand", [](const TapRow& r) { return r.cell.press.strand_g > 0; }},
    {"slip", [](const TapRow& r) { return r.cell.disturbance.slip_g != 0; }},
    {"held", [](const TapRow& r) { return r.cell.faults.held_share > 0; }},
    {"coarse counts", [](const TapRow& r) { return r.cell.converter.counts_per_g < 50; }},
    {"jitter", [](const TapRow& r) { return r.cell.faults.jitter > 0; }},
    {"1/f", [](const TapRow& r) { return r.cell.disturbance.pink_g > 0; }},
    {"wander", [](const TapRow& r) { return r.cell.disturbance.wander_g > 0; }},
    {"hum", [](const TapRow& r) { return r.cell.disturbance.hum_g > 0; }},
    {"latency", [](const TapRow& r) { return r.cell.converter.latency_s > 0; }},
    {"latency unknown", [](const TapRow& r) { return !r.latency_known; }},
    {"creep of the cell", [](const TapRow& r) { return r.cell.converter.creep_share > 0; }},
    {"play", [](const TapRow& r) { return r.cell.press.onset != sim::Onset::kInstant; }},
    {"drift", [](const TapRow& r) { return r.cell.disturbance.drift_g_s != 0; }},
    {"creep of the bed", [](const TapRow& r) { return r.cell.press.creep_share > 0; }},
    {"drops", [](const TapRow& r) { return r.cell.faults.drop_share > 0; }},
};

void PrintGroup(const std::string& name, const TapAnswers& a) {
  if (a.taps() == 0) return;
  fmt::print("| {} | {} | {:.0f} % | ", name, a.taps(), 100 * (1 - a.RefusedShare()));
  if (a.error_um.size() < 2) {
    fmt::print("- | - | - | - | {} | - |\n", a.Reasons(2));
    return;
  }
  fmt::print("{:.1f} | {:+.2f} | {:.2f} | {:.2f} | {} | {} |\n", 100 * a.Coverage(),
             Median(a.error_um), a.Worst(), Median(a.half_width_um), a.Reasons(2), a.WorstSeeds(3));
}

struct Miss {
  std::uint64_t seed = 0;
  double error_um = 0;
  double half_width_um = 0;
  [[nodiscard]] double Ratio() const { return std::abs(error_um) / half_width_um; }
};

std::vector<Miss> FurthestMisses(const TapAnswers& answers) {
  constexpr std::size_t kMost = 30;
  std::vector<Miss> misses;
  for (std::size_t i = 0; i < answers.seed.size(); ++i) {
    const Miss miss{answers.seed[i], answers.error_um[i], answers.half_width_um[i]};
    if (!(miss.Ratio() <= 1)) misses.push_back(miss);
  }
  std::sort(misses.begin(), misses.end(),
            [](const Miss& a, const Miss& b) { return a.Ratio() > b.Ratio(); });
  misses.resize(std::min(misses.size(), kMost));
  return misses;
}

void StudyDraw(const char* name, void (*draw)(TapRow&, Random&), double least_coverage) {
  const int taps = 5 * std::max(1, static_cast<int>(FromEnvironment("TRAMMEL_TAPS", 100)));
  const std::uint64_t seed = FromEnvironment("TRAMMEL_TAPS_SEED", kReportedTapSeed);
  TapRow row;
  row.draw = draw;
  TapAnswers all;
  std::map<double, TapAnswers> octaves;
  std::vector<TapAnswers> groups(std::size(kGroups));
  for (int i = 0; i < taps; ++i) {
    const std::uint64_t tap_seed = seed + static_cast<std::uint64_t>(i);
    const sim::SimulatedTap simulated = SimulateRow(row, tap_seed);
    const std::vector<tap::Move> moves = MovesOf(simulated);
    tap::TapOptions options;
    if (row.latency_known) options.latency_s = std::max(0.0, simulated.latency_s);
    tap::TapAnalyser analyser(options);
    const auto analysis = analyser.Analyse({simulated.time_s, simulated.force_g, moves});
    const double contact_z_mm = simulated.truth ? simulated.truth->contact_z_mm : std::nan("");
    Add(analysis, contact_z_mm, tap_seed, all);
    Add(analysis, contact_z_mm, tap_seed,
        octaves[std::floor(std::log2(row.cell.disturbance.noise_g))]);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (kGroups[g].has(row)) Add(analysis, contact_z_mm, tap_seed, groups[g]);
    }
  }
  fmt::print(
      "\n{}: {} taps, seeds from {}; um.\n\n| taps with | taps | good | covered | median error | "
      "worst | median half-width | refused because | misses: seed, error over half-width |\n"
      "|---|---|---|---|---|---|---|---|---|\n",
      name, taps, seed);
  PrintGroup("all", all);
  for (const auto& [octave, answers] : octaves) {
    PrintGroup(fmt::format("noise {} gf", Octave(1.0001 * std::exp2(octave))), answers);
  }
  for (std::size_t g = 0; g < groups.size(); ++g) PrintGroup(kGroups[g].name, groups[g]);
  fmt::print("\nFurthest outside of their intervals:\n");
  for (const Miss& miss : FurthestMisses(all)) {
    (void)SimulateRow(row, miss.seed);
    fmt::print("- {}: {:+.2f} of {:.2f}: {}\n", miss.seed, miss.error_um, miss.half_width_um,
               Describe(row));
  }
  std::fflush(stdout);
  if (all.error_um.size() >= kFewestOfDraw) {
    EXPECT_GE(all.Coverage(), least_coverage) << name;
  }
}

TEST(TapFurtherStudy, IntervalsHoldOnTapsOfAnyPrinter) {
  StudyDraw("Any printer, at most two disturbances", DrawOrdinaryTap, kLeastOfDraws);
  StudyDraw("Any printer, each disturbance with one chance in three", DrawAnyTap, kLeastOfDraws);
}

}  // namespace
}  // namespace trammel
