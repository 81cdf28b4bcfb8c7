// trammel align solve and correct, from the shell.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "part_alignment/files/alignment_file.h"
#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/alignment_world_test_support.h"
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
  const CommandResult solved = Align("solve seen.json");
  ASSERT_EQ(solved.exit_code, 0) << solved.output;
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
  EXPECT_THAT(solved.standard_error, AllOf(HasSubstr("verdict    good"), HasSubstr("gamma")));
}

TEST_F(AlignCommand, JsonLeavesTheWordsOut) {
  const CommandResult solved = Align("solve seen.json --json");
  EXPECT_EQ(solved.standard_error, "");
  EXPECT_EQ(json::parse(solved.standard_output)["verdict"], "good");
}

TEST_F(AlignCommand, ATerminalGetsTheTextAndWhereTheJsonIsInPlaceOfTheJson) {
  const auto shown = [&](const std::string& arguments) {
    const std::string run = fmt::format(
        "cd '{}' && script -qec '{} align solve seen.json {}' /dev/null > shown 2>&1 < /dev/null",
        folder_.path().string(), TRAMMEL_PROGRAM, arguments);
    EXPECT_EQ(std::system(run.c_str()), 0);
    return test::ReadWhole(folder_.path() / "shown");
  };
  EXPECT_THAT(shown("--out kept.json"),
              AllOf(HasSubstr("verdict "), HasSubstr("gamma"), HasSubstr("JSON       in kept.json"),
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
  constexpr double kAgreement = 0.08;  // of 4000 trials to 1.1 %
  const CommandResult solved = Align("solve seen.json --trials 4000 --seed 7");
  ASSERT_EQ(solved.exit_code, 0) << solved.output;
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
    const CommandResult refused = Align("solve seen.json " + option);
    EXPECT_EQ(refused.exit_code, 1) << option;
    EXPECT_THAT(refused.standard_error, HasSubstr(option.substr(0, option.find(' '))));
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
  const CommandResult answered = SolveChanged(slip);
  EXPECT_EQ(answered.exit_code, 0);
  EXPECT_THAT(answered.standard_error, HasSubstr("leaves the part's place uncertain"));
  const CommandResult simulated = Align("solve changed.json --trials 100");
  EXPECT_EQ(simulated.exit_code, 0);
  const json result = json::parse(simulated.standard_output);
  EXPECT_TRUE(result["simulated"].is_null());
  EXPECT_THAT(result["notices"].dump(), HasSubstr("no simulation: only"));
}

TEST_F(AlignCommand, WhatIsThereAlreadyIsOverwrittenByForceOnly) {
  const std::string plan =
      "plan seen.json --rough 812,430,-655 --travel -3000,-3000,-3000,3000,3000,3000 ";
  for (const std::string& command : {std::string("solve seen.json "), plan}) {
    const CommandResult refused = Align(command + "--out seen.json");
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.standard_error, HasSubstr("--force"));
    const std::string out = "--out of-" + command.substr(0, 4) + ".json";
    const CommandResult done = Align(command + out);
    EXPECT_EQ(done.exit_code, 0);
    EXPECT_THAT(done.standard_error, HasSubstr("\nnext       "));
    EXPECT_EQ(Align(command + out).exit_code, 1);
    EXPECT_EQ(Align(command + out + " --force").exit_code, 0);
  }
}

TEST_F(AlignCommand, TargetsKeepTheKindOfTheirIds) {
  const CommandResult solved = SolveChanged([](json& seen) {
    for (json& target : seen["targets"]) {
      if (target["id"] == "T1") target["id"] = 1;
    }
    for (json& view : seen["views"]) {
      for (json& observation : view["observations"]) {
        if (observation["target"] == "T1") observation["target"] = 1;
      }
    }
  });
  const json result = json::parse(solved.standard_output);
  EXPECT_EQ(result["residuals"][0]["target"], 1);
  EXPECT_EQ(result["residuals"][2]["target"], "T2");
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

TEST_F(AlignCommand, TargetsKnownToFortyMicronsAreRefusedOnlyIfTheyAreSaidToBeExact) {
  constexpr double kScatter_mm = 0.04;
  const auto scatter = [](json& seen) {
    Random random(7);
    for (json& target : seen["targets"]) {
      for (json& mm : target["ideal_mm"]) mm = double(mm) + kScatter_mm * random.Normal();
    }
  };
  const auto stated = [&](double target_mm) {
    return SolveChanged([&](json& seen) {
      scatter(seen);
      seen["input_uncertainty"]["target_mm"] = target_mm;
    });
  };
  const CommandResult exact = stated(0);
  EXPECT_EQ(exact.exit_code, 2) << exact.output;
  EXPECT_THAT(exact.standard_error, HasSubstr("the residuals contradict their sigmas"));
  const CommandResult unsaid = SolveChanged(scatter);
  EXPECT_THAT(unsaid.standard_error, HasSubstr("targets' places 0.05"));
  for (const CommandResult& answered : {unsaid, stated(kScatter_mm)}) {
    ASSERT_EQ(answered.exit_code, 0) << answered.output;
    const json result = json::parse(answered.standard_output);
    for (const auto& [i, name] :
         {std::pair{0, "x_mm"}, std::pair{1, "y_mm"}, std::pair{2, "z_mm"}}) {
      const double sigma_mm = result["standard_uncertainty"][name];
      EXPECT_GT(sigma_mm, kScatter_mm / 10);
      EXPECT_NEAR(result["part_mm"][i], world_.machine_from_part.translation_mm[i], 4 * sigma_mm);
    }
  }
}

TEST_F(AlignCommand, ACameraFileFromOtherDistancesIsANotice) {
  json seen = json::parse(files::AlignmentFileText(input_));
  Write("camera.json", json{{"format", 1},
                            {"camera", seen["camera"]},
                            {"calibration", {{"date", "2026-11-01"}, {"distance_mm", {395, 1430}}}}}
                           .dump());
  seen["camera"] = "camera.json";
  Write("seen.json", seen.dump());
  const CommandResult solved = Align("solve seen.json");
  EXPECT_EQ(solved.exit_code, 0) << solved.output;
  EXPECT_THAT(solved.standard_error, HasSubstr("calibrated (2026-11-01) from 395 to 1430 mm"));
}

TEST_F(AlignCommand, CorrectWritesTheWordsOfEveryControl) {
  ASSERT_EQ(Align("solve seen.json --out result.json").exit_code, 0);
  for (const auto& [arguments, words] :
       {std::pair{"--control linuxcnc", "G10 L2 P1 X812.000000 Y430.000000 Z-655.000000 R0.630253"},
        std::pair{"--control siemens", "$P_UIFR[1]=CTRANS(X,812.000000"},
        std::pair{"--control siemens --tilts", "CROT(X,0.229183"},
        std::pair{"--control heidenhain --work-offset 4", "Q339=+4"},
        std::pair{"--control fanuc --work-offset \"G54.1 P9\"", "G90 G10 L20 P9 X812.000000"}}) {
    const CommandResult corrected = Align(std::string("correct result.json ") + arguments);
    EXPECT_EQ(corrected.exit_code, 0) << corrected.output;
    EXPECT_THAT(corrected.standard_output,
                AllOf(HasSubstr(words), HasSubstr("where the offset puts it less where it is:"),
                      HasSubstr("remainder  tilts of +4.0000 (about x) and "
                                "-3.0000 mm/m (about y)")));
  }
}

TEST_F(AlignCommand, KeepsItsAnswerAsEveryInstrumentDoesAndCorrectsByIt) {
  const CommandResult solved = Align("solve seen.json --out printed.json --result kept.json");
  ASSERT_EQ(solved.exit_code, 0);
  EXPECT_THAT(solved.standard_error, HasSubstr("trammel align correct kept.json\n"));
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
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.standard_error, HasSubstr("cannot_tell: one height only"));
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

TEST_F(AlignCommand, WhatNobodyStatedIsInOneFigureFromSolveToCorrect) {
  const CommandResult solved = Align("solve seen.json --out result.json");
  const json result = json::parse(solved.standard_output);
  EXPECT_EQ(result["input_uncertainty"]["clamp_eccentricity_mm"],
            part_alignment::kUsualEccentricity_mm);
  EXPECT_EQ(result["input_uncertainty"]["not_stated"],
            json({"machine_mm", "target_mm", "clamp_eccentricity_mm", "camera_offset_mm"}));
  const double sigma_mm = result["standard_uncertainty"]["x_mm"];
  EXPECT_GT(sigma_mm, part_alignment::kUsualEccentricity_mm);
  EXPECT_EQ(result["notices"], json::array());
  EXPECT_THAT(solved.standard_error, HasSubstr("not stated machine's repeatability"));
  EXPECT_EQ(json::parse(Align("correct result.json --json").standard_output)["notices"],
            result["notices"]);
  const CommandResult stated = SolveChanged([](json& seen) {
    seen["input_uncertainty"] = {
        {"machine_mm", 0}, {"target_mm", 0}, {"clamp_eccentricity_mm", 0}, {"camera_offset_mm", 0}};
  });
  const double exact_mm = json::parse(stated.standard_output)["standard_uncertainty"]["x_mm"];
  EXPECT_LT(exact_mm, sigma_mm / 4);
}

TEST_F(AlignCommand, APlanThatDoesNotReachItsGoalWritesNothing) {
  const std::string plan =
      "plan seen.json --rough 812,430,-655 --travel -3000,-3000,-3000,3000,3000,3000 --out "
      "plan.json ";
  const CommandResult short_of = Align(plan + "--most-views 8 --goal 0.0001");
  EXPECT_EQ(short_of.exit_code, 2) << short_of.output;
  EXPECT_THAT(short_of.standard_error,
              AllOf(HasSubstr("do not reach the goal"), HasSubstr("views tell 7 of 7 unknowns"),
                    testing::Not(HasSubstr("not seen"))));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "plan.json"));
  EXPECT_THAT(Align(plan + "-q --most-views 8 --goal 0.0001").standard_error,
              MatchesRegex("trammel: no plan is written: .* do not reach the goal: .*\n"));
  EXPECT_EQ(Align(plan).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "plan.json"));
}

TEST_F(AlignCommand, CorrectLevelsThePartAtItsSupports) {
  ASSERT_EQ(Align("solve seen.json --out result.json").exit_code, 0);
  Write("supports.json", R"({"format": 1, "supports": [
    {"id": "a", "part_mm": [-700, -450, 0], "direction": [0, 0, 2]},
    {"id": "b", "part_mm": [700, -450, 0], "direction": [0, 0, 1]},
    {"id": "c", "part_mm": [0, 450, 0], "direction": [0, 0, 1]}]})");
  const CommandResult corrected =
      Align("correct result.json --supports supports.json --after-shims --json");
  ASSERT_EQ(corrected.exit_code, 0) << corrected.output;
  const json result = json::parse(corrected.standard_output);
  EXPECT_LT(result["remainder"]["largest_mm"], 1e-6);
  // b lies 1400 mm from a along x; beta = -3 mm/m lifts it by 4.2 mm.
  const double a_mm = result["fixture"]["supports"][0]["shim_mm"];
  const double b_mm = result["fixture"]["supports"][1]["shim_mm"];
  EXPECT_NEAR(b_mm - a_mm, -4.2, 0.01);
}

TEST_F(AlignCommand, CorrectRefusesWhatItCannotDo) {
  ASSERT_EQ(Align("solve seen.json --out result.json").exit_code, 0);
  EXPECT_EQ(Align("correct result.json --control fanuc --tilts").exit_code, 1);
  EXPECT_EQ(Align("correct result.json --work-offset G60").exit_code, 1);
  EXPECT_EQ(Align("correct result.json --after-shims").exit_code, 1);
  EXPECT_EQ(Align("correct result.json --control siemens --write localhost").exit_code, 1);
  const CommandResult elsewhere = Align("correct result.json --write 127.0.0.1:9");
  EXPECT_EQ(elsewhere.exit_code, 1);
  EXPECT_THAT(elsewhere.standard_error, AllOf(HasSubstr("127.0.0.1:9"), HasSubstr("session")));
  Write("supports.json", R"({"format": 1, "supports": [
    {"id": "a", "part_mm": [0, 0, 0], "direction": [0, 0, 0]}]})");
  EXPECT_THAT(Align("correct result.json --supports supports.json").standard_error,
              HasSubstr("supports[0].direction has no length"));
  Write("untold.json", R"({"format": 1, "verdict": "cannot_tell", "reason": "one view"})");
  const CommandResult untold = Align("correct untold.json");
  EXPECT_EQ(untold.exit_code, 2);
  EXPECT_THAT(untold.standard_error, HasSubstr("cannot_tell: one view"));
}

}  // namespace
}  // namespace trammel
