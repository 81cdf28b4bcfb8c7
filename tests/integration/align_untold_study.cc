// Coverage of the 95 % regions in machines and clampings with unknown properties: the defaults
// against eccentricities, repeatabilities and errors of the targets drawn anew in every clamping.
//
// TRAMMEL_STUDY_SEEDS: clampings of a row, 1000 without it. TRAMMEL_STUDY_FIRST_SEED: of the part,
// or of the first if each clamping has a part with its own errors.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "align_scene.h"
#include "alignment_study.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/solve.h"
#include "sim/spindle/spindle_world.h"

namespace trammel {
namespace {

constexpr double kMinCovered = 0.93;
constexpr double kReportedClampings = 1000;

/// Spreads of a row: standard deviations, or their maximum if each clamping has its own.
struct Spread {
  double eccentricity_mm;
  double repeatability_mm;
  double target_mm = 0;
  bool uniform = false;  ///< each clamping has its own spreads, uniform from 0
  /// Beyond what the usual sizes are made for.
  enum { kUsual, kMayRefuse, kUnseen } beyond = kUsual;
};
constexpr Spread kSpreads[] = {
    {0, 0},
    {0.015, 0},
    {0.015, 0.004},
    {0.015, 0.010},
    {0.020, 0.010},
    {0.020, 0.010, 0, true},
    {0.015, 0.004, 0.020},
    {0.015, 0.004, 0.035},
    {0.020, 0.010, 0.035},
    {0.020, 0.010, 0.035, true},
    {0.040, 0.010, 0, true, Spread::kUnseen},
    {0.030, 0.004, 0, false, Spread::kUnseen},
    {0.040, 0.004, 0, false, Spread::kUnseen},
    {0.015, 0.015, 0, false, Spread::kMayRefuse},
    {0.015, 0.004, 0.050, false, Spread::kMayRefuse},
    {0.015, 0.004, 0.070, false, Spread::kMayRefuse},
    {0.015, 0.004, 0.100, false, Spread::kMayRefuse},
    {0.015, 0.004, 0.200, false, Spread::kMayRefuse},
    {0.015, 0.004, 0.500, false, Spread::kMayRefuse},
};

struct Row {
  int good = 0;
  int cannot_tell = 0;
  int refused = 0;
  int region = 0;  ///< answers whose error lies in the 95 % region of all unknowns
  int axis[3] = {};
  double stated_mm[3] = {};  ///< mean half-width of the 95 % interval
};

constexpr double kHalfWidth95 = 1.959964;
constexpr double kSeven = 14.0671;  // the 95 % point of chi-square with 7 degrees of freedom

/// An answer beside the truth.
void Count(const part_alignment::Alignment& solved, const Eigen::VectorXd& truth, Row& row) {
  ++row.good;
  Eigen::VectorXd found(9);
  found << solved.machine_from_part.translation_mm, solved.machine_from_part.angles_rad,
      solved.clamping.angle_rad, solved.clamping.eccentricity_mm;
  const Eigen::VectorXd error = (found - truth).head(solved.covariance.rows());
  row.region += geometry::SquaredMahalanobisDistance(solved.covariance, error) <= kSeven ? 1 : 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double half_mm = kHalfWidth95 * std::sqrt(solved.covariance(k, k));
    row.axis[k] += std::abs(error[k]) <= half_mm ? 1 : 0;
    row.stated_mm[k] += half_mm;
  }
}

Row Clamp(sim::SpindleSetup setup, const Spread& spread) {
  setup.spread.eccentricity_mm = spread.eccentricity_mm;
  setup.machine.repeatability_mm = spread.repeatability_mm;
  setup.part.out_of_machine_mm = spread.target_mm;
  Random spreads(test::FirstSeedOfStudy());
  part_alignment::SolveOptions options;
  Row row;
  for (std::uint64_t i = 0; i < test::WorldsOfStudy(1000); ++i) {
    if (spread.uniform) {
      setup.spread.eccentricity_mm = spreads.Uniform(0, spread.eccentricity_mm);
      setup.machine.repeatability_mm = spreads.Uniform(0, spread.repeatability_mm);
      setup.part.out_of_machine_mm = spreads.Uniform(0, spread.target_mm);
    }
    const sim::SpindleName name = {test::FirstSeedOfStudy() + (spread.target_mm > 0 ? i : 0), i};
    const sim::SpindleWorld world = sim::DrawSpindleWorld(setup, name);
    const auto solved =
        part_alignment::Solve(test::MeasurementOf(world, name, setup.sigma_px), options);
    EXPECT_TRUE(solved) << (solved ? "" : solved.error().message);
    if (!solved) continue;
    row.cannot_tell += solved->verdict == Verdict::kCannotTell ? 1 : 0;
    row.refused += solved->verdict == Verdict::kRefused ? 1 : 0;
    if (solved->verdict != Verdict::kGood) continue;
    Count(*solved, test::TruthOf(world), row);
  }
  return row;
}

void Print(const Spread& spread, const Row& row) {
  const double n = std::max(1, row.good);
  const char* to = spread.uniform ? "0 … " : "";
  fmt::print(
      "| {0}{1:.0f} | {0}{2:.0f} | {0}{3:.0f} | {4:.1f} | {5:.1f} {6:.1f} {7:.1f} | {8:.1f} "
      "{9:.1f} {10:.1f} | {11} | {12} |\n",
      to, 1000 * spread.eccentricity_mm, 1000 * spread.repeatability_mm, 1000 * spread.target_mm,
      100 * row.region / n, 100 * row.axis[0] / n, 100 * row.axis[1] / n, 100 * row.axis[2] / n,
      1000 * row.stated_mm[0] / n, 1000 * row.stated_mm[1] / n, 1000 * row.stated_mm[2] / n,
      row.cannot_tell, row.refused);
  std::fflush(stdout);
}

void CheckPlan(const std::string& title, const sim::SpindleSetup& setup) {
  fmt::print(
      "\n{}; seed {}, {} clampings a row, nothing stated but {} px\n"
      "| eccentricity um | repeatability um | targets um | region % | X Y Z % | 95 % of X Y Z um | "
      "cannot tell | refused |\n|---|---|---|---|---|---|---|---|\n",
      title, test::FirstSeedOfStudy(), test::WorldsOfStudy(1000), setup.sigma_px);
  for (const Spread& spread : kSpreads) {
    const Row row = Clamp(setup, spread);
    Print(spread, row);
    if (spread.beyond == Spread::kUnseen) continue;  // no residual shows it: printed, not judged
    if (spread.beyond == Spread::kMayRefuse) {
      const auto all = static_cast<double>(test::WorldsOfStudy(1000));
      EXPECT_GE((row.region + row.cannot_tell + row.refused) / all,
                kMinCovered - (all >= kReportedClampings ? 0 : 3 * std::sqrt(0.05 * 0.95 / all)))
          << title;
      continue;
    }
    const double n = row.good;
    EXPECT_GE(n, 0.99 * static_cast<double>(test::WorldsOfStudy(1000))) << title;
    const double chance = 3 * std::sqrt(0.05 * 0.95 / n);
    const double room = n >= kReportedClampings ? 0 : chance;
    EXPECT_GE(row.region / n, kMinCovered - room) << title;
    for (const int inside : row.axis) EXPECT_GE(inside / n, kMinCovered - chance) << title;
  }
}

TEST(AlignUntoldStudy, TheSameTwoViewsOfEachTargetCover) {
  CheckPlan("1.5 x 1 m at 300 mm, two views of each target",
            test::Probed(sim::LaboratoryScene(300)));
}

TEST(AlignUntoldStudy, TheSpindleTurnedByHalfCoversAndTellsMore) {
  CheckPlan("1.5 x 1 m at 300 mm, C at 0 and 180 degrees, seven unknowns",
            test::HalfTurned(test::Probed(sim::LaboratoryScene(300))));
}

}  // namespace
}  // namespace trammel
