// Patterns alike on one plate: all lines in one fit, or the mean of one fit each, with and without
// a lag that differs from pattern to pattern. Prints the table that docs/pressure-advance.md
// quotes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/square.h"
#include "base/statistics.h"
#include "extruder_world.h"
#include "from_environment.h"
#include "pressure_advance/pattern/pattern_presets.h"
#include "pressure_advance/response/repeats.h"
#include "pressure_advance/response/response.h"

namespace trammel {
namespace {

namespace pa = pressure_advance;
using test::ExtruderWorld;
using test::FromEnvironment;

struct Tally {
  std::vector<double> error_ms, half_ms;
  int covered = 0, disagree = 0;

  void Add(const Quantity& q, double truth_s) {
    error_ms.push_back(1e3 * (q.value - truth_s));
    half_ms.push_back(1e3 * (q.interval95.hi - q.interval95.lo) / 2);
    covered += q.interval95.lo <= truth_s && truth_s <= q.interval95.hi;
  }
  [[nodiscard]] std::string Text() const {
    double squares = 0;
    for (const double error : error_ms) squares += error * error;
    const auto count = static_cast<double>(error_ms.size());
    return fmt::format("{:>6.2f} {:>6.2f} {:>6.1f} %", std::sqrt(squares / count), Mean(half_ms),
                       100 * covered / count);
  }
};

// By their uncertainties, as if nothing but these lay between them.
Quantity WeighedMean(const std::vector<Measured>& patterns) {
  double weights = 0, sum = 0, halves = 0;
  for (const Measured& pattern : patterns) {
    if (!pattern.good()) continue;
    const Quantity& q = pattern.quantity();
    const double half = (q.interval95.hi - q.interval95.lo) / 2;
    weights += 1 / Square(q.standard_uncertainty), sum += q.value / Square(q.standard_uncertainty);
    halves += 1 / Square(half);
  }
  const double mean = sum / weights, half = 1 / std::sqrt(halves);
  return {mean, 1 / std::sqrt(weights), {mean - half, mean + half}};
}

std::vector<double> Values(const Interval& range_s) {
  constexpr int kLines = 10;
  std::vector<double> values;
  for (int i = 0; i < kLines; ++i) {
    values.push_back(std::lerp(range_s.lo, range_s.hi, static_cast<double>(i) / (kLines - 1)));
  }
  return values;
}

// A printer, and the pattern of ten lines up to 0.06 s. TRAMMEL_STUDY_PRESET: whose lines and scan.
// @param part  of that range, where its lag lies
ExtruderWorld DrawWorld(Random& random, const Interval& part) {
  const char* name = std::getenv("TRAMMEL_STUDY_PRESET");
  const auto preset =
      pa::ParsePatternPreset(name == nullptr ? "" : name).value_or(pa::kDefaultPreset);
  ExtruderWorld world = test::WorldOf(preset);
  world.law = test::PowerLaw(random.Uniform(0.4, 1));
  world.second_share = random.Uniform() < 0.3 ? random.Uniform(0, 0.3) : 0;
  world.slip = random.Uniform() < 0.3 ? random.Uniform(0, 0.05) : 0;
  world.gaps_are_lost = random.Uniform() < 0.5;
  world.pressure_advance_s = Values({0, 0.06});
  world.k_star_s = 0.06 * random.Uniform(part.lo, part.hi);
  return world;
}

// The printer's own lag is the truth; each pattern's differs from it.
TEST(RepeatStudy, SaysHowManyPatternsAreWorth) {
  const int runs = FromEnvironment("TRAMMEL_STUDY_SEEDS", 100);
  const int first = FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", 1000);
  fmt::print(
      "\neach: rms error, mean half width (ms), truth in the 95 % interval\n{:<26} | {:<24} | "
      "{:<24} | {:<24} | said to disagree\n",
      "", "mean of one fit each", "one fit of all lines", "the answer");
  const std::string only = std::getenv("TRAMMEL_STUDY_ROW") ? std::getenv("TRAMMEL_STUDY_ROW") : "";
  for (const double between : {0.0, 0.01, 0.03}) {
    for (const int count : {2, 3, 5}) {
      const std::string name = fmt::format("{} patterns, {:.0f} % between", count, 100 * between);
      if (name.find(only) == std::string::npos) continue;
      Tally mean, joint, answer;
      for (int i = 0; i < runs; ++i) {
        Random random(static_cast<std::uint64_t>(first + i));
        const ExtruderWorld world = DrawWorld(random, {0.4, 0.7});
        const double truth_s = test::TruePressureAdvance(world);
        std::vector<pa::LineProfile> all;
        std::vector<Measured> alone;
        for (int k = 0; k < count; ++k) {
          ExtruderWorld one = world;
          one.k_star_s *= 1 + between * random.Normal();
          auto lines = test::PrintPattern(one, random);
          alone.push_back(pa::FitResponse(lines, one.Motion()).response.pressure_advance);
          all.insert(all.end(), lines.begin(), lines.end());
        }
        const auto fit = pa::FitResponse(all, world.Motion());
        if (!fit.response.pressure_advance.good()) continue;
        const Quantity& q = fit.response.pressure_advance.quantity();
        const auto repeated = pa::CombineRepeats(q, alone, {0, 0.06}, 1);
        mean.Add(WeighedMean(alone), truth_s);
        joint.Add(q, truth_s);
        answer.Add(repeated.first.pressure_advance.quantity(), truth_s);
        answer.disagree += repeated.second.disagree;
      }
      fmt::print("{:<26} | {} | {} | {} | {} of {}\n", name, mean.Text(), joint.Text(),
                 answer.Text(), answer.disagree, answer.error_ms.size());
      std::fflush(stdout);
    }
  }
}

Measured AnswerOf(const std::vector<pa::LineProfile>& lines, const ExtruderWorld& world) {
  return pa::FitResponse(lines, world.Motion()).response.pressure_advance;
}

// Whether a second pattern over fewer values about a good answer says more than the same once more.
TEST(RepeatStudy, SaysWhatANarrowerSecondPatternGains) {
  const int runs = FromEnvironment("TRAMMEL_STUDY_SEEDS", 100);
  const int first = FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", 1000);
  Tally one, alike, half, quarter;
  for (int i = 0; i < runs; ++i) {
    Random random(static_cast<std::uint64_t>(first + i));
    const ExtruderWorld world = DrawWorld(random, {0.3, 0.7});
    const double truth_s = test::TruePressureAdvance(world);
    const auto lines = test::PrintPattern(world, random);
    const Measured answer = AnswerOf(lines, world);
    if (!answer.good()) continue;
    one.Add(answer.quantity(), truth_s);
    const double about_s = answer.quantity().value;
    const Random again = random;  // the same scatter for each of them
    const auto with = [&](const Interval& range_s, Tally& tally) {
      ExtruderWorld second = world;
      second.pressure_advance_s = Values(range_s);
      Random same = again;
      auto all = test::PrintPattern(second, same);
      all.insert(all.end(), lines.begin(), lines.end());
      const Measured both = AnswerOf(all, world);
      if (both.good()) tally.Add(both.quantity(), truth_s);
    };
    with({0, 0.06}, alike);
    with({about_s - 0.015, about_s + 0.015}, half);
    with({std::max(0.0, about_s - 0.0075), about_s + 0.0075}, quarter);
  }
  fmt::print("\neach: rms error, mean half width (ms), truth in the 95 % interval\n");
  for (const auto& [name, tally] : {std::pair{"one pattern", &one},
                                    {"and the same again", &alike},
                                    {"and one half as wide", &half},
                                    {"and one a quarter as wide", &quarter}}) {
    fmt::print("{:<26} | {} of {}\n", name, tally->Text(), tally->error_ms.size());
  }
}

// What a second pattern says where the first one asks for another range.
TEST(RepeatStudy, SaysHowSureASecondPatternIsWhereTheFirstAsksForIt) {
  const int runs = FromEnvironment("TRAMMEL_STUDY_SEEDS", 100);
  const int first = FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", 1000);
  fmt::print("\n{:<26} | {:<30} | its lines and the first's\n", "truth, of the first range",
             "the second's lines alone");
  for (const Interval& part : {Interval{0.95, 1.05}, {1.1, 1.5}, {1.5, 2}}) {
    Tally alone, joint;
    int asked = 0;
    for (int i = 0; i < runs; ++i) {
      Random random(static_cast<std::uint64_t>(first + i));
      ExtruderWorld world = DrawWorld(random, part);
      const double truth_s = test::TruePressureAdvance(world);
      const auto lines = test::PrintPattern(world, random);
      const auto next_s = pa::FitResponse(lines, world.Motion()).response.print_next_s;
      if (!next_s) continue;
      ++asked;
      world.pressure_advance_s = Values(*next_s);
      auto all = test::PrintPattern(world, random);
      if (const Measured own = AnswerOf(all, world); own.good()) alone.Add(own.quantity(), truth_s);
      all.insert(all.end(), lines.begin(), lines.end());
      if (const Measured both = AnswerOf(all, world); both.good()) {
        joint.Add(both.quantity(), truth_s);
      }
    }
    fmt::print("{:<26} | {} {} of {} | {} {} of {}\n",
               fmt::format("{:.2f} to {:.2f}", part.lo, part.hi), alone.Text(),
               alone.error_ms.size(), asked, joint.Text(), joint.error_ms.size(), asked);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace trammel
