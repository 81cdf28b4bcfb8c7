#include "app/mistyped.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace trammel::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Optional;

class MistypedTest : public testing::Test {
 protected:
  MistypedTest() {
    CLI::App* pa = program_.add_subcommand("pa", "pressure advance");
    CLI::App* analyze = pa->add_subcommand("analyze", "a recording");
    analyze->add_option("path");
    analyze->add_option("--config");
    analyze->add_flag("-o,--out");
    pa->add_subcommand("apply", "a value");
    program_.add_subcommand("doctor", "looks whether all is well");
  }
  [[nodiscard]] std::optional<std::string> Of(const std::vector<std::string>& words) const {
    return Mistyped(program_, words);
  }

  CLI::App program_;
};

TEST_F(MistypedTest, NamesAnUnknownCommandAndTheOneThatWasMeant) {
  EXPECT_THAT(Of({"docter"}),
              Optional(std::string("trammel has no command 'docter'; did you mean doctor?")));
  EXPECT_THAT(Of({"pa", "analyse", "--config", "x"}),
              Optional(std::string("trammel pa has no command 'analyse'; did you mean analyze?")));
}

TEST_F(MistypedTest, ListsTheCommandsWhereNoneIsNear) {
  EXPECT_THAT(Of({"pa", "frobnicate"}),
              Optional(AllOf(HasSubstr("'frobnicate'"), HasSubstr("analyze, apply"))));
  EXPECT_THAT(Of({"pa"}), Optional(std::string("trammel pa needs a command: analyze, apply")));
  EXPECT_THAT(Of({}), Optional(HasSubstr("trammel needs a command: pa, doctor")));
}

TEST_F(MistypedTest, NamesAnUnknownOptionAndTheOneThatWasMeant) {
  EXPECT_THAT(
      Of({"pa", "analyze", "scan", "--confg=x"}),
      Optional(std::string("trammel pa analyze has no option '--confg'; did you mean --config?")));
  EXPECT_THAT(Of({"--config", "x", "pa", "analyze"}),
              Optional(HasSubstr("trammel has no option '--config'")));
}

TEST_F(MistypedTest, KnowsTheProgramsOptionsBelowEveryCommand) {
  program_.add_option("--color");
  EXPECT_THAT(Of({"--color", "never", "pa", "analize"}), Optional(HasSubstr("'analize'")));
  EXPECT_EQ(Of({"pa", "analyze", "--color", "never"}), std::nullopt);
  EXPECT_THAT(Of({"pa", "analyze", "--colour"}), Optional(HasSubstr("'--colour'")));
}

TEST_F(MistypedTest, IsSilentWhereEveryWordIsKnown) {
  EXPECT_EQ(Of({"pa", "analyze", "scan", "--config", "x", "-o", "--help"}), std::nullopt);
  EXPECT_EQ(Of({"pa", "analyze", "--", "--confg"}), std::nullopt);
  EXPECT_EQ(Of({"doctor"}), std::nullopt);
}

TEST_F(MistypedTest, NoWordSpeaksToTheTerminal) {
  const auto said = Of({"\x1b[2Jdoctor\n" + std::string(1000, 'x')});
  EXPECT_THAT(said,
              Optional(AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\n")), HasSubstr("doctor x"))));
  EXPECT_LT(said.value_or("").size(), 200U);
}

}  // namespace
}  // namespace trammel::app
