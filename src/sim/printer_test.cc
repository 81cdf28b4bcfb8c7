#include "sim/printer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/test_pattern.h"

namespace trammel::sim {
namespace {

TEST(Printer, LaysTenLinesWithSamplesNoFurtherApartThanTheContract) {
  Random random(1);
  const auto print = PrintGcode(WriteTestPattern({}), PrinterTraits{}, random);
  ASSERT_TRUE(print) << print.error().message;
  ASSERT_EQ(print->bed.strands.size(), 10U);
  EXPECT_TRUE(print->notes.empty());
  EXPECT_NEAR(print->truth.pressure_advance_s, 0.036, 1e-12);
  for (const Strand& strand : print->bed.strands) {
    for (std::size_t i = 1; i < strand.samples.size(); ++i) {
      const BeadSample& a = strand.samples[i - 1];
      const BeadSample& b = strand.samples[i];
      EXPECT_LE(std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm), 0.05);
    }
  }
}

}  // namespace
}  // namespace trammel::sim
