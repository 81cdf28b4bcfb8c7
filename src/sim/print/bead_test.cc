#include "sim/print/bead.h"

#include <gtest/gtest.h>

#include <cmath>
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

TEST(Bead, EveryShapeHasTheAreaItWasGiven) {
  for (double area = 0; area < 1.5; area += 1e-3) {
    const BeadShape shape = ShapeOf(area, kGapMm, {});
    ASSERT_NEAR(StadiumArea(shape.width_mm, shape.height_mm), area, 1e-12);
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

TEST(Surface, RefusesAGridThatWouldFillTheMemory) {
  EXPECT_THROW((void)RasterizeBed(Bed{}, {0, 0, 1000, 1000}, 0.01), Bug);
  EXPECT_THROW((void)RasterizeBed(Bed{}, {0, 0, NAN, 1}, 0.01), Bug);
}

}  // namespace

}  // namespace trammel::sim
