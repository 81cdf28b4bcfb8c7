// trammel align targets as a user runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "support/run_trammel.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class AlignTargets : public testing::Test {
 protected:
  [[nodiscard]] CommandResult Run(const std::string& arguments) const {
    return RunTrammel("align targets " + arguments, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(AlignTargets, WritesPagesAndSaysWhatToCheckOnThem) {
  const CommandResult done = Run("--bits 14 --radius 5 --count 44 --out t.svg --layout t.json");
  EXPECT_EQ(done.exit_code, 0) << done.output;
  EXPECT_THAT(done.standard_output, AllOf(HasSubstr("44 coded with 14 bits"), HasSubstr("100 mm")));
  for (const char* name : {"t-1.svg", "t-2.svg", "t.json"}) {
    EXPECT_TRUE(fs::exists(folder_.path() / name)) << name;
  }
  const CommandResult again = Run("--count 44 --out t.svg");
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.standard_error, HasSubstr("t-1.svg"));
}

TEST_F(AlignTargets, NamesWhatIsWrongAndWritesNothing) {
  const auto error = [&](const std::string& arguments) {
    const CommandResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    return result.standard_error;
  };
  EXPECT_THAT(error("--bits 13"), HasSubstr("13 bits"));
  EXPECT_THAT(error("--radius nan"), HasSubstr("radius"));
  EXPECT_THAT(error("--count 45"), HasSubstr("1 ... 44"));
  EXPECT_THAT(error("--out same.pdf --layout ./same.pdf"), HasSubstr("same file"));
  EXPECT_THAT(error("--page a7"), HasSubstr("--page a7"));
  EXPECT_THAT(error("--page 100x"), HasSubstr("--page 100x"));
  EXPECT_THAT(error("--out targets.png"), HasSubstr(".pdf or .svg"));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace
}  // namespace trammel::test
