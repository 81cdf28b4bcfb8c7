#include "sim/print/printer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "sim/laser/laser_test_support.h"

namespace trammel::sim {

namespace {

using ::testing::HasSubstr;

constexpr double kFilamentAreaMm2 = std::numbers::pi / 4 * 1.75 * 1.75;
constexpr double kNominalAreaMm2 = 0.045899 * kFilamentAreaMm2;

Print MustPrint(const std::string& gcode, const PrinterTraits& traits, std::uint64_t seed) {
  Random random(seed);
  auto print = PrintGcode(gcode, traits, random);
  EXPECT_TRUE(print) << "seed " << seed << ": " << print.error().message;
  return print ? *print : Print{};
}

std::string FaultOf(const std::string& gcode) {
  Random random(1);
  const auto print = PrintGcode(gcode, {}, random);
  EXPECT_FALSE(print);
  return print ? "" : print.error().message;
}

double Volume(const Strand& strand) {
  double volume_mm3 = 0;
  for (std::size_t i = 1; i < strand.samples.size(); ++i) {
    const BeadSample& a = strand.samples[i - 1];
    const BeadSample& b = strand.samples[i];
    volume_mm3 += 0.5 * (a.area_mm2 + b.area_mm2) * std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm);
  }
  return volume_mm3;
}

double MeanArea(const Strand& strand, double from_mm, double to_mm) {
  std::vector<double> area;
  for (const BeadSample& sample : strand.samples) {
    const double at_mm = sample.x_mm - strand.samples.front().x_mm;
    if (at_mm > from_mm && at_mm < to_mm) area.push_back(sample.area_mm2);
  }
  return Mean(area);
}

TEST(Printer, BeadVolumeIsFilamentVolumeWhereFilamentIsConserved) {
  PrinterTraits traits;
  traits.break_area_mm2 = 0.012;
  const Print print = MustPrint(WriteTestPattern({}), traits, 1);
  double volume_mm3 = 0;
  for (const Strand& strand : print.bed.strands) volume_mm3 += Volume(strand);
  // The hot end's storage at the end is at most that at slow flow, tau q = 0.008 mm, and less oozes
  // on the way.
  constexpr double kHeldMm = 0.01;
  EXPECT_NEAR(volume_mm3, 10 * 30 * kNominalAreaMm2, kHeldMm * kFilamentAreaMm2);
}

TEST(Printer, TooLittleAdvanceStarvesAccelerationsAndOverfeedsDecelerations) {
  const Print print = MustPrint(WriteTestPattern({}), {}, 1);
  const Strand& none = print.bed.strands.front();
  EXPECT_LT(MeanArea(none, 8, 10), 0.6 * kNominalAreaMm2);
  EXPECT_GT(MeanArea(none, 21, 23), 2 * kNominalAreaMm2);
  const Strand& much = print.bed.strands.back();
  EXPECT_GT(MeanArea(much, 8, 10), 1.2 * kNominalAreaMm2);
  EXPECT_LT(MeanArea(much, 22, 23.5), 0.3 * kNominalAreaMm2);
}

TEST(Printer, TruthIsTheWantedOneForEveryLawAndSpeed) {
  constexpr double kRelative = 1e-9;
  for (const StorageKind kind :
       {StorageKind::kLinear, StorageKind::kPower, StorageKind::kTanh, StorageKind::kReciprocal}) {
    for (const auto& [slow, fast] : {std::pair{5.0, 150.0}, {10.0, 100.0}, {100.0, 120.0}}) {
      PrinterTraits traits;
      traits.law.kind = kind;
      traits.law.exponent = 0.4;
      traits.k_star_s = 0.05;
      TestPattern pattern;
      pattern.lines = 2;
      pattern.slow_mm_s = slow;
      pattern.fast_mm_s = fast;
      pattern.length_mm = 60;
      const Print print = MustPrint(WriteTestPattern(pattern), traits, 1);
      EXPECT_NEAR(print.truth.pressure_advance_s, 0.05, kRelative * 0.05);
    }
  }
}

TEST(Printer, ASeedNamesOnePrint) {
  Random drawn(11);
  const PrinterTraits traits = DrawTraits(0.03, drawn);
  TestPattern pattern;
  pattern.lines = 2;
  const Print a = MustPrint(WriteTestPattern(pattern), traits, 12);
  const Print b = MustPrint(WriteTestPattern(pattern), traits, 12);
  const Print c = MustPrint(WriteTestPattern(pattern), traits, 13);
  ASSERT_EQ(a.bed.strands.size(), b.bed.strands.size());
  for (std::size_t k = 0; k < a.bed.strands.size(); ++k) {
    for (std::size_t i = 0; i < a.bed.strands[k].samples.size(); ++i) {
      ASSERT_EQ(a.bed.strands[k].samples[i].area_mm2, b.bed.strands[k].samples[i].area_mm2);
    }
  }
  EXPECT_NE(MeanArea(a.bed.strands[0], 10, 20), MeanArea(c.bed.strands[0], 10, 20));
}

TEST(Printer, LagScattersFromLineToLineAsTheTraitSays) {
  // 200 lines at one advance; each line's surplus at the deceleration is (tau_k - K) times the
  // speed change.
  PrinterTraits traits;
  traits.lag_scatter_s = 0.002;
  traits.bed_size_y_mm = 2000;
  TestPattern pattern;
  pattern.lines = 200;
  pattern.length_mm = 60;
  std::string gcode = WriteTestPattern(pattern);
  for (std::size_t at = 0; (at = gcode.find("ADVANCE=", at)) != std::string::npos; ++at) {
    gcode.replace(at, gcode.find(' ', at) - at, "ADVANCE=0.02");
  }
  const Print print = MustPrint(gcode, traits, 2);
  std::vector<double> lag_s;
  for (const Strand& strand : print.bed.strands) {
    const double surplus_mm3 = (MeanArea(strand, 35, 55) - kNominalAreaMm2) * 20;
    lag_s.push_back(0.02 + surplus_mm3 / kNominalAreaMm2 / 145);
  }
  constexpr double kSigmas = 4;
  // The window's ends take a share of 1e-3 of the surplus; 0.2 ms covers it.
  EXPECT_NEAR(Mean(lag_s), 0.036, kSigmas * 0.002 / std::sqrt(200.0) + 2e-4);
  EXPECT_NEAR(StandardDeviation(lag_s), 0.002, kSigmas * 0.002 / std::sqrt(400.0) + 1e-4);
}

TEST(Printer, HostileFilesAreRefusedWithTheirReason) {
  EXPECT_THAT(FaultOf(""), HasSubstr("prints nothing"));
  EXPECT_THAT(FaultOf("G1 X10 F600\nG1 E5\n"), HasSubstr("prints nothing"));
  EXPECT_THAT(FaultOf("M83\nG1 X10 E1 F0.01\n"), HasSubstr("would print for"));
  std::string far = "M83\nG1 F60000\n";
  for (int i = 0; i < 6; ++i) far += "G1 X10000 E1\nG1 X-10000 E1\n";
  EXPECT_THAT(FaultOf(far), HasSubstr("mm of line"));
  EXPECT_THAT(FaultOf("M83\nG1 X10 Einf\n"), HasSubstr("line 2"));
}

TEST(World, TruthLiesInTheMiddleHalfOfWhatAPatternTestsByDefault) {
  const std::string gcode = WriteTestPattern({});
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Result<Print> print = PrintInWorld(gcode, seed, {});
    ASSERT_TRUE(print) << print.error().message;
    EXPECT_GE(print->truth.pressure_advance_s, 0.0149) << "seed " << seed;
    EXPECT_LE(print->truth.pressure_advance_s, 0.0451) << "seed " << seed;
  }
}

TEST(World, RefusesAnImpossibleTruth) {
  const Result<Print> print = PrintInWorld(WriteTestPattern({}), 1, -0.2);
  ASSERT_FALSE(print);
  EXPECT_THAT(print.error().message, HasSubstr("-0.2"));
}

}  // namespace

}  // namespace trammel::sim
