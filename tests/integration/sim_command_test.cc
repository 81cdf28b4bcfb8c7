// trammel-sim, from the shell to the recording.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "support/matchers.h"
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

constexpr const char* kScan =
    "sim scan pattern.gcode --plan pattern.plan.json --frame 64x64 --seed 7 --out scan";

// A folder with the default pattern in it.
class SimCommand : public testing::Test {
 protected:
  SimCommand() { EXPECT_THAT(RunTrammel("pa pattern --material abs", folder_.path()), Ends(0)); }
  [[nodiscard]] CommandResult Run(const std::string& arguments) const {
    return RunTrammel(arguments, folder_.path());
  }
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }

 private:
  TemporaryFolder folder_;
};

TEST_F(SimCommand, ScansThePatternThatTrammelWroteAndKeepsTheTruth) {
  ASSERT_THAT(Run(kScan), Ends(0));
  const auto scan = nlohmann::json::parse(ReadWhole(At("scan/scan.json")));
  EXPECT_EQ(scan["lines"].size(), 10U);
  EXPECT_TRUE(fs::is_regular_file(At("scan/line9.avi")));
  const auto truth = nlohmann::json::parse(ReadWhole(At("scan/truth.json")));
  EXPECT_EQ(truth["seed"], 7);
  EXPECT_EQ(truth["condition"], "matte-black-dark");
}

TEST_F(SimCommand, SeedHasOneTruthForPrinterScanAndPhotoWhateverThePatternTests) {
  constexpr double kRounding_s = 1e-5;  // sim photo prints five decimals
  ASSERT_EQ(Run("sim printer --port 0 --for 0 --seed 3 --truth printer.json").exit_code, 0);
  const auto truth_in = [&](const char* file) {
    return nlohmann::json::parse(ReadWhole(At(file)))["pressure_advance_s"].get<double>();
  };
  const double truth_s = truth_in("printer.json");
  ASSERT_THAT(
      Run("sim scan pattern.gcode --plan pattern.plan.json --frame 64x64 --seed 3 --out of-three"),
      Ends(0));
  EXPECT_NEAR(truth_in("of-three/truth.json"), truth_s, kRounding_s);
  // Up to 0.1 s, where the pattern for a scan ends at 0.06 s.
  ASSERT_EQ(Run("pa pattern --photo --material pla -o for-photo.gcode").exit_code, 0);
  for (const std::string pattern : {"pattern", "for-photo"}) {
    const auto photo =
        Must(Run("sim photo " + pattern + ".gcode --seed 3 --size 90x160 -o " + pattern + ".jpg"));
    const std::string label = "the truth is ";
    const std::size_t at = photo.standard_output.find(label);
    ASSERT_NE(at, std::string::npos) << photo.output;
    EXPECT_NEAR(std::stod(photo.standard_output.substr(at + label.size())), truth_s, kRounding_s)
        << pattern;
  }
}

TEST_F(SimCommand, NothingIsOverwritten) {
  fs::create_directory(At("scan"));
  WriteWhole(At("photo.jpg"), "mine");
  const CommandResult scan = Run(kScan);
  EXPECT_EQ(scan.exit_code, 1);
  EXPECT_THAT(scan.output, HasSubstr("scan exists already"));
  const CommandResult photo = Run("sim photo pattern.gcode --out photo.jpg");
  EXPECT_EQ(photo.exit_code, 1);
  EXPECT_THAT(photo.output, HasSubstr("photo.jpg exists already"));
  EXPECT_EQ(ReadWhole(At("photo.jpg")), "mine");
}

TEST_F(SimCommand, TakesAPhotoOfTheWholePattern) {
  ASSERT_THAT(Run("sim photo pattern.gcode --seed 3 --pressure-advance 0.03 --size 270x480 --out "
                  "photo.jpg"),
              Says(0, "the truth is 0.03"));
  EXPECT_EQ(ReadWhole(At("photo.jpg")).substr(0, 2), "\xff\xd8");
}

TEST_F(SimCommand, RefusesWhatItDoesNotKnowByName) {
  const struct {
    const char* arguments;
    const char* message;
  } cases[] = {
      {"--plan pattern.plan.json --condition matte-pink-dark --out a", "\"matte-pink-dark\""},
      {"--plan pattern.plan.json --frame 2000x100 --out a", "--frame 2000x100"},
      {"--plan pattern.plan.json --frame big --out a", "--frame big"},
      {"--plan pattern.plan.json --pattern 4 --frame 64x64 --out a", "no line of pattern 4"},
      {"--plan pattern.plan.json --pressure-advance -1 --out a", "-1"},
      {"--plan pattern.plan.json --seed -1 --out a", "--seed"},
      {"--plan pattern.gcode --out a", "not JSON"},
      {"--plan missing.plan.json --out a", "missing.plan.json: there is no such file"},
      {"--plan pattern.plan.json --frame 64x64 --out pattern.gcode/a", "pattern.gcode/a"},
      {"--out a", "--plan"},
  };
  for (const auto& wrong : cases) {
    EXPECT_THAT(Run(std::string("sim scan pattern.gcode ") + wrong.arguments),
                Says(1, wrong.message))
        << wrong.arguments;
    EXPECT_FALSE(fs::exists(At("a"))) << wrong.arguments;
  }
  EXPECT_THAT(Run("sim photo pattern.gcode --scene pink --out a.jpg"), Says(1, "natural-on-gold"));
  EXPECT_THAT(Run("sim photo pattern.gcode --size 20000x20000 --out a.jpg"),
              Says(1, "20000 x 20000"));
}

}  // namespace
}  // namespace trammel
