#include "app/plain_help.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "app/guide.h"

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
    CLI::App* send = program_.add_subcommand("send", "sends");
    send->add_option("--plan", path_, "of the pattern")->required();
    print_->add_flag("--undo", undo_, "takes it back")->excludes(print_->get_option("path"));
    print_->add_option("--form", path_, "of progress")
        ->check(CLI::IsMember(std::vector<std::string>{"text", "json"}));
  }
  std::string Of(std::vector<std::string> words) {
    const std::vector<std::string> given = words;
    std::reverse(words.begin(), words.end());
    try {
      program_.parse(words);
    } catch (const CLI::ParseError& error) {
      return PlainError(program_, error, given);
    }
    return "";
  }

  CLI::App program_;
  CLI::App* print_ = nullptr;
  std::string path_;
  int count_ = 0;
  int turns_ = 0;
  double speed_ = 0;
  bool undo_ = false;
};

TEST_F(PlainHelpTest, ErrorsNameTheCommandTheThingAndTheRemedy) {
  EXPECT_THAT(Of({"print"}), AllOf(HasSubstr("trammel print needs PATH: recording's folder"),
                                   HasSubstr("trammel print --help")));
  EXPECT_THAT(Of({"send"}), HasSubstr("trammel send needs --plan: of the pattern"));
  EXPECT_THAT(Of({"print", "x", "--count"}), HasSubstr("--count needs a value"));
  EXPECT_THAT(Of({"print", "x", "--count", "12"}), HasSubstr("--count 12: it must be 2 … 9"));
  EXPECT_THAT(Of({"print", "x", "--speed", "fast"}),
              HasSubstr("--speed fast: it must be a number"));
  EXPECT_THAT(Of({"print", "x", "--speed", "5", "--count", "2"}),
              HasSubstr("cannot be given together"));
  EXPECT_THAT(Of({"print", "x", "--flow", "5"}), HasSubstr("--flow is of use with --speed alone"));
  EXPECT_THAT(Of({"print", "x", "y"}), HasSubstr("trammel print has no use for: y"));
}

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

}  // namespace
}  // namespace trammel::app
