// trammel-sim sheet and spindle, from the shell to what they leave.
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

class SimCommand : public testing::Test {
 protected:
  SimCommand() { WriteWhole(At("sheet.gcode"), kGcode); }

  [[nodiscard]] CommandResult Run(const std::string& arguments) const {
    return RunTrammel("sim " + arguments, folder_.path());
  }
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] nlohmann::json Read(const std::string& name) const {
    return nlohmann::json::parse(ReadWhole(At(name)));
  }
  void ExpectRefused(const std::string& arguments, const std::string& why) const {
    const CommandResult run = Run(arguments + " --out never.png");
    EXPECT_EQ(run.exit_code, 1) << arguments;
    EXPECT_THAT(run.output, HasSubstr(why));
    EXPECT_FALSE(fs::exists(At("never.png"))) << arguments;
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(SimCommand, SheetWritesTheScanAndItsTruth) {
  const CommandResult run =
      Run("sheet sheet.gcode --out a.png --truth a.json --seed 7 --offset 1:0.2,-0.1 --set "
          "backlash-x-um=40");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(ReadWhole(At("a.png")), HasSubstr("PNG"));
  const nlohmann::json truth = Read("a.json");
  EXPECT_DOUBLE_EQ(truth["tools"][0]["dx_mm"], 0.2);
  EXPECT_DOUBLE_EQ(truth["tools"][0]["dy_mm"], -0.1);
  EXPECT_DOUBLE_EQ(truth["backlash_mm"]["x"], 0.04);
  ASSERT_EQ(Run("sheet sheet.gcode --out b.png --seed 7 --offset 1:0.2,-0.1 --set backlash-x-um=40")
                .exit_code,
            0);
  EXPECT_EQ(ReadWhole(At("a.png")), ReadWhole(At("b.png")));
}

TEST_F(SimCommand, SpindleWritesObservationsThatMissTheTruthByTheirNoise) {
  const CommandResult run = Run("spindle --out a --no-pictures --seed 7 --clamp-angle 0.002");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json seen = Read("a/observations.json");
  const nlohmann::json truth = Read("a/truth.json");
  EXPECT_EQ(seen["format"], 1);
  EXPECT_EQ(seen["camera"]["model"], "brown_measured_to_ideal");
  EXPECT_EQ(seen["camera"]["looks_along"], "+z");
  EXPECT_EQ(seen["unknowns"], nlohmann::json({"pose", "clamp_angle"}));
  EXPECT_EQ(seen["targets"].size(), 4U);
  ASSERT_EQ(seen["views"].size(), 8U);
  EXPECT_DOUBLE_EQ(truth["clamp_angle_rad"], 0.002);
  for (std::size_t i = 0; i < 8; ++i) {
    const nlohmann::json& noisy = seen["views"][i]["observations"].at(0);
    const nlohmann::json& exact = truth["views"][i]["targets"].at(0);
    EXPECT_EQ(noisy["target"], exact["target"]);
    EXPECT_EQ(noisy["target"], 1 + i / 2);
    // Five sigma.
    EXPECT_NEAR(noisy["column_px"], double(exact["column_px"]), 0.15);
    EXPECT_NEAR(noisy["row_px"], double(exact["row_px"]), 0.15);
  }
  EXPECT_FALSE(fs::exists(At("a/views.json")));
  ASSERT_EQ(Run("spindle --out b --no-pictures --seed 7 --clamp-angle 0.002").exit_code, 0);
  EXPECT_EQ(ReadWhole(At("a/observations.json")), ReadWhole(At("b/observations.json")));
}

TEST_F(SimCommand, SpindleGoesWhereAPlanSendsIt) {
  ASSERT_EQ(Run("spindle --out a --no-pictures --seed 7").exit_code, 0);
  nlohmann::json plan = Read("a/observations.json");
  plan["views"].erase(plan["views"].begin() + 4, plan["views"].end());
  const nlohmann::json places = plan["views"];
  test::WriteWhole(At("plan.json"), plan.dump());
  const CommandResult run =
      Run("spindle --out b --no-pictures --seed 7 --half-turn --views plan.json");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json views = Read("b/observations.json")["views"];
  ASSERT_EQ(views.size(), 2 * places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(views[i]["spindle_mm"], places[i]["spindle_mm"]);
  }
  // Turned as it stands, it is the same plan.
  plan["views"] = views;
  test::WriteWhole(At("turned.json"), plan.dump());
  ASSERT_EQ(Run("spindle --out c --no-pictures --seed 7 --views turned.json").exit_code, 0);
  const nlohmann::json again = Read("c/observations.json")["views"];
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        EXPECT_NEAR(again[i]["spindle_rotation"][row][column],
                    double(views[i]["spindle_rotation"][row][column]), 1e-12);
      }
    }
  }
  plan["views"][0]["spindle_rotation"] = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}};
  test::WriteWhole(At("tilted.json"), plan.dump());
  ExpectRefused("spindle --views tilted.json", "views[0].spindle_rotation");
  plan["views"] = nlohmann::json::array();
  test::WriteWhole(At("empty.json"), plan.dump());
  ExpectRefused("spindle --views empty.json", "views");
  ExpectRefused("spindle --views nowhere.json", "nowhere.json");
}

TEST_F(SimCommand, RefusesArgumentsByName) {
  const std::string sheet = "sheet sheet.gcode ";
  const std::string spindle = "spindle ";
  for (const auto& [arguments, why] : {
           std::pair{sheet + "--offset 1:0.2", "--offset 1:0.2"},
           {sheet + "--stored 9:0,0", "--stored 9:0,0"},
           {sheet + "--offset 1:nan,0", "--offset 1:nan,0"},
           {sheet + "--scene pink", "pink"},
           {sheet + "--firmware grbl", "grbl"},
           {sheet + "--dpi 5", "--dpi"},
           {sheet + "--set gamma", "NAME=NUMBER"},
           {sheet + "--set colour=1", "no such name"},
           {sheet + "--set shadow=7", "shadow = 7"},
           {sheet + "--says-dpi many", "--says-dpi many"},
           {sheet + "--macros nowhere.cfg", "nowhere.cfg"},
           {sheet + "--missing 0 --missing 1 --set dirt=0", "no tool printed"},
           {spindle + "--scene kitchen", "--scene kitchen"},
           {spindle + "--distance 1e9", "--distance"},
           {spindle + "--camera phone", "--camera phone"},
           {spindle + "--light laser", "--light laser"},
           {spindle + "--bits 13", "--bits"},
           {spindle + "--hide 5:0,90", "--hide 5:0,90"},
           {spindle + "--hide 1:0,400", "an extent of at most 179"},
           {spindle + "--set blur-px", "NAME=NUMBER"},
           {spindle + "--set colour=3", "no such name"},
           {spindle + "--set blur-px=1000", "blur-px = 1000"},
           {spindle + "--set tilt-rad=nan", "--set tilt-rad=nan"},
       }) {
    ExpectRefused(arguments, why);
  }
  EXPECT_EQ(Run(sheet + "--out a.bmp").exit_code, 1);
}

TEST_F(SimCommand, OverwritesNothing) {
  fs::create_directory(At("here"));
  EXPECT_THAT(Run("spindle --out here").output, HasSubstr("exists already"));
  WriteWhole(At("a.png"), "mine");
  const CommandResult again = Run("sheet sheet.gcode --out a.png");
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.output, HasSubstr("is there already"));
  EXPECT_EQ(ReadWhole(At("a.png")), "mine");
}

}  // namespace
}  // namespace trammel
