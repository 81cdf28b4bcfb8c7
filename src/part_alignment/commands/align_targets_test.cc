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

TEST_F(AlignTargets, WritesSquareMarkersThatGoTogetherOrThoseAskedFor) {
  const CommandResult some = Run("--kind aruco --count 3 --side 30 --out m.svg --layout m.json");
  EXPECT_EQ(some.exit_code, 0) << some.output;
  EXPECT_THAT(some.standard_output,
              HasSubstr("3 of the original ArUco dictionary on 1 page: 5,6,7"));
  EXPECT_THAT(ReadWhole(folder_.path() / "m.json"), HasSubstr("\"side_mm\": 30"));
  const CommandResult stated = Run("--kind aruco --marker-ids 1,2,0 --out n.pdf");
  EXPECT_EQ(stated.exit_code, 0) << stated.output;
  EXPECT_THAT(stated.standard_output, HasSubstr(": 1,2,0"));
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
  EXPECT_THAT(error("--kind aruco --marker-ids 1,256"), HasSubstr("markers 1 and 256"));
  EXPECT_THAT(error("--kind aruco --count 395"), HasSubstr("1 ... 394"));
  EXPECT_THAT(error("--marker-ids 5"), HasSubstr("add --kind aruco"));
  EXPECT_THAT(error("--out same.pdf --layout ./same.pdf"), HasSubstr("same file"));
  EXPECT_THAT(error("--side 30"), HasSubstr("add --kind aruco"));
  EXPECT_THAT(error("--kind aruco --plain 4"), HasSubstr("--plain is of ring-coded targets"));
  EXPECT_THAT(error("--kind aruco --marker-ids 5 --count 2"), HasSubstr("--count beside"));
  EXPECT_THAT(error("--page a7"), HasSubstr("--page a7"));
  EXPECT_THAT(error("--page 100x"), HasSubstr("--page 100x"));
  EXPECT_THAT(error("--out targets.png"), HasSubstr(".pdf or .svg"));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace
}  // namespace trammel::test
