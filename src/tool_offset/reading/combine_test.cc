#include "tool_offset/reading/combine.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace trammel::tool_offset {
namespace {

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
