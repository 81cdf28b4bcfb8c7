// trammel align targets as a user runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class AlignTargets : public testing::Test {
 protected:
  [[nodiscard]] CommandResult Run(const std::string& arguments) const {
    return RunTrammel("align targets " + arguments, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(AlignTargets, WritesPagesAndSaysWhatToCheckOnThem) {
  EXPECT_THAT(Run("--bits 14 --radius 5 --count 44 --out t.svg --layout t.json"),
              Prints(0, "44 coded with 14 bits", "100 mm"));
  for (const char* name : {"t-1.svg", "t-2.svg", "t.json"}) {
    EXPECT_TRUE(fs::exists(folder_.path() / name)) << name;
  }
  EXPECT_THAT(Run("--count 44 --out t.svg"), Fails(1, "t-1.svg"));
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
