// trammel sim spindle, from the shell to the folder it leaves.
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

TEST_F(SimSpindleCommand, TakesAPictureOfEveryView) {
  const CommandResult run = Run("--out a --plain-surface --hide 2:0,90 --light retro");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const nlohmann::json views = Read("a/views.json")["views"];
  ASSERT_EQ(views.size(), 8U);
  for (const nlohmann::json& view : views) {
    EXPECT_THAT(ReadWhole(At("a/" + std::string(view["picture"]))), HasSubstr("PNG"));
  }
}

TEST_F(SimSpindleCommand, TurnsTheSpindleAndItsSceneWhenAsked) {
  ASSERT_EQ(Run("--out a --no-pictures --half-turn").exit_code, 0);
  EXPECT_EQ(Read("a/observations.json")["views"].size(), 16U);
  ASSERT_EQ(Run("--out b --no-pictures --scene industry --distance 150 --camera table1").exit_code,
            0);
  const nlohmann::json seen = Read("b/observations.json");
  EXPECT_EQ(seen["camera"]["looks_along"], "-z");
  // The spindle's z is the machine's -y.
  EXPECT_NEAR(seen["views"][0]["spindle_rotation"][1][2], -1, 1e-12);
}

TEST_F(SimSpindleCommand, RefusesArgumentsByName) {
  ExpectRefused("--scene kitchen", "--scene kitchen");
  ExpectRefused("--distance 1e9", "--distance");
  ExpectRefused("--camera phone", "--camera phone");
  ExpectRefused("--light laser", "--light laser");
  ExpectRefused("--bits 13", "--bits");
  ExpectRefused("--hide 5:0,90", "--hide 5:0,90");
  ExpectRefused("--hide 1:0,400", "an extent of at most 360");
  ExpectRefused("--set blur-px", "NAME=NUMBER");
  ExpectRefused("--set colour=3", "no such name");
  ExpectRefused("--set blur-px=1000", "blur_px is 1000");
  ExpectRefused("--set tilt-rad=nan", "--set tilt-rad=nan");
  fs::create_directory(At("here"));
  EXPECT_THAT(Run("--out here").output, HasSubstr("exists already"));
}

}  // namespace
}  // namespace trammel
