#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "sim/scanner/scanner_page.h"

namespace trammel::sim {
namespace {

constexpr std::uint64_t kSeed = 41;  // development

// Lines along y at x = 10 … and along x at y = 40 …, by tool 0 and tool 1 in turn, 10 mm apart.
std::string TwoTools() {
  std::string gcode = "G90\nM83\n";
  for (int i = 0; i < 4; ++i) {
    gcode += fmt::format("T{}\nG0 X{} Y10\nG1 Y20 E0.3\n", i % 2, 10 + 10 * i);
    gcode += fmt::format("G0 X10 Y{}\nG1 X20 E0.3\n", 40 + 10 * i);
  }
  return gcode;
}

TEST(SheetWorld, SheetsShareTheMachineAndScansShareTheSheet) {
  const SheetName name{kSeed, 0, 0};
  const SheetMachine machine = MachineOf(name, SheetScene::kBlackOnWhite);
  const SheetMachine again = MachineOf({kSeed, 1, 3}, SheetScene::kBlackOnWhite);
  EXPECT_EQ(machine.tools[1].offset_mm.x_mm, again.tools[1].offset_mm.x_mm);
  EXPECT_EQ(machine.backlash_mm, again.backlash_mm);
  EXPECT_NE(PrintingOf(name).Fork(0).Bits(), PrintingOf({kSeed, 1, 0}).Fork(0).Bits());
  EXPECT_EQ(PrintingOf(name).Fork(0).Bits(), PrintingOf({kSeed, 0, 1}).Fork(0).Bits());
  EXPECT_NE(ScanningOf(name).Fork(0).Bits(), ScanningOf({kSeed, 0, 1}).Fork(0).Bits());
}

TEST(SheetWorld, TheTruthSaysWhatTheFileSays) {
  const SheetName name{kSeed, 0, 0};
  const SheetMachine machine = MachineOf(name, SheetScene::kBlackOnWhite);
  const auto sheet = PrintSheet(*InterpretSheet(TwoTools(), {}), machine,
                                PaperOf(name, SheetScene::kBlackOnWhite), PrintingOf(name));
  ASSERT_TRUE(sheet);
  const ScannerTraits scanner = ScannerOf(name, *sheet);
  const auto scan = SheetScan::Lay(*sheet, scanner);
  ASSERT_TRUE(scan);
  EXPECT_FALSE(scan->cut_off());
  const auto json = nlohmann::json::parse(SheetTruthJson(name, *sheet, 0, scanner, scan->format()));
  ASSERT_EQ(json["tools"].size(), 1U);
  EXPECT_EQ(json["tools"][0]["tool"], 1);
  EXPECT_DOUBLE_EQ(json["tools"][0]["dx_mm"], machine.tools[1].offset_mm.x_mm);
  EXPECT_DOUBLE_EQ(json["backlash_mm"]["y"], machine.backlash_mm[1]);
  const auto other =
      nlohmann::json::parse(SheetTruthJson(name, *sheet, 5, scanner, scan->format()));
  EXPECT_TRUE(other["tools"][0]["dx_mm"].is_null());
}

}  // namespace
}  // namespace trammel::sim
