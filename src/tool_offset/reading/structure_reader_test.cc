#include "tool_offset/reading/structure_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "tool_offset/reading/combine.h"
#include "tool_offset/reading/page.h"

namespace trammel::tool_offset {
namespace {

struct Paper {
  double offset_mm = 0.1;
  double noise_mm = 0;
  double wrinkle_mm = 0.02;
  double wrinkle_length_mm = 40;
  double phase = 0;
};

StructureReading Fingers(const SheetSettings& settings, const Paper& paper, Random& random) {
  StructureReading structure;
  for (std::size_t comb = 0; comb < 2; ++comb) {
    for (int i = 0; i < settings.teeth; ++i) {
      FingerReading finger;
      finger.comb = comb;
      finger.finger = i;
      finger.planned_mm =
          (i - (settings.teeth - 1) / 2.0 + (comb == 0 ? -0.25 : 0.25)) * settings.pitch_mm;
      finger.position_mm = 0.07 + 1e-3 * finger.planned_mm + (comb == 1 ? paper.offset_mm : 0) +
                           paper.wrinkle_mm * std::sin(2 * std::numbers::pi * finger.planned_mm /
                                                           paper.wrinkle_length_mm +
                                                       paper.phase);
      if (paper.noise_mm > 0) finger.position_mm += random.Normal(0, paper.noise_mm);
      structure.fingers.push_back(finger);
    }
  }
  return structure;
}

TEST(CombFit, AWrinkleOfTwentyMicronsLeavesLessThanTwentyNanometres) {
  constexpr double kLeft_mm = 2e-5;
  const SheetSettings settings;
  for (double length_mm = 40; length_mm <= 70; length_mm += 3) {
    for (double phase = 0; phase < 6; phase += 0.5) {
      Random random(1);
      StructureReading structure = Fingers(settings, {0.1, 0, 0.02, length_mm, phase}, random);
      FitCombs(settings, structure);
      ASSERT_TRUE(structure.offset_mm.good());
      // The offset is in mm of the sheet, which this paper stretches.
      EXPECT_NEAR(structure.offset_mm.quantity().value, 0.1 / (1 + structure.stretch), kLeft_mm)
          << "length " << length_mm << ", phase " << phase;
      EXPECT_EQ(structure.teeth_used[0] + structure.teeth_used[1], 34);
    }
  }
}

TEST(CombFit, SaysHowFarItIsOffAndComesWithinThreePercentOfTheBestPossible) {
  constexpr int kRepeats = 2000;
  constexpr double kNoise_mm = 0.005;
  const SheetSettings settings;
  std::vector<double> scaled;
  std::vector<double> errors;
  int covered = 0;
  Random random(2);
  for (int i = 0; i < kRepeats; ++i) {
    StructureReading structure = Fingers(
        settings, {0.1, kNoise_mm, 0.02, random.Uniform(40, 70), random.Uniform(0, 6.28)}, random);
    FitCombs(settings, structure);
    ASSERT_TRUE(structure.offset_mm.good());
    const Quantity& offset = structure.offset_mm.quantity();
    const double truth_mm = 0.1 / (1 + structure.stretch);
    errors.push_back(offset.value - truth_mm);
    scaled.push_back(errors.back() / offset.standard_uncertainty);
    if (offset.interval95.lo <= truth_mm && truth_mm <= offset.interval95.hi) ++covered;
  }
  const double best_mm = kNoise_mm * std::sqrt(2.0 / settings.teeth);
  // The standard deviation of 2000 values is right to 1.6 % (k = 1).
  EXPECT_LT(StandardDeviation(errors), best_mm * 1.03 * 1.04);
  EXPECT_NEAR(Mean(errors), 0, 3 * best_mm / std::sqrt(kRepeats));
  EXPECT_NEAR(static_cast<double>(covered) / kRepeats, 0.95, 0.015);
}

TEST(CombFit, LeavesOutATornFingerAndKeepsTheValue) {
  const SheetSettings settings;
  Random random(3);
  StructureReading whole = Fingers(settings, {0.1, 0.005, 0.02, 50, 1}, random);
  StructureReading torn = whole;
  torn.fingers[5].position_mm += 0.08;
  torn.fingers[20].position_mm = std::nan("");  // poisoned, but masked
  torn.fingers[20].left_out = "broken";
  FitCombs(settings, whole);
  FitCombs(settings, torn);
  ASSERT_TRUE(torn.offset_mm.good());
  EXPECT_FALSE(torn.fingers[5].left_out.empty());
  EXPECT_EQ(torn.teeth_used[0], 16);
  EXPECT_EQ(torn.teeth_used[1], 16);
  EXPECT_NEAR(torn.offset_mm.quantity().value, whole.offset_mm.quantity().value,
              whole.offset_mm.quantity().standard_uncertainty);
}

TEST(CombFit, RefusesACombWithTooFewTeeth) {
  const SheetSettings settings;
  Random random(4);
  StructureReading structure = Fingers(settings, {}, random);
  for (std::size_t i = 3; i < 17; ++i) structure.fingers[i].left_out = "broken";
  FitCombs(settings, structure);
  EXPECT_FALSE(structure.offset_mm.good());
  EXPECT_NE(structure.offset_mm.reason().find("only 3 and 17 of 17"), std::string::npos)
      << structure.offset_mm.reason();
}

/// Cover of pixel i, [i - 0.5, i + 0.5], by a bar.
std::vector<float> Bar(double middle, double width, int count) {
  std::vector<float> ink;
  for (int i = 0; i < count; ++i) {
    const double low = std::max(i - 0.5, middle - width / 2);
    const double high = std::min(i + 0.5, middle + width / 2);
    ink.push_back(static_cast<float>(std::max(0.0, high - low)));
  }
  return ink;
}

TEST(HalfInkPlace, IsExactForABarOfAnyWidthAtAnyPlaceAmongThePixels) {
  constexpr double kFloat = 1e-5;
  for (double width = 2.3; width < 9; width += 0.37) {
    for (double middle = 9; middle < 11; middle += 0.13) {
      const auto place = HalfInkPlace(Bar(middle, width, 21), 3, 17);
      ASSERT_TRUE(place.has_value());
      EXPECT_NEAR(place->middle, middle, kFloat);
      EXPECT_NEAR(place->ink, width, kFloat);
    }
  }
}

Measured Value(double value_mm, double uncertainty_mm) {
  return Measured::Good(
      {value_mm, uncertainty_mm, {value_mm - 2 * uncertainty_mm, value_mm + 2 * uncertainty_mm}});
}

SheetResult Scanned(double dx_mm, double uncertainty_mm) {
  SheetResult result;
  ToolReading tool;
  tool.tool = 1;
  tool.dx_mm = tool.dy_mm = Value(dx_mm, uncertainty_mm);
  result.tools.push_back(tool);
  result.backlash_mm = {Value(0.05, 0.001), Value(0.04, 0.001)};
  return result;
}

TEST(Combine, ScansOfOneSheetDoNotMakeThePrintMoreCertain) {
  const std::vector<std::vector<SheetResult>> sheets{
      {Scanned(0.1001, 0.001), Scanned(0.0999, 0.001), Scanned(0.1000, 0.001)}};
  const CombinedResult combined = Combine(sheets);
  const Quantity& dx = combined.tools[0].dx_mm.quantity();
  EXPECT_NEAR(dx.value, 0.1, 1e-12);
  EXPECT_NEAR(dx.standard_uncertainty, std::hypot(0.001, 0.0001 / std::sqrt(3.0)), 1e-12);
  EXPECT_NEAR(combined.tools[0].scan_scatter_mm.u_mm, 0.0001, 1e-12);
  EXPECT_EQ(combined.tools[0].sheets, 1);
}

TEST(Combine, FourSheetsHalveTheUncertaintyAndStillCover) {
  constexpr int kRepeats = 2000;
  Random random(1);
  int covered = 0;
  for (int i = 0; i < kRepeats; ++i) {
    std::vector<std::vector<SheetResult>> sheets;
    for (int k = 0; k < 4; ++k) sheets.push_back({Scanned(random.Normal(0.1, 0.001), 0.001)});
    const Quantity dx = Combine(sheets).tools[0].dx_mm.quantity();
    EXPECT_LT(dx.standard_uncertainty, 0.0016);
    if (dx.interval95.lo <= 0.1 && 0.1 <= dx.interval95.hi) ++covered;
  }
  // Twice the standard uncertainty covers 0.954; three standard deviations of 2000 trials are
  // 0.014.
  EXPECT_NEAR(static_cast<double>(covered) / kRepeats, 0.954, 0.014);
}

TEST(Combine, SheetsThatContradictEachOtherWidenTheInterval) {
  const std::vector<std::vector<SheetResult>> sheets{{Scanned(0.10, 0.001)},
                                                     {Scanned(0.12, 0.001)}};
  const Quantity dx = Combine(sheets).tools[0].dx_mm.quantity();
  EXPECT_NEAR(dx.value, 0.11, 1e-9);
  EXPECT_LT(dx.interval95.lo, 0.10);
  EXPECT_GT(dx.interval95.hi, 0.12);
}

TEST(Combine, FineValuesCountBeforeCoarseOnesAndRefusalsNotAtAll) {
  SheetResult coarse = Scanned(0.2, 0.03);
  coarse.tools[0].coarse = true;
  SheetResult refused = Scanned(0, 1);
  refused.tools[0].dx_mm = refused.tools[0].dy_mm = Measured::Refused("T1 did not print");
  const std::vector<std::vector<SheetResult>> mixed{{coarse}, {refused}, {Scanned(0.1, 0.001)}};
  const CombinedTool fine = Combine(mixed).tools[0];
  EXPECT_FALSE(fine.coarse);
  EXPECT_NEAR(fine.dx_mm.quantity().value, 0.1, 1e-12);
  EXPECT_EQ(fine.sheets, 1);

  const std::vector<std::vector<SheetResult>> rough{{coarse}, {refused}};
  EXPECT_TRUE(Combine(rough).tools[0].coarse);
  const std::vector<std::vector<SheetResult>> none{{refused}};
  EXPECT_EQ(Combine(none).tools[0].dx_mm.reason(), "T1 did not print");
}

}  // namespace

}  // namespace trammel::tool_offset
