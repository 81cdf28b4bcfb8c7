#include "app/usage_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

namespace trammel::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

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
  /// Without the line on --help; empty: nothing is wrong.
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

  CLI::App program_;
  std::string path_;
  std::string config_;
};

TEST_F(UsageErrorTest, NamesAnUnknownCommandAndTheOneThatWasMeant) {
  EXPECT_EQ(Of({"docter"}), "trammel has no command 'docter'; did you mean doctor?");
  EXPECT_EQ(Of({"pa", "analyse", "--config", "x"}),
            "trammel pa has no command 'analyse'; did you mean analyze?");
}

TEST_F(UsageErrorTest, ListsTheCommandsWhereNoneIsNear) {
  EXPECT_THAT(Of({"pa", "frobnicate"}),
              AllOf(HasSubstr("'frobnicate'"), HasSubstr("analyze, apply")));
  EXPECT_EQ(Of({"pa"}), "trammel pa needs a command: analyze, apply");
  EXPECT_THAT(Of({}), HasSubstr("trammel needs a command: pa, doctor"));
}

TEST_F(UsageErrorTest, NamesAnUnknownOptionAndTheOneThatWasMeant) {
  EXPECT_EQ(Of({"pa", "analyze", "scan", "--confg=x"}),
            "trammel pa analyze has no option '--confg'; did you mean --config?");
  EXPECT_THAT(Of({"--config", "x", "pa", "analyze"}),
              HasSubstr("trammel has no option '--config'"));
}

TEST_F(UsageErrorTest, KnowsTheProgramsOptionsBelowEveryCommand) {
  program_.add_option("--color", config_);
  EXPECT_THAT(Of({"--color", "never", "pa", "analize"}), HasSubstr("'analize'"));
  EXPECT_EQ(Of({"pa", "analyze", "scan", "--color", "never"}), "");
  EXPECT_THAT(Of({"pa", "analyze", "--colour"}), HasSubstr("'--colour'"));
}

TEST_F(UsageErrorTest, NamesWhatIsMissingWithWhatItIs) {
  EXPECT_EQ(Of({"pa", "analyze"}), "trammel pa analyze needs PATH: recording's folder");
  EXPECT_EQ(Of({"pa", "analyze", "x", "--config"}), "--config needs a value: settings");
  EXPECT_EQ(Of({"pa", "analyze", "scan", "--config", "x", "-o"}), "");
}

TEST_F(UsageErrorTest, NoWordSpeaksToTheTerminal) {
  const std::string said = Of({"\x1b[2Jdoctor\n" + std::string(1000, 'x')});
  EXPECT_THAT(said, AllOf(Not(HasSubstr("\x1b")), HasSubstr("doctor x")));
  EXPECT_LT(said.size(), 200U);
}

}  // namespace
}  // namespace trammel::app
