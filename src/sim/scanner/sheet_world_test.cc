#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

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

double SampleAt(const ScannedPage& page, int x, int y) {
  std::uint16_t value = 0;
  const auto at = static_cast<std::size_t>(y * page.format.width_px + x);
  std::memcpy(&value, page.samples.data() + 2 * at, 2);
  return value / 65535.0;
}

// Where a line lies that is meant to be at a place of the bed, mm across it; read off the scan.
double SeenAcross(const SheetScan& scan, const ScannedPage& page, const PlaneMm& meant,
                  bool along_y) {
  constexpr int kHalfPx = 40;
  const auto place = scan.PlaceOf(meant);
  const int x0 = static_cast<int>(std::lround(place[0]));
  const int y0 = static_cast<int>(std::lround(place[1]));
  double mass = 0;
  double moment = 0;
  for (int i = -kHalfPx; i <= kHalfPx; ++i) {
    const double dark = 0.82 - (along_y ? SampleAt(page, x0 + i, y0) : SampleAt(page, x0, y0 + i));
    mass += dark;
    moment += dark * i;
  }
  const double centre_px = moment / mass + (along_y ? x0 - place[0] : y0 - place[1]);
  return (along_y ? 1 : -1) * centre_px * 25.4 / 600;
}

// What a person with a microscope would read: the place of tool 1's lines minus that of tool 0's.
PlaneMm SeenOffset(const SheetSetup& setup, const SheetMachine& machine) {
  const auto program = InterpretSheet(TwoTools(), setup);
  EXPECT_TRUE(program) << (program ? "" : program.error().message);
  SheetPaper paper;
  paper.reflectance = {0.82, 0.82, 0.82};
  const auto sheet = PrintSheet(*program, machine, paper, Random(kSeed));
  ScannerTraits traits;
  traits.gamma = 1;
  traits.bits = 16;
  const auto scan = SheetScan::Lay(*sheet, traits);
  const auto page = ScanSheet(*sheet, traits, Random(kSeed));
  PlaneMm offset;
  for (int i = 0; i < 4; ++i) {
    const double sign = i % 2 == 0 ? -0.5 : 0.5;
    offset.x_mm += sign * SeenAcross(*scan, *page, {10.0 + 10 * i, 15}, true);
    offset.y_mm += sign * SeenAcross(*scan, *page, {15, 40.0 + 10 * i}, false);
  }
  return offset;
}

struct Applied {
  SheetFirmware firmware;
  std::string line;  // what takes an offset of (0.3, -0.2) away
};

class RoundTrip : public ::testing::TestWithParam<Applied> {};

TEST_P(RoundTrip, TheAppliedOffsetIsGone) {
  constexpr double kReadingMm = 0.0002;  // of a line on the page, and 16 bits
  SheetMachine machine;
  machine.tools[1].offset_mm = {0.3, -0.2};
  SheetSetup setup;
  setup.firmware = GetParam().firmware;
  const PlaneMm before = SeenOffset(setup, machine);
  EXPECT_NEAR(before.x_mm, 0.3, kReadingMm);
  EXPECT_NEAR(before.y_mm, -0.2, kReadingMm);
  setup.before = GetParam().line;
  const PlaneMm after = SeenOffset(setup, machine);
  EXPECT_NEAR(after.x_mm, 0, kReadingMm);
  EXPECT_NEAR(after.y_mm, 0, kReadingMm);
}

// The signs are those of the firmwares: Klipper adds its offset to the command, the others take
// theirs away.
INSTANTIATE_TEST_SUITE_P(
    Firmwares, RoundTrip,
    ::testing::Values(Applied{SheetFirmware::kKlipper,
                              "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=-0.3\n"
                              "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_y_offset VALUE=0.2\n"},
                      Applied{SheetFirmware::kMarlin, "M218 T1 X0.3 Y-0.2\nM500\n"},
                      Applied{SheetFirmware::kRepRapFirmware, "G10 P1 X0.3 Y-0.2\nM500 P10\n"}));

TEST(SheetWorld, PlayOnTheWayOfALineShowsOnThePage) {
  SheetMachine machine;
  machine.backlash_mm = {0.06, 0.04};
  // Every line but the first is reached in + x and + y by both tools: their difference is nil.
  const PlaneMm seen = SeenOffset({}, machine);
  EXPECT_NEAR(seen.y_mm, 0, 0.0002);
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

TEST(SheetWorld, DrawsWithinItsBounds) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    for (const SheetScene scene :
         {SheetScene::kBlackOnWhite, SheetScene::kWhiteOnBlack, SheetScene::kColoursOnWhite}) {
      const SheetName name{seed, 0, 0};
      const SheetMachine machine = MachineOf(name, scene);
      ASSERT_TRUE(Validate(machine)) << seed;
      ASSERT_TRUE(Validate(PaperOf(name, scene))) << seed;
      for (const SheetTool& tool : machine.tools) {
        ASSERT_LE(std::abs(tool.offset_mm.x_mm), 0.6) << seed;
        ASSERT_GT(std::abs(tool.ink[0] - PaperOf(name, scene).reflectance[0]) +
                      std::abs(tool.ink[2] - PaperOf(name, scene).reflectance[2]),
                  0.3)
            << seed;
      }
    }
  }
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
