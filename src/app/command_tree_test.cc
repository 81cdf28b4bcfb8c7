#include "app/command_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>

#include "app/option_values.h"
#include "app/provenance.h"
#include "app/slow_work.h"

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

TEST(WholePair, ReadsTwoNumbersAndNothingElse) {
  ASSERT_TRUE(ParseWholePair("1280x720"));
  EXPECT_EQ(ParseWholePair("1280x720")->first, 1280);
  EXPECT_EQ(ParseWholePair("1280x720")->second, 720);
  for (const char* text : {"", "x", "9", "9x", "x3", "9x3x2", "9X3", "9.5x3", " 9x3", "9x3 ",
                           "99999999999x3", "axb"}) {
    EXPECT_FALSE(ParseWholePair(text)) << text;
  }
}

using ::testing::MatchesRegex;

TEST(Provenance, ARecordingIsNamedByInstrumentAndTime) {
  EXPECT_THAT(RecordingName(measurement::Instrument::kPartAlignment),
              MatchesRegex("part_alignment-[0-9]{8}T[0-9]{6}Z"));
}

using namespace std::chrono_literals;
using ::testing::internal::CaptureStderr;
using ::testing::internal::GetCapturedStderr;

TEST(SlowWork, SaysWhatTakesLongAndSaysItAgain) {
  CaptureStderr();
  {
    const SlowWork work("reading the photo", 1ms, 1ms);
    std::this_thread::sleep_for(500ms);
  }
  const std::string said = GetCapturedStderr();
  EXPECT_THAT(said, StartsWith("  reading the photo\n"));
  EXPECT_THAT(said, HasSubstr("  reading the photo, 0 s so far\n"));
}

}  // namespace
}  // namespace trammel::app
