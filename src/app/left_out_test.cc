#include "app/left_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "app/command_tree.h"
#include "app/commands.h"

namespace trammel::app {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class LeftOutTest : public ::testing::Test {
 protected:
  LeftOutTest() {
    program_.require_subcommand(1);
    program_.fallthrough();
    program_.add_subcommand("pa", "pressure advance");
    AddLeftOutCommand(program_, exit_code_, "tap");
  }

  CLI::App program_{"", "trammel"};
  int exit_code_ = kExitGood;
};

TEST_F(LeftOutTest, SaysHowToBuildWhatIsNotThereWhateverFollows) {
  for (const char* line : {"tap", "tap analyze taps.jsonl --json", "tap --help"}) {
    exit_code_ = kExitGood;
    testing::internal::CaptureStderr();
    program_.parse(line);
    EXPECT_THAT(
        testing::internal::GetCapturedStderr(),
        AllOf(HasSubstr("trammel tap is not part of this build"), HasSubstr("docs/install.md")));
    EXPECT_EQ(exit_code_, kExitUsage) << line;
  }
}

TEST_F(LeftOutTest, IsNoneOfTheCommandsThatAreThere) {
  EXPECT_THAT(NamesOfCommands(program_), ElementsAre("pa"));
  EXPECT_THAT(program_.help(), Not(HasSubstr("tap")));
}

}  // namespace
}  // namespace trammel::app
