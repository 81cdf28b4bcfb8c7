#include "sim/print/bead.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/check.h"
#include "sim/laser/laser_test_support.h"
#include "sim/print/surface.h"

namespace trammel::sim {

namespace {

constexpr double kGapMm = 0.25;
constexpr double kSpacingMm = 0.04;

double Volume(const std::vector<double>& area) {
  double sum = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    sum += area[i] * (i == 0 || i + 1 == area.size() ? 0.5 : 1);
  }
  return sum;
}

TEST(Bead, TheNominalBeadOfThePaperIsHalfAMillimetreWide) {
  const BeadShape shape = ShapeOf(0.1104, kGapMm, {});
  EXPECT_NEAR(shape.width_mm, 0.495, 1e-3);
  EXPECT_NEAR(shape.height_mm, kGapMm, 1e-12);
}

TEST(Bead, EveryShapeHasTheAreaItWasGiven) {
  for (double area = 0; area < 1.5; area += 1e-3) {
    const BeadShape shape = ShapeOf(area, kGapMm, {});
    ASSERT_NEAR(StadiumArea(shape.width_mm, shape.height_mm), area, 1e-12);
  }
}

TEST(Bead, WidthAndHeightGrowSteadilyWithArea) {
  BeadShape before = ShapeOf(0, kGapMm, {});
  constexpr double kStep = 1e-4;
  for (double area = kStep; area < 1.5; area += kStep) {
    const BeadShape shape = ShapeOf(area, kGapMm, {});
    ASSERT_GE(shape.width_mm, before.width_mm) << area;
    ASSERT_GE(shape.height_mm, before.height_mm - 1e-12) << area;
    ASSERT_LE(shape.width_mm - before.width_mm, 0.012) << area;  // sqrt(4 * kStep / pi) at 0
    before = shape;
  }
}

TEST(Bead, StarvedNarrowsThenSinksAndOverfedRises) {
  const BeadShape narrow = ShapeOf(0.06, kGapMm, {});
  EXPECT_LT(narrow.width_mm, 0.3);
  EXPECT_NEAR(narrow.height_mm, kGapMm, 1e-12);
  EXPECT_LT(ShapeOf(0.03, kGapMm, {}).height_mm, 0.2);
  const BeadShape fat = ShapeOf(0.3, kGapMm, {});
  EXPECT_GT(fat.height_mm, 1.2 * kGapMm);
  EXPECT_GT(fat.width_mm, 0.8);
  EXPECT_LE(ShapeOf(5, kGapMm, {}).height_mm, 2 * kGapMm);
}

TEST(Bead, AThreadHighInTheAirStaysRound) {
  const BeadShape shape = ShapeOf(0.1, 5, {});
  EXPECT_NEAR(shape.width_mm, std::sqrt(0.4 / std::numbers::pi), 1e-12);
  EXPECT_NEAR(shape.height_mm, shape.width_mm, 1e-12);
}

TEST(Smear, KeepsVolumeAndEvenBeadsAndSpreadsASpike) {
  std::vector<double> area(200, 0.1);
  area[0] = 0.5;
  area[100] = 1.1;
  const double before = Volume(area);
  Smear(area, kSpacingMm, 0.3);
  EXPECT_NEAR(Volume(area), before, 1e-12);
  EXPECT_NEAR(area[50], 0.1, 1e-12);
  EXPECT_GT(area[105], 0.11);
  EXPECT_NEAR(area[108], 0.1, 1e-12);  // 0.32 mm away, beyond the footprint
  std::vector<double> tiny = {1, 2};
  Smear(tiny, kSpacingMm, 0.3);
  EXPECT_EQ(tiny, (std::vector<double>{1, 2}));
}

TEST(SpreadSurplus, RoundsABlobAndLeavesAFullBead) {
  const double full = FullArea(kGapMm, {});
  std::vector<double> area(300, full);
  area[0] = 1;
  for (std::size_t i = 145; i < 155; ++i) area[i] = 1;
  const double before = Volume(area);
  SpreadSurplus(area, std::vector<double>(300, full), kSpacingMm);
  EXPECT_NEAR(Volume(area), before, 1e-9);
  EXPECT_LT(area[150], 0.6);
  EXPECT_GT(area[140], full + 0.05);
  EXPECT_EQ(area[80], full);
  for (const double a : area) ASSERT_GE(a, full);
  std::vector<double> thin(50, 0.05);
  SpreadSurplus(thin, std::vector<double>(50, full), kSpacingMm);
  EXPECT_EQ(thin, std::vector<double>(50, 0.05));
}

TEST(BreakUp, GathersDropletsAndKeepsTheVolume) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> area(300, 0.1);
    const double thin = random.Uniform(0, 0.012);
    const std::size_t begin = random.Below(150);
    const std::size_t end = begin + 1 + random.Below(150);
    for (std::size_t i = begin; i < end; ++i) area[i] = thin;
    const double before = Volume(area);
    BreakUp(area, kSpacingMm, 0.012, random);
    ASSERT_NEAR(Volume(area), before, 1e-12) << "seed " << kSeed << " trial " << trial;
    for (const double a : area) ASSERT_GE(a, 0);
  }
}

TEST(BreakUp, LeavesEmptyRoomBetweenDroplets) {
  Random random(4);
  std::vector<double> area(300, 0.006);
  BreakUp(area, kSpacingMm, 0.012, random);
  const auto empty = std::count(area.begin(), area.end(), 0.0);
  EXPECT_GT(empty, 100);
  EXPECT_LT(empty, 250);
}

TEST(BreakUp, TouchesNothingThatIsThickEnough) {
  Random random(4);
  std::vector<double> area(50, 0.0121);
  const std::vector<double> before = area;
  BreakUp(area, kSpacingMm, 0.012, random);
  EXPECT_EQ(area, before);
}

double SectionArea(const Relief& relief, double x_mm, double y0_mm, double y1_mm) {
  double area = 0;
  constexpr double kStep = 0.002;
  for (double y = y0_mm; y < y1_mm; y += kStep) area += kStep * relief.HeightAt(x_mm, y);
  return area;
}

TEST(Surface, BeadKeepsItsAreaWidthAndHeight) {
  // 1 % as declared, for beads of 15 cells and more.
  for (const double width : {0.4, 0.495, 0.7}) {
    const Bed bed = StraightBead(0, 4, 0.007, width, 0.25);
    const Relief relief = RasterizeBed(bed, {-1, -1, 5, 1}, 0.025);
    const double wanted = bed.strands[0].samples[0].area_mm2;
    EXPECT_NEAR(SectionArea(relief, 2.013, -1, 1), wanted, 0.01 * wanted) << width;
    EXPECT_NEAR(relief.HeightAt(2.013, 0.007), 0.25, 0.001);
    EXPECT_EQ(relief.HeightAt(2, 0.007 + width / 2 + 0.026), 0);
    EXPECT_GT(relief.HeightAt(2, 0.007 + width / 2 - 0.03), 0.05);
  }
}

TEST(Surface, KeepsTheAreaOfEveryWidthAtEveryPlace) {
  // What is left is what the table of sections says between its fills.
  constexpr double kShare = 0.002;
  for (double width = 0.3; width < 0.8; width += 0.0037) {
    for (const double y : {0.0, 0.007, 0.0125}) {
      const Bed bed = StraightBead(0, 4, y, width, 0.25);
      const Relief relief = RasterizeBed(bed, {-1, -1, 5, 1}, 0.025);
      const double wanted = bed.strands[0].samples[0].area_mm2;
      EXPECT_NEAR(SectionArea(relief, 2.013, -1, 1), wanted, kShare * wanted) << width << " " << y;
    }
  }
}

TEST(Surface, DiagonalBeadIsTheSameBead) {
  Bed bed = StraightBead(0, 4, 0, 0.5, 0.25);
  for (BeadSample& sample : bed.strands[0].samples) {
    sample.y_mm = sample.x_mm * std::numbers::sqrt2 / 2;
    sample.x_mm = sample.y_mm;
  }
  const Relief relief = RasterizeBed(bed, {-1, -1, 5, 5}, 0.025);
  const double wanted = bed.strands[0].samples[0].area_mm2;
  // A cut along y meets the bead at 45 degrees.
  EXPECT_NEAR(SectionArea(relief, 1.4, 0, 3), wanted * std::numbers::sqrt2, 0.02 * wanted);
}

TEST(Surface, BrokenFilamentLeavesTheBarePlate) {
  Bed bed = StraightBead(0, 4, 0, 0.5, 0.25);
  for (BeadSample& sample : bed.strands[0].samples) {
    if (sample.x_mm > 1.5 && sample.x_mm < 2.5) sample = {sample.x_mm, 0, 0, 0, 0};
  }
  const Relief relief = RasterizeBed(bed, {-1, -1, 5, 1}, 0.025);
  EXPECT_EQ(relief.HeightAt(2, 0), 0);
  EXPECT_GT(relief.HeightAt(1.4, 0), 0.2);
  EXPECT_GT(relief.HeightAt(2.6, 0), 0.2);
}

TEST(Surface, RefusesAGridThatWouldFillTheMemory) {
  EXPECT_THROW((void)RasterizeBed(Bed{}, {0, 0, 1000, 1000}, 0.01), Bug);
  EXPECT_THROW((void)RasterizeBed(Bed{}, {0, 0, NAN, 1}, 0.01), Bug);
}

}  // namespace

}  // namespace trammel::sim
