#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "sim/print/printer.h"
#include "sim/print/test_pattern.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

TEST(World, TruthLiesInTheMiddleHalfOfWhatAPatternTestsByDefault) {
  const std::string gcode = WriteTestPattern({});
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Result<Print> print = PrintInWorld(gcode, seed, {});
    ASSERT_TRUE(print) << print.error().message;
    EXPECT_GE(print->truth.pressure_advance_s, 0.0149) << "seed " << seed;
    EXPECT_LE(print->truth.pressure_advance_s, 0.0451) << "seed " << seed;
  }
}

TEST(World, SeedNamesThePrint) {
  const std::string gcode = WriteTestPattern({});
  const Result<Print> a = PrintInWorld(gcode, 5, 0.03);
  const Result<Print> b = PrintInWorld(gcode, 5, 0.03);
  const Result<Print> c = PrintInWorld(gcode, 6, 0.03);
  ASSERT_TRUE(a && b && c);
  EXPECT_NEAR(a->truth.pressure_advance_s, 0.03, 1e-4);
  const auto areas = [](const Print& print) {
    std::vector<double> all;
    for (const Strand& strand : print.bed.strands) {
      for (const BeadSample& sample : strand.samples) all.push_back(sample.area_mm2);
    }
    return all;
  };
  EXPECT_EQ(areas(*a), areas(*b));
  EXPECT_NE(areas(*a), areas(*c));
}

TEST(World, RefusesAnImpossibleTruth) {
  const Result<Print> print = PrintInWorld(WriteTestPattern({}), 1, -0.2);
  ASSERT_FALSE(print);
  EXPECT_THAT(print.error().message, HasSubstr("-0.2"));
}

}  // namespace
}  // namespace trammel::sim
