#include "part_alignment/pose/contributions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "part_alignment/pose/alignment_test_support.h"

namespace trammel::part_alignment {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct Bench {
  explicit Bench(const SolveOptions& stated) : options(stated) {
    test_support::AlignmentWorld world = test_support::BenchWorld(300);
    Random random(5);
    test_support::TakePictures(world, 0.03, random);
    measurement = MeasurementOf(world, 0.03);
    alignment = Solve(measurement, options).value();
    EXPECT_EQ(alignment.verdict, Verdict::kGood) << alignment.reason;
    parts = ContributionsOf(measurement, options, alignment);
  }
  [[nodiscard]] std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const Contribution& part : parts) names.push_back(part.input);
    return names;
  }
  SolveOptions options;
  Measurement measurement;
  Alignment alignment;
  std::vector<Contribution> parts;
};

TEST(Contributions, AreTheStatedFigureFirstThenWhatWouldHelpMostThenThePicturesAlone) {
  const Bench bench({});
  EXPECT_THAT(bench.Names(), ElementsAre("all", "clamp_eccentricity_mm", "target_mm",
                                         "camera_offset_mm", "machine_mm", "pixels"));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(bench.parts.front().sigma_mm(axis),
                std::sqrt(bench.alignment.covariance(axis, axis)),
                0.02 * bench.parts.front().sigma_mm(axis));
    for (const Contribution& part : bench.parts) {
      EXPECT_LE(part.sigma_mm(axis), 1.0001 * bench.parts.front().sigma_mm(axis)) << part.input;
      EXPECT_GE(part.sigma_mm(axis), 0.9999 * bench.parts.back().sigma_mm(axis)) << part.input;
    }
  }
  EXPECT_TRUE(bench.parts[1].usual);
  EXPECT_EQ(bench.parts[1].size, kUsualEccentricity_mm);
  EXPECT_TRUE(bench.parts[2].usual);
}

TEST(Contributions, OfOneInputAreItsOwnSquareLessThePictures) {
  SolveOptions options;
  options.inputs = ExactInputs();
  options.inputs.clamp_eccentricity_mm = 0.015;
  const Bench bench(options);
  EXPECT_THAT(bench.Names(), ElementsAre("all", "clamp_eccentricity_mm", "pixels"));
  EXPECT_FALSE(bench.parts[1].usual);
  // Views of one C cannot see it: X and Y move by all of it.
  for (const int axis : {0, 1}) {
    EXPECT_NEAR(std::hypot(bench.parts[2].sigma_mm(axis), 0.015), bench.parts[0].sigma_mm(axis),
                2e-5);
  }
}

TEST(Contributions, AreNoneWithoutAnAnswer) {
  Bench bench({});
  bench.alignment.verdict = Verdict::kCannotTell;
  EXPECT_THAT(ContributionsOf(bench.measurement, bench.options, bench.alignment), IsEmpty());
}

}  // namespace
}  // namespace trammel::part_alignment
