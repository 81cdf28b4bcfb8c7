#include "app/command_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

namespace trammel::app {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class CommandTree : public ::testing::Test {
 protected:
  void SetUp() override {
    program_.name("gauge");
    program_.set_version_flag("--version", "gauge 1.2.3");
    CLI::App* pa = program_.add_subcommand("pa", "pressure advance");
    CLI::App* analyze = pa->add_subcommand("analyze", "reads a scan");
    analyze->add_option("path", path_, "a folder")->required();
    analyze->add_option("--method", path_, "response or .deviation\nof 2")->capture_default_str();
    analyze->add_flag("--json", json_, "one object");
  }

  CLI::App program_{"gauge: trues machines"};
  std::string path_;
  bool json_ = false;
};

TEST_F(CommandTree, TheCompletionKnowsEveryCommandAndOption) {
  const std::string script = BashCompletion(program_);
  EXPECT_THAT(script, HasSubstr("'gauge') commands='pa' options='--help -h --version'"));
  EXPECT_THAT(script, HasSubstr("'gauge pa') commands='analyze' "));
  EXPECT_THAT(script, HasSubstr("'gauge pa analyze') commands='' "));
  EXPECT_THAT(script, AllOf(HasSubstr("--method"), HasSubstr("--json")));
  EXPECT_THAT(script, EndsWith("complete -o default -F _gauge_words gauge\n"));
  EXPECT_THAT(ZshCompletion(program_), AllOf(StartsWith("#compdef gauge\n"), HasSubstr(script)));
}

TEST_F(CommandTree, WhatEveryCommandTakesIsCompletedEverywhereAndDescribedOnce) {
  CLI::App program{"gauge: trues machines"};
  program.name("gauge");
  program.add_flag("-q,--quiet", json_, "errors alone");
  program.add_subcommand("pa", "pressure advance")->add_flag("--json", json_, "one object");
  EXPECT_THAT(BashCompletion(program),
              AllOf(HasSubstr("'gauge') commands='pa' options='--help -h --quiet -q' "),
                    HasSubstr("'gauge pa') commands='' options='--help -h --json --quiet -q' ")));
  const std::string page = ManualPage(program);
  EXPECT_THAT(page, HasSubstr(".SH OPTIONS OF EVERY COMMAND\n.TP\n\\fB\\-q,\\-\\-quiet\\fR"));
  EXPECT_EQ(page.find("errors alone"), page.rfind("errors alone"));
}

TEST_F(CommandTree, TheManualHasEveryCommandWithItsOptionsAndNoRequestFromOutside) {
  const std::string page = ManualPage(program_);
  EXPECT_THAT(page, StartsWith(".TH gauge 1 \"\" \"gauge 1.2.3\"\n"));
  EXPECT_THAT(page, HasSubstr("gauge \\- trues machines\n"));
  EXPECT_THAT(page, Not(HasSubstr("help")));
  EXPECT_THAT(page, HasSubstr(".SS \\fBgauge pa analyze\\fR [\\fIOPTIONS\\fR] \\fIpath\\fR\n"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-json\\fR\none object\n"));
  EXPECT_THAT(page, HasSubstr("response or .deviation\nof 2"));
  EXPECT_THAT(page, Not(HasSubstr("\n.deviation")));
  EXPECT_THAT(page, HasSubstr(".SH EXIT STATUS\n"));
}

}  // namespace
}  // namespace trammel::app
