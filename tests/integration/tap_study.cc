// Studies the contact method on virtual load cells: coverage, bias, scatter and refusals. Prints
// the table of docs/howto/tap.md.
//
// TRAMMEL_STUDY_SEEDS: taps of each world, 1000 without it. TRAMMEL_STUDY_FIRST_SEED: the first
// one's, 500000 without it; nothing may be tuned on those, so use one below 1000 for development.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "base/statistics.h"
#include "support/study.h"
#include "tap/analyse/analyse.h"
#include "tap/samples/finding.h"
#include "tap_worlds.h"

namespace trammel {
namespace {

constexpr double kUmPerMm = 1e3;
constexpr double kMaxOfBound = 1.15;
constexpr double kMaxBiasUm = 0.30;
constexpr double kMaxBiasOfBound = 0.30;  // if the bound is no better than 1 um
constexpr double kBiasDeviations = 3;     // standard errors of the mean
constexpr double kMaxRefused = 0.05;
constexpr double kMaxRefusedOfModelled = 0.02;
constexpr double kMaxCoverageOfModelled = 0.98;  // wider intervals would be of less use
constexpr double kMinRefused = 0.95;             // share of faults
constexpr double kStated = 0.95;
constexpr double kOfDrawn = 0.92;    // any printer: toes, and quiet cells whose press yields
constexpr std::size_t kFewest = 10;  // good taps that are judged

/// 2.9 standard deviations of a share less than it: 93 % of 1000 where 95 % are stated.
double LeastCoverage(double share, std::size_t good) {
  return share - 2.9 * std::sqrt(share * (1 - share) / static_cast<double>(good));
}

/// Cramer-Rao bound of the break: break, sloped baseline and quadratic press, white noise.
/// @param heights_mm  Of the samples above the contact.
double BoundUm(const std::vector<double>& heights_mm, const TapWorld& world) {
  constexpr double kStepMm = 1e-7;  // central difference for the law's slope
  constexpr double kUnitMm = 0.01;  // keeps the matrix well conditioned
  const sim::ContactStiffness& law = world.cell.press.law;
  Eigen::Matrix<double, 5, 5> fisher = Eigen::Matrix<double, 5, 5>::Zero();
  for (const double height_mm : heights_mm) {
    const double depth_mm = std::max(0.0, -height_mm);
    const double slope_g_mm =
        depth_mm > kStepMm
            ? (ContactForce(law, depth_mm + kStepMm) - ContactForce(law, depth_mm - kStepMm)) /
                  (2 * kStepMm)
            : 0;
    const double depth = depth_mm / kUnitMm;
    const Eigen::Vector<double, 5> gradient{slope_g_mm * kUnitMm, 1, height_mm / kUnitMm, depth,
                                            depth * depth};
    fisher += gradient * gradient.transpose() / std::pow(world.cell.disturbance.noise_g, 2);
  }
  return kUmPerMm * kUnitMm * std::sqrt(fisher.inverse()(0, 0));
}

struct Answers {
  std::vector<double> error_um;  ///< per good tap
  std::vector<double> half_width_um;
  int covered = 0;
  int between = 0;  ///< Intervals that reach between the touch and the end of a soft toe.
  int taps = 0;
  std::map<std::string, int> reasons;
  double bound_um = 0;  ///< Mean over the taps.

  [[nodiscard]] std::size_t good() const { return error_um.size(); }
  [[nodiscard]] double Refused() const { return 1 - static_cast<double>(good()) / taps; }
  [[nodiscard]] double Coverage() const { return covered / static_cast<double>(good()); }
};

void Add(const tap::TapAnalysis& analysis, const TapWorld& world, double contact_z_mm,
         Answers& answers) {
  if (analysis.verdict != Verdict::kGood) {
    ++answers.reasons[std::string(tap::Name(analysis.reason.code))];
    return;
  }
  const auto [lo, hi] = analysis.contact_mm.interval95;
  answers.error_um.push_back(kUmPerMm * (analysis.contact_mm.value - contact_z_mm));
  answers.half_width_um.push_back(kUmPerMm * 0.5 * (hi - lo));
  answers.covered += lo <= contact_z_mm && contact_z_mm <= hi;
  answers.between += hi >= contact_z_mm - 2 * world.cell.press.law.toe_mm && lo <= contact_z_mm;
}

Answers Study(TapWorld world, int taps, std::uint64_t first_seed) {
  Answers answers;
  answers.taps = taps;
  for (int i = 0; i < taps; ++i) {
    const sim::SimulatedTap simulated =
        SimulateTapOf(world, first_seed + static_cast<std::uint64_t>(i));
    const double contact_z_mm = simulated.truth ? simulated.truth->contact_z_mm : std::nan("");
    std::vector<tap::Move> moves;
    for (const sim::ZMove& move : simulated.moves) {
      moves.push_back({move.start_time_s, move.duration_s, move.start_velocity_mm_s,
                       move.acceleration_mm_s2, move.start_z_mm, move.z_direction});
    }
    if (world.promise == Promise::kUnbiased) {
      std::vector<double> heights_mm;
      for (const double time_s : simulated.time_s) {
        if (time_s < moves[4].start_time_s) continue;
        heights_mm.push_back(sim::StateAt(simulated.moves, time_s).z_mm - contact_z_mm);
      }
      answers.bound_um += BoundUm(heights_mm, world) / taps;
    }
    tap::TapOptions options;
    if (world.latency_known) options.latency_s = std::max(0.0, simulated.latency_s);
    Add(tap::TapAnalyser(options).Analyse({simulated.time_s, simulated.force_g, moves}), world,
        contact_z_mm, answers);
  }
  return answers;
}

void Print(const TapWorld& world, const Answers& answers) {
  std::string reasons;
  for (const auto& [name, times] : answers.reasons) {
    if (20 * times >= answers.taps) {
      reasons += fmt::format(" `{}` {:.0f} %", name, 100.0 * times / answers.taps);
    }
  }
  fmt::print("| {} | ", world.name);
  if (answers.good() == 0) {
    fmt::print("| | | ");
  } else {
    fmt::print("{:+.2f} ± {:.2f} | {:.1f} % | {:.2f} | ", Mean(answers.error_um),
               StandardDeviation(answers.error_um), 100 * answers.Coverage(),
               Mean(answers.half_width_um));
  }
  fmt::print("{:.1f} % |{} |\n", 100 * answers.Refused(), reasons);
  std::fflush(stdout);
}

void Judge(const TapWorld& world, const Answers& answers) {
  SCOPED_TRACE(world.name);
  if (world.promise == Promise::kRefused) {
    EXPECT_GE(answers.Refused(), kMinRefused);
    return;
  }
  const bool read = world.promise == Promise::kUnbiased || world.promise == Promise::kCovered;
  if (read) {
    EXPECT_LE(answers.Refused(),
              world.promise == Promise::kUnbiased ? kMaxRefusedOfModelled : kMaxRefused);
  }
  if (answers.good() < kFewest) return;
  if (world.promise == Promise::kHidden) {
    EXPECT_GE(answers.between / static_cast<double>(answers.good()),
              LeastCoverage(kStated, answers.good()));
    return;
  }
  const auto within = std::count_if(answers.error_um.begin(), answers.error_um.end(),
                                    [&](double um) { return std::abs(um) <= world.within_um; });
  EXPECT_GE(static_cast<double>(within), 0.99 * static_cast<double>(answers.good()));
  EXPECT_GE(answers.Coverage(), LeastCoverage(world.draw ? kOfDrawn : kStated, answers.good()));
  const double scatter_um = StandardDeviation(answers.error_um);
  const double chance_um =
      kBiasDeviations * scatter_um / std::sqrt(static_cast<double>(answers.good()));
  if (world.promise == Promise::kUnbiased) {
    EXPECT_LE(std::abs(Mean(answers.error_um)),
              std::max(kMaxBiasUm, kMaxBiasOfBound * answers.bound_um) + chance_um);
    EXPECT_LE(scatter_um, kMaxOfBound * answers.bound_um);
    EXPECT_LE(answers.Coverage(), kMaxCoverageOfModelled);
  } else {
    EXPECT_LE(std::abs(Mean(answers.error_um)), Mean(answers.half_width_um) + chance_um);
  }
}

class TapStudy : public testing::TestWithParam<TapWorlds> {};

TEST_P(TapStudy, KeepsItsPromises) {
  const auto [taps, first_seed] = test::SeedsOfStudy(1000, 500'000);
  fmt::print(
      "{}: {} taps a row, seeds from {}; um\n| taps | error | covered | half-width | refused | "
      "because |\n|---|---|---|---|---|---|\n",
      GetParam().group, taps, first_seed);
  for (const TapWorld& world : GetParam().worlds) {
    const Answers answers = Study(world, taps, first_seed);
    Print(world, answers);
    Judge(world, answers);
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, TapStudy, testing::ValuesIn(AllTapWorlds()),
                         [](const testing::TestParamInfo<TapWorlds>& info) {
                           std::string name = info.param.group;
                           std::erase_if(name, [](unsigned char c) { return !std::isalnum(c); });
                           return name;
                         });

}  // namespace
}  // namespace trammel
