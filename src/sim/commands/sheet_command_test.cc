// trammel-sim sheet, from the shell to the scan and its truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "support/run_trammel.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using test::CommandResult;
using test::ReadWhole;
using test::RunTrammel;
using test::TemporaryFolder;
using test::WriteWhole;
using ::testing::HasSubstr;

// Two lines by each of two tools.
constexpr const char* kGcode =
    "; for marlin\nG90\nM83\nT0\nG0 X10 Y10\nG1 Y16 E0.2\nG0 X14 Y10\nG1 Y16 E0.2\n"
    "T1\nG0 X12 Y10\nG1 Y16 E0.2\nG0 X16 Y10\nG1 Y16 E0.2\n";

class SimSheetCommand : public testing::Test {
 protected:
  SimSheetCommand() { WriteWhole(At("sheet.gcode"), kGcode); }

  [[nodiscard]] CommandResult Run(const std::string& arguments) const {
    return RunTrammel("sim sheet sheet.gcode " + arguments, folder_.path());
  }
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] nlohmann::json Truth(const std::string& name) const {
    return nlohmann::json::parse(ReadWhole(At(name)));
  }
  void ExpectRefused(const std::string& arguments, const std::string& why) const {
    const CommandResult run = Run("--out never.png " + arguments);
    EXPECT_EQ(run.exit_code, 1) << arguments;
    EXPECT_THAT(run.output, HasSubstr(why));
    EXPECT_FALSE(fs::exists(At("never.png"))) << arguments;
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(SimSheetCommand, WritesTheScanAndItsTruth) {
  const CommandResult run =
      Run("--out a.png --truth a.json --seed 7 --offset 1:0.2,-0.1 --set backlash-x-um=40");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(ReadWhole(At("a.png")), HasSubstr("PNG"));
  const nlohmann::json truth = Truth("a.json");
  EXPECT_DOUBLE_EQ(truth["tools"][0]["dx_mm"], 0.2);
  EXPECT_DOUBLE_EQ(truth["tools"][0]["dy_mm"], -0.1);
  EXPECT_DOUBLE_EQ(truth["backlash_mm"]["x"], 0.04);
  ASSERT_EQ(Run("--out b.png --seed 7 --offset 1:0.2,-0.1 --set backlash-x-um=40").exit_code, 0);
  EXPECT_EQ(ReadWhole(At("a.png")), ReadWhole(At("b.png")));
}

TEST_F(SimSheetCommand, RefusesArgumentsByName) {
  ExpectRefused("--offset 1:0.2", "--offset 1:0.2");
  ExpectRefused("--stored 9:0,0", "--stored 9:0,0");
  ExpectRefused("--offset 1:nan,0", "--offset 1:nan,0");
  ExpectRefused("--scene pink", "pink");
  ExpectRefused("--firmware grbl", "grbl");
  ExpectRefused("--dpi 5", "--dpi");
  ExpectRefused("--set gamma", "NAME=NUMBER");
  ExpectRefused("--set colour=1", "no such name");
  ExpectRefused("--set shadow=7", "shadow = 7");
  ExpectRefused("--says-dpi many", "--says-dpi many");
  ExpectRefused("--macros nowhere.cfg", "nowhere.cfg");
  ExpectRefused("--missing 0 --missing 1 --set dirt=0", "no tool printed");
  EXPECT_EQ(Run("--out a.bmp").exit_code, 1);
}

TEST_F(SimSheetCommand, OverwritesNothing) {
  ASSERT_EQ(Run("--out a.png").exit_code, 0);
  const CommandResult again = Run("--out a.png");
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.output, HasSubstr("is there already"));
}

}  // namespace
}  // namespace trammel
