#include "sim/print/surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/check.h"
#include "sim/laser/eye_test_support.h"

namespace trammel::sim {
namespace {

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
