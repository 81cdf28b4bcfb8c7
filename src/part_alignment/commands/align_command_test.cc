// trammel align solve and correct, from the shell.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "part_alignment/files/alignment_file.h"
#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/alignment_world_test_support.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

using nlohmann::json;
using test::CommandResult;
using test::WriteWhole;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr double kExact_mm = 1e-8;  // the numbers pass through text
constexpr double kExact_rad = 1e-11;

class AlignCommand : public testing::Test {
 protected:
  AlignCommand() {
    world_ = test_support::BenchWorld();
    Random random(1);
    test_support::TakePictures(world_, 0, random);
    constexpr double kSigma_px = 0.05;
    input_.measurement = part_alignment::MeasurementOf(world_, kSigma_px);
    Write("seen.json", files::AlignmentFileText(input_));
  }
  void Write(const std::string& name, const std::string& text) const {
    WriteWhole(folder_.path() / name, text);
  }
  [[nodiscard]] CommandResult Align(const std::string& arguments) const {
    return test::RunTrammel("align " + arguments, folder_.path());
  }
  // Solves observations that were changed.
  [[nodiscard]] CommandResult SolveChanged(const std::function<void(json&)>& change) const {
    json seen = json::parse(files::AlignmentFileText(input_));
    change(seen);
    Write("changed.json", seen.dump());
    return Align("solve changed.json");
  }

  test_support::AlignmentWorld world_;
  files::AlignmentInput input_;
  test::TemporaryFolder folder_;
};

TEST_F(AlignCommand, SolvePrintsWhereThePartIs) {
  const auto solved = Must(Align("solve seen.json"));
  const json result = json::parse(solved.standard_output);
  EXPECT_EQ(result["verdict"], "good");
  const geometry::Pose& truth = world_.machine_from_part;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR(result["part_mm"][k], truth.translation_mm(i), kExact_mm);
    EXPECT_NEAR(result["part_angles_rad"][k], truth.angles_rad(i), kExact_rad);
    EXPECT_NEAR(result["part_angles_mm_per_m"][k], 1e3 * truth.angles_rad(i), 1e3 * kExact_rad);
  }
  EXPECT_NEAR(result["clamp_angle_rad"], world_.clamping.angle_rad, kExact_rad);
  EXPECT_EQ(result["rank"], 7);
  EXPECT_EQ(result["covariance_order"].size(), 7U);
  EXPECT_EQ(result["covariance"].size(), 7U);
  EXPECT_EQ(result["covariance"][6].size(), 7U);
  EXPECT_EQ(result["residuals"].size(), 8U);
  EXPECT_TRUE(result["clamp_tilt_rad"].is_null());
  EXPECT_THAT(solved.standard_error, Containing("verdict    good", "gamma"));
}

TEST_F(AlignCommand, ATerminalGetsTheTextAndWhereTheJsonIsInPlaceOfTheJson) {
  const auto shown = [&](const std::string& arguments) {
    const std::string run = fmt::format(
        "cd '{}' && script -qec '{} align solve seen.json {}' /dev/null > shown 2>&1 < /dev/null",
        folder_.path().string(), TRAMMEL_PROGRAM, arguments);
    EXPECT_EQ(std::system(run.c_str()), 0);
    return test::ReadWhole(folder_.path() / "shown");
  };
  EXPECT_THAT(shown("--out kept.json"), Containing("verdict ", "gamma", "JSON       in kept.json",
                                                   Not(HasSubstr("\"verdict\""))));
  EXPECT_THAT(shown(""), HasSubstr("JSON       with --json"));
  EXPECT_THAT(shown("--json"), HasSubstr("\"verdict\": \"good\""));
}

TEST_F(AlignCommand, UnknownsOfTheCommandLineReplaceTheFiles) {
  const CommandResult six = Align("solve seen.json --unknowns pose");
  const json result = json::parse(six.standard_output);
  EXPECT_EQ(result["unknowns"], json::array({"pose"}));
  EXPECT_EQ(result["covariance_order"].size(), 6U);
  EXPECT_TRUE(result["clamp_angle_rad"].is_null());
  EXPECT_EQ(Align("solve seen.json --unknowns pose,zoom").exit_code, 1);
  EXPECT_EQ(Align("solve seen.json --unknowns clamp_angle").exit_code, 1);
}

TEST_F(AlignCommand, ASimulationStandsBesideWhatIsStated) {
  constexpr double kAgreement = 0.08;  // 4000 trials are good to 1.1 %
  const auto solved = Must(Align("solve seen.json --trials 4000 --seed 7"));
  const json result = json::parse(solved.standard_output);
  const json& simulated = result["simulated"];
  EXPECT_EQ(simulated["trials"], 4000);
  EXPECT_EQ(simulated["failed"], 0);
  for (const auto& [parameter, stated] : result["standard_uncertainty"].items()) {
    const double ratio = double(simulated["standard_uncertainty"][parameter]) / double(stated);
    EXPECT_NEAR(ratio, 1, kAgreement) << parameter;
    EXPECT_LT(simulated["error_low95"][parameter], simulated["error_high95"][parameter]);
  }
  EXPECT_NEAR(simulated["share_in_linear_region95"], 0.95, 0.02);
  EXPECT_THAT(solved.standard_error,
              AllOf(HasSubstr("4000 measurements"), Not(HasSubstr("not linear"))));
  EXPECT_TRUE(json::parse(Align("solve seen.json").standard_output)["simulated"].is_null());
  for (const std::string option : {"--trials 5", "--trials -1", "--trials many", "--seed -1",
                                   "--seed 1e3", "--seed 18446744073709551616"}) {
    EXPECT_THAT(Align("solve seen.json " + option), Fails(1, option.substr(0, option.find(' '))))
        << option;
  }
}

TEST_F(AlignCommand, UncertaintiesThatAreNotLinearAreSaidToBe) {
  for (const double tilt_rad : {0.01, 0.03}) {
    ASSERT_EQ(SolveChanged([&](json& seen) {
                seen["input_uncertainty"]["clamp_tilt_rad"] = tilt_rad;
              }).exit_code,
              0);
    const CommandResult simulated = Align("solve changed.json --trials 2000 --json");
    EXPECT_THAT(json::parse(simulated.standard_output)["notices"].dump(), HasSubstr("not linear"))
        << tilt_rad;
  }
}

TEST_F(AlignCommand, ASimulationThatCannotBeLeavesTheAnswer) {
  const auto slip = [](json& seen) { seen["input_uncertainty"]["clamp_eccentricity_mm"] = 1000; };
  EXPECT_THAT(SolveChanged(slip), Notes("leaves the part's place uncertain"));
  const auto simulated = Must(Align("solve changed.json --trials 100"));
  const json result = json::parse(simulated.standard_output);
  EXPECT_TRUE(result["simulated"].is_null());
  EXPECT_THAT(result["notices"].dump(), HasSubstr("no simulation: only"));
}

TEST_F(AlignCommand, WhatIsThereAlreadyIsOverwrittenByForceOnly) {
  const std::string plan =
      "plan seen.json --rough 812,430,-655 --travel -3000,-3000,-3000,3000,3000,3000 ";
  for (const std::string& command : {std::string("solve seen.json "), plan}) {
    EXPECT_THAT(Align(command + "--out seen.json"), Fails(1, "--force"));
    const std::string out = "--out of-" + command.substr(0, 4) + ".json";
    EXPECT_THAT(Align(command + out), Notes("\nnext       "));
    EXPECT_EQ(Align(command + out).exit_code, 1);
    EXPECT_EQ(Align(command + out + " --force").exit_code, 0);
  }
}

TEST_F(AlignCommand, WhatTheViewsCannotTellIsAVerdictAndNoNumbers) {
  const CommandResult one = SolveChanged(
      [](json& seen) { seen["views"].erase(seen["views"].begin() + 1, seen["views"].end()); });
  EXPECT_EQ(one.exit_code, 2) << one.output;
  const json result = json::parse(one.standard_output);
  EXPECT_EQ(result["verdict"], "cannot_tell");
  EXPECT_NE(result["reason"], "");
  EXPECT_TRUE(result["part_mm"].is_null());
  EXPECT_TRUE(result["covariance"].is_null());
  EXPECT_LT(result["rank"], 7);
}

TEST_F(AlignCommand, BadObservationsAreNamedAndExitWithOne) {
  const CommandResult unknown =
      SolveChanged([](json& seen) { seen["views"][0]["observations"][0]["target"] = "T9"; });
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_EQ(unknown.standard_output, "");
  EXPECT_THAT(unknown.standard_error, HasSubstr("views[0].observations[0].target is T9"));
  const CommandResult model =
      SolveChanged([](json& seen) { seen["camera"]["model"] = "opencv_fisheye"; });
  EXPECT_THAT(model.standard_error, HasSubstr("camera.model is \"opencv_fisheye\""));
  EXPECT_EQ(Align("solve nowhere.json").exit_code, 1);
}

TEST_F(AlignCommand, KeepsItsAnswerAsEveryInstrumentDoesAndCorrectsByIt) {
  ASSERT_THAT(Align("solve seen.json --out printed.json --result kept.json"),
              Notes("trammel align correct kept.json\n"));
  const json kept = json::parse(test::ReadWhole(folder_.path() / "kept.json"));
  const json printed = json::parse(test::ReadWhole(folder_.path() / "printed.json"));
  EXPECT_EQ(kept["instrument"], "part_alignment");
  EXPECT_EQ(kept["sources"], json({"seen.json"}));
  EXPECT_EQ(kept["details"], printed);
  ASSERT_EQ(kept["answers"].size(), 7u);  // the pose and the clamp angle
  const json& y = kept["answers"][1];
  EXPECT_EQ(y["name"], "part_y");
  EXPECT_EQ(y["unit"], "mm");
  EXPECT_EQ(y["value"], printed["part_mm"][1]);
  EXPECT_EQ(y["standard_uncertainty"], printed["standard_uncertainty"]["y_mm"]);
  EXPECT_EQ(kept["answers"][6]["name"], "clamp_angle");
  EXPECT_EQ(kept["answers"][6]["unit"], "rad");
  EXPECT_EQ(Align("correct kept.json --json").standard_output,
            Align("correct printed.json --json").standard_output);
  EXPECT_EQ(Align("solve seen.json --result kept.json").exit_code, 1);  // is there already
  EXPECT_EQ(Align("solve seen.json --result kept.json --force").exit_code, 0);
}

TEST_F(AlignCommand, CorrectsByNoKeptAnswerThatIsNotGoodOrNotItsOwn) {
  ASSERT_EQ(Align("solve seen.json --result kept.json").exit_code, 0);
  const json kept = json::parse(test::ReadWhole(folder_.path() / "kept.json"));
  const auto corrected = [&](const json& changed) {
    Write("changed.json", changed.dump());
    return Align("correct changed.json");
  };
  json bad = kept;
  bad["verdict"] = "cannot_tell";
  bad["answers"][2] = {{"name", "part_z"},
                       {"unit", "mm"},
                       {"verdict", "cannot_tell"},
                       {"reason", "one height only"}};
  CommandResult refused = corrected(bad);
  EXPECT_THAT(refused, Fails(2, "cannot_tell: one height only"));
  bad = kept;
  bad["answers"][0]["unit"] = "m";
  EXPECT_THAT(corrected(bad).standard_error, HasSubstr("holds no part_x in mm"));
  bad = kept;
  bad["answers"][3]["value"] = 7;
  bad["answers"][3]["standard_uncertainty"] = 1;
  bad["answers"][3]["interval95"] = {5, 9};
  EXPECT_THAT(corrected(bad).standard_error, HasSubstr("part_alpha is 7 rad"));
  bad = kept;
  bad["instrument"] = "tap";
  refused = corrected(bad);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.standard_error, HasSubstr("a result of taps, not of part alignment"));
}

TEST_F(AlignCommand, APlanThatDoesNotReachItsGoalWritesNothing) {
  const std::string plan =
      "plan seen.json --rough 812,430,-655 --travel -3000,-3000,-3000,3000,3000,3000 --out "
      "plan.json ";
  EXPECT_THAT(Align(plan + "--most-views 8 --goal 0.0001"),
              Fails(2, "do not reach the goal", "views tell 7 of 7 unknowns",
                    testing::Not(HasSubstr("not seen"))));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "plan.json"));
  EXPECT_THAT(Align(plan + "-q --most-views 8 --goal 0.0001").standard_error,
              MatchesRegex("trammel: no plan is written: .* do not reach the goal: .*\n"));
  EXPECT_EQ(Align(plan).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "plan.json"));
}

TEST_F(AlignCommand, CorrectRefusesWhatItCannotDo) {
  ASSERT_EQ(Align("solve seen.json --out result.json").exit_code, 0);
  EXPECT_EQ(Align("correct result.json --control fanuc --tilts").exit_code, 1);
  EXPECT_EQ(Align("correct result.json --work-offset G60").exit_code, 1);
  EXPECT_EQ(Align("correct result.json --after-shims").exit_code, 1);
  EXPECT_EQ(Align("correct result.json --control siemens --write localhost").exit_code, 1);
  EXPECT_THAT(Align("correct result.json --write 127.0.0.1:9"), Fails(1, "127.0.0.1:9", "session"));
  Write("supports.json", R"({"format": 1, "supports": [
    {"id": "a", "part_mm": [0, 0, 0], "direction": [0, 0, 0]}]})");
  EXPECT_THAT(Align("correct result.json --supports supports.json").standard_error,
              HasSubstr("supports[0].direction has no length"));
  Write("untold.json", R"({"format": 1, "verdict": "cannot_tell", "reason": "one view"})");
  EXPECT_THAT(Align("correct untold.json"), Fails(2, "cannot_tell: one view"));
}

}  // namespace
}  // namespace trammel
