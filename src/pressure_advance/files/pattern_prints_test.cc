#include "pressure_advance/files/pattern_prints.h"

#include <gtest/gtest.h>

#include <string>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

class PatternPrintsTest : public ::testing::Test {
 protected:
  std::optional<PatternPrint> Last(const std::string& printer,
                                   PrintsFor which = PrintsFor::kPhoto) {
    const auto last = LastPatternPrint(path_, printer, which);
    EXPECT_TRUE(last) << last.error().message;
    return last.value_or(std::nullopt);
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / kPatternPrintsFile;
};

TEST_F(PatternPrintsTest, APrintersLastOneIsTheLastThatWasNotedWhateverItsClockSaid) {
  EXPECT_FALSE(Last("voron"));
  for (const PatternPrint& print :
       {PatternPrint{"2026-01-03T00:00:00Z", "voron", "/a", "", true, 5.5},
        {"2026-01-04T00:00:00Z", "ender", "/b", "", true, 7.0},
        {"2026-01-02T00:00:00Z", "voron", "/c", "PLA \"+\"", false, 6.25}}) {
    ASSERT_TRUE(NotePatternPrint(path_, print));
  }
  const auto voron = Last("voron");
  ASSERT_TRUE(voron);
  EXPECT_EQ(voron->utc, "2026-01-02T00:00:00Z");
  EXPECT_EQ(voron->folder, "/c");
  EXPECT_EQ(voron->filament, "PLA \"+\"");
  EXPECT_FALSE(voron->ended);
  EXPECT_EQ(voron->server_s, 6.25);
  EXPECT_TRUE(Last("ender")->ended);
  EXPECT_FALSE(Last("other"));
}

TEST_F(PatternPrintsTest, APhotoIsOfNoPrintForAScan) {
  ASSERT_TRUE(NotePatternPrint(path_, {"2026-01-02T00:00:00Z", "voron", "/photo", "", true, 5.5}));
  PatternPrint scanned{"2026-01-03T00:00:00Z", "voron", "/scan"};
  scanned.for_photo = false;
  ASSERT_TRUE(NotePatternPrint(path_, scanned));
  EXPECT_EQ(Last("voron")->folder, "/photo");
  EXPECT_EQ(Last("voron", PrintsFor::kEither)->folder, "/scan");
  // A line of before that there were others says nothing of it.
  test::WriteWhole(path_,
                   "{\"utc\": \"x\", \"printer\": \"voron\", \"folder\": \"/old\", "
                   "\"step\": \"ended\"}\n");
  EXPECT_EQ(Last("voron")->folder, "/old");
}

TEST_F(PatternPrintsTest, LinesThatAreNonePassAndATimeThatIsNoneIsNotTold) {
  ASSERT_TRUE(NotePatternPrint(path_, {"2026-01-02T00:00:00Z", "voron", "/a", "", true, {}}));
  test::WriteWhole(path_,
                   test::ReadWhole(path_) +
                       "{\n[]\n{\"utc\": \"x\", \"printer\": \"voron\", \"step\": \"soon\"}\n"
                       "{\"utc\": 5, \"printer\": \"voron\", \"step\": \"ended\"}\n" +
                       std::string(2 << 20, 'x') + "\n");
  const auto last = Last("voron");
  ASSERT_TRUE(last);
  EXPECT_EQ(last->utc, "2026-01-02T00:00:00Z");
  EXPECT_FALSE(last->server_s);
}

}  // namespace
}  // namespace trammel::files
