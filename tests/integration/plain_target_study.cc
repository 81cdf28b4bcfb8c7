// Counts the plain targets that a survey finds, and the false ones, and compares their errors with
// their covariance. Prints the tables that docs/howto/part-alignment-survey.md quotes.
//
// TRAMMEL_STUDY_SEEDS: networks of a row, 20 without it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>

#include "alignment_study.h"
#include "base/statistics.h"
#include "plain_scene.h"

namespace trammel {
namespace {

constexpr int kReportedNetworks = 20;
constexpr double kMinFound = 0.98;  // share of those shown

std::uint64_t Networks() { return test::WorldsOfStudy(kReportedNetworks); }
std::uint64_t FirstSeed() { return test::FirstSeedOfStudy(); }

struct Row {
  int good = 0;
  int answered = 0;  ///< plain targets not refused
  PlainCounts sum;
  int nees_within = 0;
  int coded_within = 0;
  double min_found = 1;
  double seconds = 0;
  double longest_s = 0;
};

bool IsWithin(double nees, int freedom) {
  return freedom > 0 && nees > ChiSquareQuantile(0.025, freedom) &&
         nees < ChiSquareQuantile(0.975, freedom);
}

void Add(const PlainCounts& counts, Row& row) {
  PlainCounts& sum = row.sum;
  sum.shown += counts.shown;
  sum.found += counts.found;
  sum.pairs_shown += counts.pairs_shown;
  sum.pairs_found += counts.pairs_found;
  sum.beyond += counts.beyond;
  sum.given += counts.given;
  sum.twice += counts.twice;
  sum.coded_again += counts.coded_again;
  sum.astray += counts.astray;
  sum.between += counts.between;
  sum.on_screws += counts.on_screws;
  sum.moved_given += counts.moved_given;
  sum.nees += counts.nees;
  sum.freedom += counts.freedom;
  sum.coded_nees += counts.coded_nees;
  sum.coded_freedom += counts.coded_freedom;
  sum.squares_mm2 += counts.squares_mm2;
  sum.stated_mm2 += counts.stated_mm2;
  sum.worst_mm = std::max(sum.worst_mm, counts.worst_mm);
  sum.coordinates += counts.coordinates;
  if (IsWithin(counts.nees, counts.freedom)) ++row.nees_within;
  if (IsWithin(counts.coded_nees, counts.coded_freedom)) ++row.coded_within;
  if (counts.shown > 0) {
    row.min_found = std::min(row.min_found, static_cast<double>(counts.found) / counts.shown);
  }
}

Row Repeat(const PlainScene& scene) {
  Row row;
  for (std::uint64_t i = 0; i < Networks(); ++i) {
    const std::uint64_t seed = FirstSeed() + i;
    const PlainWorld world = DrawPlainWorld(scene, seed);
    const auto input = PlainInput(world);
    const auto start = std::chrono::steady_clock::now();
    const auto survey = part_alignment::SolveSurvey(input, {});
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    row.seconds += seconds;
    row.longest_s = std::max(row.longest_s, seconds);
    EXPECT_TRUE(survey) << (survey ? "" : survey.error().message);
    if (!survey) continue;
    if (survey->verdict != Verdict::kGood) {
      fmt::print("seed {}: {}: {}\n", seed, ToString(survey->verdict), survey->reason);
      continue;
    }
    ++row.good;
    if (survey->plain.refused) {
      fmt::print("seed {}: no plain targets: {}\n", seed, survey->plain.reason);
      continue;
    }
    ++row.answered;
    const PlainCounts counts = CountPlain(world, *survey);
    if (counts.astray > 0 || counts.twice > 0) {
      fmt::print("seed {}: {} astray, {} twice\n", seed, counts.astray, counts.twice);
    }
    Add(counts, row);
  }
  return row;
}

double Share(double part, double whole) { return whole > 0 ? part / whole : 0; }

void PrintHead() {
  fmt::print(
      "\n| network | good, plain given | found of shown | % | least % of a network | of pairs | of "
      "fewer pictures | astray (in pairs, on screws) | twice (coded) | rms um | worst um | stated "
      "/ "
      "seen | NEES in 95 % | NEES / freedom | of coded | s, longest |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

void Print(const std::string& name, const Row& row) {
  const PlainCounts& sum = row.sum;
  fmt::print(
      "| {} | {}, {} of {} | {} of {} | {:.2f} | {:.1f} | {} of {} | {} | {} ({}, {}) | {} ({}) | "
      "{:.1f} | {:.0f} | {:.3f} | {} | {:.3f} | {} {:.3f} | {:.1f}, {:.1f} |\n",
      name, row.good, row.answered, Networks(), sum.found, sum.shown,
      100 * Share(sum.found, sum.shown), 100 * row.min_found, sum.pairs_found, sum.pairs_shown,
      sum.beyond, sum.astray, sum.between, sum.on_screws, sum.twice, sum.coded_again,
      1e3 * std::sqrt(Share(sum.squares_mm2, sum.coordinates)), 1e3 * sum.worst_mm,
      std::sqrt(Share(sum.stated_mm2, sum.squares_mm2)), row.nees_within,
      Share(sum.nees, sum.freedom), row.coded_within, Share(sum.coded_nees, sum.coded_freedom),
      row.seconds / static_cast<double>(Networks()), row.longest_s);
  std::fflush(stdout);
}

void Expect(const Row& row) {
  EXPECT_EQ(row.answered, static_cast<int>(Networks()));
  EXPECT_GE(row.sum.found, kMinFound * row.sum.shown);
  EXPECT_EQ(row.sum.astray, 0);
  EXPECT_EQ(row.sum.twice, 0);
}

TEST(PlainTargetStudy, GivesTheTargetsOfAPartOfTwoMetresAndNoOthers) {
  PrintHead();
  for (const double sigma_px : {0.03, 0.05, 0.1}) {
    PlainScene scene;
    scene.pictures.sigma_px = sigma_px;
    const Row row = Repeat(scene);
    Print(fmt::format("100 pictures, {} px", sigma_px), row);
    Expect(row);
    if (Networks() < std::uint64_t{kReportedNetworks}) continue;
    EXPECT_GE(row.nees_within, static_cast<int>(0.8 * static_cast<double>(Networks())));
  }
}

// Whatever is harder may give fewer; none astray.
TEST(PlainTargetStudy, GivesFewerButNoneAstrayWhereItIsHarder) {
  PrintHead();
  const auto row = [](const std::string& name, const auto& change) {
    PlainScene scene;
    scene.pictures.sigma_px = 0.05;
    change(scene);
    const Row of = Repeat(scene);
    Print(name, of);
    EXPECT_EQ(of.sum.astray, 0) << name;
    EXPECT_EQ(of.sum.twice, 0) << name;
  };
  row("no discs told", [](PlainScene& scene) { scene.discs = false; });
  row("50 pictures", [](PlainScene& scene) { scene.walk.pictures = 50; });
  row("25 pictures", [](PlainScene& scene) { scene.walk.pictures = 25; });
  row("30 % missed", [](PlainScene& scene) { scene.pictures.missed = 0.3; });
  row("300 spurious", [](PlainScene& scene) { scene.pictures.spurious = 300; });
  row("60 screws, 0.05 px", [](PlainScene& scene) {
    scene.part.screws = 60;
    scene.pictures.glint_px = 0.05;
  });
  row("20 codes", [](PlainScene& scene) { scene.part.coded = 20; });
  row("1000 plain targets", [](PlainScene& scene) { scene.part.plain = 1000; });
  row("grid of 20 x 20 at 12 mm", [](PlainScene& scene) {
    scene.part.plain = 600;
    scene.part.grid_columns = 20;
    scene.part.grid_rows = 20;
    scene.part.grid_pitch_mm = 12.5;
  });
  row("1 px", [](PlainScene& scene) { scene.pictures.sigma_px = 1; });
}

TEST(PlainTargetStudy, DoesNotMixTheTwoPlacesOfATargetThatMoved) {
  fmt::print("\n| moved by mm | astray | given where it was, then or later | found of shown |\n");
  fmt::print("|---|---|---|---|\n");
  for (const double moved_mm : {0.3, 1.0, 5.0, 30.0}) {
    PlainScene scene;
    scene.pictures.sigma_px = 0.05;
    scene.moved_mm = moved_mm;
    const Row row = Repeat(scene);
    fmt::print("| {} | {} | {} | {} of {} |\n", moved_mm, row.sum.astray, row.sum.moved_given,
               row.sum.found, row.sum.shown);
    std::fflush(stdout);
    EXPECT_EQ(row.sum.astray, 0) << moved_mm;
  }
}

}  // namespace
}  // namespace trammel
