// The files of examples/alignment with the commands that its README gives for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using ::testing::HasSubstr;

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

/// The commands of a page's indented blocks as test::RunTrammel takes them, without remarks.
std::vector<std::string> CommandsOf(const fs::path& page) {
  std::vector<std::string> commands;
  std::istringstream lines(test::ReadWhole(page));
  constexpr std::string_view kPrompt = "    trammel ";
  constexpr std::string_view kSimPrompt = "    trammel-sim ";
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kSimPrompt)) line.replace(0, kSimPrompt.size(), "    trammel sim ");
    if (!line.starts_with(kPrompt)) continue;
    commands.push_back(line.substr(kPrompt.size(), line.find("  #") - kPrompt.size()));
  }
  return commands;
}

// Those that need no machine; `part_alignment-…Z` is the folder that a measurement left.
void RunInOrder(const fs::path& page, const fs::path& folder, int least = 5) {
  int count = 0;
  for (std::string command : CommandsOf(page)) {
    const bool ours = command.starts_with("align ") || command.starts_with("sim spindle ");
    const bool machine = command.find("127.0.0.1") != std::string::npos ||
                         command.find("--write session") != std::string::npos ||
                         command.find("--machine session") != std::string::npos;
    if (!ours || machine) continue;
    constexpr std::string_view kDated = "part_alignment-…Z";
    if (const std::size_t at = command.find(kDated); at != std::string::npos) {
      for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename();
        if (name.starts_with("part_alignment-")) command.replace(at, kDated.size(), name);
      }
    }
    EXPECT_THAT(test::RunTrammel(command, folder), Ends(0)) << command;
    ++count;
  }
  EXPECT_GE(count, least) << page << " has lost its commands";
}

TEST_F(AlignExamples, TheReadmesCommandsRunInTheirOrder) {
  fs::create_directories(folder_.path() / "examples");
  fs::copy(TRAMMEL_EXAMPLES, folder_.path() / "examples/alignment");
  RunInOrder(fs::path(TRAMMEL_SOURCE) / "README.md", folder_.path());
}

TEST_F(AlignExamples, TheManualsCommandsRunInTheirOrder) {
  RunInOrder(fs::path(TRAMMEL_SOURCE) / "docs/howto/part-alignment.md", folder_.path(), 14);
}

// The manual shows the printed text.
TEST_F(AlignExamples, InitPrintsTheCommandsOfTheManual) {
  ASSERT_EQ(Align("calibrate grid.json --out camera.json").exit_code, 0);
  ASSERT_EQ(Align("fit points.csv --part part.json --out targets.json").exit_code, 0);
  const auto commands = CommandsOf(fs::path(TRAMMEL_SOURCE) / "docs/howto/part-alignment.md");
  const auto init = std::find_if(commands.begin(), commands.end(), [](const std::string& command) {
    return command.starts_with("align init ");
  });
  constexpr std::ptrdiff_t kAll = 7;  // including the shop's last one
  ASSERT_GE(commands.end() - init, kAll);
  const auto begun = Must(test::RunTrammel(*init, folder_.path()));
  for (auto command = init + 2; command < init + kAll; ++command) {
    EXPECT_THAT(begun.standard_output, HasSubstr("trammel " + *command + "\n"));
  }
}

TEST_F(AlignExamples, TheSurveysCommandsRunInTheirOrder) {
  RunInOrder(fs::path(TRAMMEL_SOURCE) / "docs/howto/part-alignment-survey.md", folder_.path(), 4);
}

TEST_F(AlignExamples, EveryCommandOfTheirPageRunsInItsOrder) {
  const std::vector<std::string> commands = CommandsOf(folder_.path() / "README.md");
  ASSERT_GE(commands.size(), 5U);
  for (const std::string& command : commands) {
    EXPECT_THAT(test::RunTrammel(command, folder_.path()), Ends(0)) << command;
  }
  for (const char* left : {"calibration/residuals.png", "fit/stock-allowance.png",
                           "alignment/report.html", "alignment/view-08_residuals.png"}) {
    EXPECT_TRUE(Exists(left)) << left;
  }
}

// All of the casting against the STL alone: it lies in more ways than one, whatever its unit.
TEST_F(AlignExamples, AnStlAloneIsAPartWhoseUnitIsAsked) {
  EXPECT_THAT(Align("fit points.csv --part part.stl"), Says(1, "--overstock MM"));
  EXPECT_THAT(Align("fit points.csv --part part.stl --overstock 4"),
              Says(2, "fit alike", "180.0°", "an STL states no unit"));
  const auto inch = Align("fit points.csv --part part.stl --overstock 4 --unit inch");
  EXPECT_EQ(inch.exit_code, 2);
  EXPECT_THAT(inch.output, HasSubstr("times too large, near 25.4, an inch in mm"));
  EXPECT_EQ(Align("fit points.csv --part part.json --overstock 4").exit_code, 1);
}

// Runs the chain from casting to offset: each step's uncertainty enters the next one's figures.
TEST_F(AlignExamples, TheChainEndsWhereThePartIsWithinWhatItStates) {
  ASSERT_EQ(Align("calibrate grid.json --out camera.json").exit_code, 0);
  ASSERT_EQ(Align("fit points.csv --part part.json --out targets.json").exit_code, 0);
  ASSERT_THAT(Align("solve observations.json --result result.json"), Ends(0));
  ASSERT_THAT(test::RunTrammel("sim spindle --out shop --seed 11 --no-pictures", folder_.path()),
              Ends(0));
  const json truth = Read("shop/truth.json");
  const json result = Read("result.json")["details"];
  constexpr double kFactor = 2;  // one drawn part: each of six figures within k = 2
  const json& sigma = result["standard_uncertainty"];
  for (const auto& [i, name] : {std::pair{0, "x_mm"}, std::pair{1, "y_mm"}, std::pair{2, "z_mm"}}) {
    EXPECT_NEAR(result["part_mm"][i], truth["part_mm"][i], kFactor * double(sigma[name])) << name;
  }
  for (const auto& [i, name] :
       {std::pair{0, "alpha_rad"}, std::pair{1, "beta_rad"}, std::pair{2, "gamma_rad"}}) {
    EXPECT_NEAR(result["part_angles_rad"][i], truth["part_angles_rad"][i],
                kFactor * double(sigma[name]))
        << name;
  }
  EXPECT_THAT(Align("correct result.json --supports supports.json --control linuxcnc").output,
              Containing("shim", "G10 L2 P1"));
}

}  // namespace
}  // namespace trammel
