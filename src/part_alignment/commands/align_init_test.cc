// trammel align init, from nothing to the work offset, on the virtual spindle and a scripted
// LinuxCNC.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/scripted_linuxcnc.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::CommandResult;
using test::ReadWhole;
using test::ScriptedLinuxCnc;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kTravel = "0,0,0,3000,2000,1500";

class AlignInit : public testing::Test {
 protected:
  // The camera and the targets that the virtual spindle states.
  void SetUp() override {
    ASSERT_THAT(test::RunTrammel("sim spindle --out shop --seed 11 --no-pictures", folder_.path()),
                Ends(0));
    const json stated = json::parse(ReadWhole(At("shop/observations.json")));
    test::WriteWhole(At("camera.json"), json{{"format", 1}, {"camera", stated["camera"]}}.dump());
    WriteTargets(stated["targets"]);
  }
  void WriteTargets(const json& targets) const {
    test::WriteWhole(At("targets.json"), json{{"format", 1}, {"targets", targets}}.dump());
  }
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] CommandResult Run(const std::string& arguments) const {
    return test::RunTrammel(arguments, folder_.path());
  }
  // Everything answered; what comes last is what counts.
  [[nodiscard]] static std::string Answers(const std::string& machine) {
    return fmt::format(
        "align init job --machine {} --camera camera.json --targets targets.json --source pictures "
        "--rough 1400,1000,250 --travel {} --safe-z 1400 --obstacle 500,400,-100,2300,1600,240",
        machine, kTravel);
  }
  [[nodiscard]] CommandResult Init(const std::string& machine, const std::string& more = "") const {
    return Run(Answers(machine) + " " + more);
  }
  void ExpectNothingWritten() const {
    EXPECT_FALSE(fs::exists(At("job/setup.json")));
    EXPECT_FALSE(fs::exists(At("job/views.json")));
    if (!fs::exists(At("job"))) return;
    EXPECT_TRUE(fs::is_empty(At("job")));
  }

  test::TemporaryFolder folder_;
};

std::vector<std::string> CommandsOf(const std::string& said) {
  std::vector<std::string> commands;
  constexpr std::string_view kProgram = "trammel ";
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kProgram)) commands.push_back(line.substr(kProgram.size()));
  }
  return commands;
}

TEST_F(AlignInit, LeadsFromNothingToTheOffsetByTheFiveCommandsThatItPrints) {
  ScriptedLinuxCnc server;
  server.SetHurry(50);
  const std::string address = "session:" + server.helper();
  const auto begun = Must(Init(address, "--spindle locked"));
  EXPECT_THAT(server.requests(),
              Each(AllOf(Not(HasSubstr("\"mdi\"")), Not(HasSubstr("\"take\"")))));
  const auto commands = CommandsOf(begun.standard_output);
  ASSERT_EQ(commands.size(), 5U) << begun.standard_output;
  // The shop takes its pictures where the plan says.
  ASSERT_THAT(Run("sim spindle --out taken --seed 11 --plain-surface --views job/views.json"),
              Ends(0));
  fs::create_directory(At("pictures"));
  for (const fs::directory_entry& entry : fs::directory_iterator(At("taken"))) {
    if (entry.path().extension() == ".png") fs::copy(entry.path(), At("pictures"));
  }
  for (const std::string& command : commands) {
    EXPECT_THAT(Run(command), Ends(0)) << command;
  }
  const json truth = json::parse(ReadWhole(At("taken/truth.json")));
  // The clamping is 5 um beside the axis, which no residual shows.
  constexpr double kClamping_mm = 0.03;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(server.parameter(5221 + i), truth["part_mm"][static_cast<std::size_t>(i)],
                kClamping_mm)
        << i;
  }
}

TEST_F(AlignInit, WritesNothingOverWhatIsThere) {
  ASSERT_EQ(Init("none").exit_code, 0);
  const std::string before = ReadWhole(At("job/setup.json")) + ReadWhole(At("job/views.json"));
  EXPECT_THAT(Init("none"), Fails(1, "setup.json", "another folder"));
  EXPECT_EQ(ReadWhole(At("job/setup.json")) + ReadWhole(At("job/views.json")), before);
}

TEST_F(AlignInit, RefusesAnswersThatAreNone) {
  for (const auto& [option, words] :
       std::vector<std::pair<std::string, std::string>>{{"--rough 1,2", "3 numbers"},
                                                        {"--rough 1,2,nan", "3 numbers"},
                                                        {"--travel 1", "6 numbers"},
                                                        {"--camera nowhere.json", "is no file"},
                                                        {"--spindle glued", "c-axis or locked"},
                                                        {"--machine a:b:c", "LinuxCNC is"},
                                                        {"--distance 3", "20 … 10000"},
                                                        {"--work-offset G60", "G60"},
                                                        {"--obstacle 1,2,3", "least X,Y,Z"}}) {
    std::string answers = Answers("none");
    const std::string name = option.substr(0, option.find(' ') + 1);
    const std::size_t at = answers.find(name);
    if (at != std::string::npos) answers.erase(at, answers.find(" --", at) - at);
    EXPECT_THAT(Run(answers + " " + option), Fails(1, words)) << option;
    ExpectNothingWritten();
  }
}

TEST_F(AlignInit, SaysThatNoViewFitsAndWhatToChange) {
  std::string answers = Answers("none");
  const std::string travel = kTravel;
  answers.replace(answers.find(travel), travel.size(), "0,0,0,900,2000,1500");
  EXPECT_THAT(Run(answers), Fails(2, "cannot be seen from within the travel", "move the part"));
  ExpectNothingWritten();
}

TEST_F(AlignInit, WritesNothingForAMachineInInches) {
  ScriptedLinuxCnc server;
  server.Answer("metric", false);
  EXPECT_THAT(Init("session:" + server.helper()), Fails(4, "contradiction: ", "LINEAR_UNITS = mm"));
  ExpectNothingWritten();
}

TEST_F(AlignInit, QuotesWhatAShellWouldTakeApart) {
  fs::copy(At("camera.json"), At("my camera's.json"));
  const CommandResult run =
      Run("align init 'a job' --machine none --camera \"my camera's.json\" --targets targets.json "
          "--source 'the pictures' --rough 1400,1000,250 --safe-z 1400 --obstacle none --travel " +
          std::string(kTravel));
  ASSERT_THAT(run, Prints(0, "'a job/views.json'", "'the pictures'"));
  const auto commands = CommandsOf(run.standard_output);
  ASSERT_EQ(commands.size(), 5U);
  EXPECT_THAT(Run(commands[0]), Ends(0));
}

}  // namespace
}  // namespace trammel
