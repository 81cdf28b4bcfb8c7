#include "app/help_commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "app/command_tree.h"
#include "app/commands.h"

namespace trammel::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class PlainHelpTest : public testing::Test {
 protected:
  PlainHelpTest() {
    program_.formatter(PlainHelp());
    print_ = program_.add_subcommand("print", "prints");
    print_->add_option("path", path_, "recording's folder")->required();
    auto* count = print_->add_option("--count", count_, "patterns")->check(CLI::Range(2, 9));
    auto* speed = print_->add_option("--speed", speed_, "mm/s")->excludes(count);
    print_->add_option("--flow", speed_, "mm^3/s")->needs(speed);
    print_->add_option("--turns", turns_, "of the coil")->check(CLI::Range(1, 3));
    print_->add_flag("--undo", undo_, "takes it back")->excludes(print_->get_option("path"));
    print_->add_option("--form", path_, "of progress")
        ->check(CLI::IsMember(std::vector<std::string>{"text", "json"}));
  }
  CLI::App program_;
  CLI::App* print_ = nullptr;
  std::string path_;
  int count_ = 0;
  int turns_ = 0;
  double speed_ = 0;
  bool undo_ = false;
};

TEST_F(PlainHelpTest, HelpHasNoWordsOfTheParser) {
  const std::string help = print_->help();
  EXPECT_THAT(help, AllOf(HasSubstr("--count 2 … 9"), HasSubstr("(not with --count)"),
                          HasSubstr("(with --speed)"), HasSubstr("text|json")));
  EXPECT_THAT(help, HasSubstr("--undo (not with PATH)"));
  EXPECT_THAT(help, HasSubstr("  --turns 1 … 3               of the coil\n"));
  EXPECT_THAT(help, AllOf(Not(HasSubstr("INT")), Not(HasSubstr("FLOAT")),
                          Not(HasSubstr("Excludes")), Not(HasSubstr("Needs:"))));
}

TEST(GuideTest, ShowsTheWaysThatThisBuildHas) {
  const std::string all = Guide([](std::string_view) { return true; });
  EXPECT_THAT(all, AllOf(HasSubstr("trammel pa print --photo"), HasSubstr("trammel align init")));
  const std::string few = Guide([](std::string_view name) { return name == "pa"; });
  EXPECT_THAT(few, AllOf(HasSubstr("trammel pa print --photo"), Not(HasSubstr("trammel align"))));
}

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
    EXPECT_THAT(testing::internal::GetCapturedStderr(),
                AllOf(HasSubstr("trammel tap is not part of this build"),
                      HasSubstr("docs/howto/install.md")));
    EXPECT_EQ(exit_code_, kExitUsage) << line;
  }
}

class UsageErrorTest : public testing::Test {
 protected:
  UsageErrorTest() {
    program_.fallthrough();
    program_.require_subcommand(1);
    CLI::App* pa = program_.add_subcommand("pa", "pressure advance");
    pa->require_subcommand(1);
    CLI::App* analyze = pa->add_subcommand("analyze", "a recording");
    analyze->add_option("path", path_, "recording's folder")->required();
    analyze->add_option("--config", config_, "settings");
    analyze->add_flag("-o,--out");
    pa->add_subcommand("apply", "a value");
    program_.add_subcommand("doctor", "looks whether all is well");
  }
  /// Returns the error without the line on --help; empty: no error.
  [[nodiscard]] std::string Of(std::vector<std::string> words) {
    const std::vector<std::string> given = words;
    std::ranges::reverse(words);
    try {
      program_.parse(words);
    } catch (const CLI::ParseError& error) {
      const std::string text = UsageError(program_, error, given);
      return text.substr(0, text.find('\n'));
    }
    return "";
  }

  CLI::App program_{"", "trammel"};
  std::string path_;
  std::string config_;
};

TEST_F(UsageErrorTest, NamesAnUnknownCommandAndTheOneThatWasMeant) {
  EXPECT_EQ(Of({"docter"}), "trammel has no command 'docter'; did you mean doctor?");
  EXPECT_EQ(Of({"pa", "analyse", "--config", "x"}),
            "trammel pa has no command 'analyse'; did you mean analyze?");
}

TEST_F(UsageErrorTest, NamesAnUnknownOptionAndTheOneThatWasMeant) {
  EXPECT_EQ(Of({"pa", "analyze", "scan", "--confg=x"}),
            "trammel pa analyze has no option '--confg'; did you mean --config?");
  EXPECT_THAT(Of({"--config", "x", "pa", "analyze"}),
              HasSubstr("trammel has no option '--config'"));
}

TEST_F(UsageErrorTest, NoWordSpeaksToTheTerminal) {
  const std::string said = Of({"\x1b[2Jdoctor\n" + std::string(1000, 'x')});
  EXPECT_THAT(said, AllOf(Not(HasSubstr("\x1b")), HasSubstr("doctor x")));
  EXPECT_LT(said.size(), 200U);
}

}  // namespace
}  // namespace trammel::app
