// What lines tell of a lag whose law is not known, and of the law; an estimator that fits the very
// model on printed lines shows whether the bound can be attained. Prints the tables that
// docs/pressure-advance.md quotes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/random.h"
#include "pressure_advance/pattern/pattern_presets.h"
#include "response_bound.h"

namespace trammel {
namespace {

using test::ExtruderWorld, test::LawPoint, test::Nuisance, test::Part;
namespace pa = pressure_advance;

const std::vector<Nuisance> kAll{Nuisance::kExponent, Nuisance::kSecondStage, Nuisance::kSlip,
                                 Nuisance::kDrift, Nuisance::kLostGaps};

ExtruderWorld WorldOf(pa::PatternPreset preset, int lines) {
  ExtruderWorld world = test::WorldOf(preset);
  for (int i = 0; i < lines; ++i) world.pressure_advance_s.push_back(0.06 * i / (lines - 1));
  return world;
}

std::vector<Nuisance> AllBut(Nuisance out) {
  std::vector<Nuisance> rest = kAll;
  std::erase(rest, out);
  return rest;
}

const char* ToString(Part part) {
  return part == Part::kWhole          ? "whole"
         : part == Part::kAcceleration ? "acceleration"
                                       : "deceleration";
}

void PrintRow(const std::string& name, const ExtruderWorld& world, Part part) {
  constexpr LawPoint kLinear{};
  const test::PatternModel model = test::ModelOf(world, kLinear, part);
  const double known = test::BoundOf(model, {});
  fmt::print("{:<32} | {:>5.2f}", name, 1e3 * known);
  for (const Nuisance nuisance : kAll) {
    const double bound = test::BoundOf(model, {nuisance});
    EXPECT_GE(bound, known * (1 - 1e-9)) << name;
    fmt::print(" {:>5.2f}", 1e3 * bound);
  }
  const double all = test::BoundOf(model, kAll);
  EXPECT_GE(all, known) << name;
  const auto apart = [&](const LawPoint& other, Nuisance of) {
    return test::ApartOf(model, test::ModelOf(world, other, part), AllBut(of));
  };
  fmt::print(" {:>5.2f} | {:>5.1f} {:>5.1f}\n", 1e3 * all,
             apart({.exponent = 0.5}, Nuisance::kExponent),
             apart({.second_share = 0.3}, Nuisance::kSecondStage));
  std::fflush(stdout);
}

TEST(ResponseBound, SaysWhatLinesTellOfALawThatIsNotKnown) {
  fmt::print(
      "\nleast rms error, ms: law known; learnt: exponent, second stage, slip, drift, lost gaps, "
      "all "
      "| standard deviations from an exponent of 0.5, from two stages of 30 %\n");
  for (const auto preset : {pa::PatternPreset::kQuick, pa::PatternPreset::kPaper}) {
    for (const int lines : {5, 10, 20}) {
      for (const bool beads : {false, true}) {
        ExtruderWorld world = WorldOf(preset, lines);
        if (beads) world.reading_noise = 0;
        for (const Part part : {Part::kWhole, Part::kAcceleration, Part::kDeceleration}) {
          PrintRow(fmt::format("{}, {} lines, {}, {}", ToString(preset), lines,
                               beads ? "beads" : "laser", ToString(part)),
                   world, part);
        }
      }
    }
  }
}

// Fits the very model that the bound is of.
double OracleValue(const ExtruderWorld& world, const std::vector<pa::LineProfile>& profiles) {
  LawPoint at{.k_star_s = 0.03, .exponent = 0.75, .slip = 0.02, .lost_gaps = 0.5};
  double level = 1;
  const Eigen::MatrixXd prior = test::PriorOf(kAll);
  constexpr int kIterations = 8;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const test::PatternModel model = test::ModelOf(world, at, Part::kWhole);
    Eigen::MatrixXd information = prior;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(prior.rows());
    right.tail(test::kNuisances) =
        prior.diagonal()
            .tail(test::kNuisances)
            .cwiseProduct(
                Eigen::VectorXd::Map(std::vector{0.65 - at.exponent, 0.15 - at.second_share,
                                                 0.05 - at.slip, -at.drift, 0.5 - at.lost_gaps}
                                         .data(),
                                     test::kNuisances));
    for (std::size_t i = 0; i < profiles.size(); ++i) {
      const test::LineModel& line = model.lines[i];
      Eigen::VectorXd off = -level * line.mean;
      for (Eigen::Index k = 0; k < off.size(); ++k) {
        off(k) += profiles[i].samples[static_cast<std::size_t>(k)].area.value / test::kNominal_mm2;
      }
      const auto root = line.root.triangularView<Eigen::Lower>();
      const Eigen::MatrixXd white = root.solve(line.gradient);
      information += white.transpose() * white;
      right += white.transpose() * root.solve(off);
    }
    const Eigen::VectorXd step = information.ldlt().solve(right);
    level += step(0);
    at.k_star_s = std::clamp(at.k_star_s + step(1), 0.005, 0.09);
    at.exponent = std::clamp(at.exponent + step(2), 0.25, 1.0);
    at.second_share = std::clamp(at.second_share + step(3), 0.0, 0.6);
    at.slip = std::clamp(at.slip + step(4), 0.0, 0.15);
    at.drift = std::clamp(at.drift + step(5), -0.8, 0.8);
    at.lost_gaps = std::clamp(at.lost_gaps + step(6), 0.0, 1.0);
  }
  return test::TruePressureAdvance(at.In(world));
}

TEST(ResponseBound, IsAttainedByAFitOfTheLawOnPrintedLines) {
  const char* seeds = std::getenv("TRAMMEL_STUDY_SEEDS");
  const char* first = std::getenv("TRAMMEL_STUDY_FIRST_SEED");
  const int patterns = seeds == nullptr ? 30 : std::atoi(seeds);
  const int first_seed = first == nullptr ? 1000 : std::atoi(first);
  // n patterns know an rms error to 1 / sqrt(2 n) (1 sigma).
  const double share = 3 / std::sqrt(2.0 * patterns);
  for (const LawPoint& law :
       {LawPoint{.k_star_s = 0.033}, LawPoint{.k_star_s = 0.033, .exponent = 0.5},
        LawPoint{.k_star_s = 0.033, .second_share = 0.3}}) {
    ExtruderWorld world = law.In(WorldOf(pa::PatternPreset::kQuick, 10));
    const double truth_s = test::TruePressureAdvance(world);
    double squares = 0;
    for (int i = 0; i < patterns; ++i) {
      Random random(static_cast<std::uint64_t>(first_seed + i));
      world.gaps_are_lost = random.Uniform() < 0.5;
      const double error_s = OracleValue(world, test::PrintPattern(world, random)) - truth_s;
      squares += error_s * error_s;
    }
    const double rms_s = std::sqrt(squares / patterns);
    const double bound_s = test::BoundOf(test::ModelOf(world, law, Part::kWhole), kAll);
    fmt::print("exponent {}, second stage {}: bound {:.2f} ms, attained {:.2f} ms\n", law.exponent,
               law.second_share, 1e3 * bound_s, 1e3 * rms_s);
    std::fflush(stdout);
    EXPECT_NEAR(rms_s, bound_s, share * bound_s);
  }
}

}  // namespace
}  // namespace trammel
