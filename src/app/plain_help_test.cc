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

}  // namespace
}  // namespace trammel::app
