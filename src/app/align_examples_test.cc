// The files of examples/alignment with the commands that its README gives for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "support/run_trammel.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class AlignExamples : public testing::Test {
 protected:
  AlignExamples() {
    for (const fs::directory_entry& file : fs::directory_iterator(TRAMMEL_EXAMPLES)) {
      fs::copy(file.path(), folder_.path());
    }
  }
  [[nodiscard]] test::CommandResult Align(const std::string& arguments) const {
    return test::RunTrammel("align " + arguments, folder_.path());
  }
  [[nodiscard]] json Read(const std::string& name) const {
    return json::parse(test::ReadWhole(folder_.path() / name));
  }
  [[nodiscard]] bool Exists(const std::string& name) const {
    return fs::exists(folder_.path() / name);
  }

  test::TemporaryFolder folder_;
};

TEST_F(AlignExamples, TheGridGivesTheCameraThatItWasDrawnWith) {
  const auto run = Align("calibrate grid.json --out camera.json --report calibration --json");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const json drawn = Read("observations.json")["camera"];
  const json found = json::parse(run.standard_output)["parameters"]["focal_length_mm"];
  constexpr double kFiveSigmas = 5;
  EXPECT_NEAR(found["value"], drawn["focal_length_mm"],
              kFiveSigmas * double(found["standard_uncertainty"]));
  EXPECT_EQ(Read("camera.json")["camera"]["focal_length_mm"], found["value"]);
  EXPECT_TRUE(Exists("calibration/residuals.png"));
}

TEST_F(AlignExamples, ThePointsGiveTheTargetsOfTheObservations) {
  const auto run = Align("fit points.csv --part part.json --out targets.json --report fit");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(run.output, HasSubstr("rests on"));
  constexpr double kFarthest_mm = 0.2;  // five of the targets' stated 0.03 … 0.06 mm
  const json fitted = Read("targets.json")["targets"];
  for (const json& target : Read("observations.json")["targets"]) {
    const auto found = std::find_if(fitted.begin(), fitted.end(),
                                    [&](const json& one) { return one["id"] == target["id"]; });
    ASSERT_NE(found, fitted.end()) << target["id"];
    for (const std::size_t axis : {0U, 1U, 2U}) {
      EXPECT_NEAR((*found)["ideal_mm"][axis], target["ideal_mm"][axis], kFarthest_mm);
    }
  }
  EXPECT_TRUE(Exists("fit/overstock.png"));
}

TEST_F(AlignExamples, TheObservationsGiveAPartThatCanBeCorrected) {
  const auto solved = Align("solve observations.json --out result.json --report alignment");
  ASSERT_EQ(solved.exit_code, 0) << solved.output;
  EXPECT_TRUE(Exists("alignment/view-08_residuals.png"));
  const auto corrected = Align("correct result.json --supports supports.json --control linuxcnc");
  EXPECT_EQ(corrected.exit_code, 0) << corrected.output;
  EXPECT_THAT(corrected.output, AllOf(HasSubstr("shim"), HasSubstr("G10 L2 P1")));
}

TEST_F(AlignExamples, TheSceneIsCapable) {
  const auto run = Align("budget scene.json");
  EXPECT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(run.output, AllOf(HasSubstr("lengths   largest error"), HasSubstr("capable   yes")));
}

}  // namespace
}  // namespace trammel
