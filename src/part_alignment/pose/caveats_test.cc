#include "part_alignment/pose/caveats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "part_alignment/pose/alignment_test_support.h"

namespace trammel::part_alignment {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kToday = "2026-11-22";

struct Bench {
  explicit Bench(double turned_rad) {
    test_support::AlignmentWorld world = test_support::BenchWorld(300);
    world.views.push_back(test_support::ViewOf(
        world, 0, geometry::RotationFromAngles({0, 0, turned_rad}), 300, {10, 20}));
    Random random(5);
    test_support::TakePictures(world, 0, random);
    measurement = MeasurementOf(world, 0.05);
    alignment = Solve(measurement, {}).value();
  }
  [[nodiscard]] std::vector<std::string> Said(
      const SolveOptions& options, const std::optional<CalibrationRecord>& calibration = {}) const {
    return Caveats(measurement, options, alignment, calibration, kToday);
  }
  Measurement measurement;
  Alignment alignment;
};

TEST(Caveats, AnEccentricityIsInTheFigureAndNeedsNoSentence) {
  const Bench one(0);
  EXPECT_THAT(one.Said({}), IsEmpty());
  EXPECT_GT(one.alignment.covariance(0, 0), kUsualEccentricity_mm * kUsualEccentricity_mm);
}

TEST(Caveats, InputsThatLeaveThePlaceOpenAreSpokenOf) {
  Bench bench(0);
  SolveOptions slip;
  slip.inputs.clamp_eccentricity_mm = 15;  // meant in um
  bench.alignment = Solve(bench.measurement, slip).value();
  EXPECT_THAT(bench.Said(slip), ElementsAre(HasSubstr("leaves the part's place uncertain by 30")));
}

TEST(Caveats, ACameraFromOtherDistancesOrYearsIsSpokenOf) {
  const Bench bench(std::numbers::pi);
  SolveOptions options;
  options.inputs.clamp_eccentricity_mm = 0.015;
  EXPECT_THAT(bench.Said(options, CalibrationRecord{"2026-11-01", 200, 400}), IsEmpty());
  EXPECT_THAT(bench.Said(options, CalibrationRecord{"2026-11-01", 395, 1430}),
              ElementsAre(HasSubstr("calibrated (2026-11-01) from 395 to 1430 mm")));
  EXPECT_THAT(bench.Said(options, CalibrationRecord{"2024-11-01", 200, 400}),
              ElementsAre(HasSubstr("calibrated 751 days ago")));
}

TEST(Caveats, NothingIsSaidOfNoAnswer) {
  Bench bench(0);
  bench.alignment.verdict = Verdict::kCannotTell;
  EXPECT_THAT(bench.Said({}, CalibrationRecord{"2024-11-01", 1, 2}), IsEmpty());
}

}  // namespace
}  // namespace trammel::part_alignment
