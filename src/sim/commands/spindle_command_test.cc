// trammel-sim spindle, from the shell to the folder it leaves.
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
using ::testing::HasSubstr;

class SimSpindleCommand : public testing::Test {
 protected:
  [[nodiscard]] CommandResult Run(const std::string& arguments) const {
    return RunTrammel("sim spindle " + arguments, folder_.path());
  }
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] nlohmann::json Read(const std::string& name) const {
    return nlohmann::json::parse(ReadWhole(At(name)));
  }
  void ExpectRefused(const std::string& arguments, const std::string& why) const {
    const CommandResult run = Run("--out never " + arguments);
    EXPECT_EQ(run.exit_code, 1) << arguments;
    EXPECT_THAT(run.output, HasSubstr(why));
    EXPECT_FALSE(fs::exists(At("never"))) << arguments;
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(SimSpindleCommand, WritesObservationsThatMissTheTruthByTheirNoise) {
  const CommandResult run = Run("--out a --no-pictures --seed 7 --clamp-angle 0.002");
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
  ASSERT_EQ(Run("--out b --no-pictures --seed 7 --clamp-angle 0.002").exit_code, 0);
  EXPECT_EQ(ReadWhole(At("a/observations.json")), ReadWhole(At("b/observations.json")));
}

TEST_F(SimSpindleCommand, GoesWhereAPlanSendsIt) {
  ASSERT_EQ(Run("--out a --no-pictures --seed 7").exit_code, 0);
  nlohmann::json plan = Read("a/observations.json");
  plan["views"].erase(plan["views"].begin() + 4, plan["views"].end());
  const nlohmann::json places = plan["views"];
  test::WriteWhole(At("plan.json"), plan.dump());
  const CommandResult run = Run("--out b --no-pictures --seed 7 --half-turn --views plan.json");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json views = Read("b/observations.json")["views"];
  ASSERT_EQ(views.size(), 2 * places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(views[i]["spindle_mm"], places[i]["spindle_mm"]);
  }
  // Turned as it stands, it is the same plan.
  plan["views"] = views;
  test::WriteWhole(At("turned.json"), plan.dump());
  ASSERT_EQ(Run("--out c --no-pictures --seed 7 --views turned.json").exit_code, 0);
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
  ExpectRefused("--views tilted.json", "views[0].spindle_rotation");
  plan["views"] = nlohmann::json::array();
  test::WriteWhole(At("empty.json"), plan.dump());
  ExpectRefused("--views empty.json", "views");
  ExpectRefused("--views nowhere.json", "nowhere.json");
}

TEST_F(SimSpindleCommand, RefusesArgumentsByName) {
  ExpectRefused("--scene kitchen", "--scene kitchen");
  ExpectRefused("--distance 1e9", "--distance");
  ExpectRefused("--camera phone", "--camera phone");
  ExpectRefused("--light laser", "--light laser");
  ExpectRefused("--bits 13", "--bits");
  ExpectRefused("--hide 5:0,90", "--hide 5:0,90");
  ExpectRefused("--hide 1:0,400", "an extent of at most 179");
  ExpectRefused("--set blur-px", "NAME=NUMBER");
  ExpectRefused("--set colour=3", "no such name");
  ExpectRefused("--set blur-px=1000", "blur-px = 1000");
  ExpectRefused("--set tilt-rad=nan", "--set tilt-rad=nan");
  fs::create_directory(At("here"));
  EXPECT_THAT(Run("--out here").output, HasSubstr("exists already"));
}

}  // namespace
}  // namespace trammel
