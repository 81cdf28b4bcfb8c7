#include "measurement/nozzle_change.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "measurement/outcome_file.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kEver = "9999-01-01T00:00:00Z";

class NozzleChangeTest : public ::testing::Test {
 protected:
  std::string Last(const std::string& printer, const std::string& until = kEver) {
    const auto last = LastNozzleChange(path_, printer, {until});
    EXPECT_TRUE(last) << last.error().message;
    return last && *last ? (*last)->utc : "";
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / kNozzlesFile;
};

TEST_F(NozzleChangeTest, TheLastOneOfAPrinterIsFound) {
  EXPECT_EQ(Last("voron"), "");
  for (const NozzleChange& change : {NozzleChange{"2026-01-02T00:00:00Z", "voron"},
                                     {"2026-01-03T00:00:00Z", "ender"},
                                     {"2026-01-01T00:00:00Z", "voron"}}) {
    ASSERT_TRUE(NoteNozzleChange(path_, change));
  }
  EXPECT_EQ(Last("voron"), "2026-01-01T00:00:00Z") << "the clock went back: the last line counts";
  EXPECT_EQ(Last("ender"), "2026-01-03T00:00:00Z");
  EXPECT_EQ(Last("other"), "");
  EXPECT_EQ(Last("voron", "2026-01-01T12:00:00Z"), "2026-01-01T00:00:00Z")
      << "a change after the result is none of its";
}

// The clock of a computer without a battery may be decades off until it finds the network.
TEST_F(NozzleChangeTest, TheOrderIsThatOfTheFilesWhateverTheClock) {
  const fs::path history = folder_.path() / kHistoryFile;
  test::WriteWhole(history, "{}\n{}\n");
  ASSERT_TRUE(NoteNozzleChange(path_, {"1970-01-01T00:00:10Z", "voron"}));  // behind line 2
  test::WriteWhole(history, "{}\n{}\n{}\n");
  ASSERT_TRUE(NoteNozzleChange(path_, {"2031-01-01T00:00:00Z", "voron"}));  // behind line 3
  test::WriteWhole(history, "{}\n{}\n{}\n{}\n{}\n");
  const auto before = [this](const MeasuredAt& measured) {
    const auto last = LastNozzleChange(path_, "voron", measured);
    EXPECT_TRUE(last);
    return last && *last ? (*last)->utc : "";
  };
  EXPECT_EQ(before({"2026-01-01T00:00:00Z", 2}), "");
  EXPECT_EQ(before({"2026-01-01T00:00:00Z", 3}), "1970-01-01T00:00:10Z");
  EXPECT_EQ(before({"2026-01-01T00:00:00Z", 4}), "2031-01-01T00:00:00Z");
  EXPECT_EQ(before({"2026-01-01T00:00:00Z", kStillToCome}), "2031-01-01T00:00:00Z");
  EXPECT_TRUE(IsAfter({"1970-01-01T00:00:10Z", "voron", 2}, {"2026-01-01T00:00:00Z", 2}));
  EXPECT_FALSE(IsAfter({"2031-01-01T00:00:00Z", "voron", 3}, {"2026-01-01T00:00:00Z", 4}));
}

TEST_F(NozzleChangeTest, ADayAndTheFileTakeSoMany) {
  const auto day = [](std::size_t number) {
    return fmt::format("20{:02}-{:02}-{:02}T00:00:00Z", number / 336, 1 + number / 28 % 12,
                       1 + number % 28);
  };
  for (std::size_t i = 0; i < kMostChangesADay; ++i) {
    ASSERT_TRUE(NoteNozzleChange(path_, {day(0), "voron"}));
  }
  const auto refused = NoteNozzleChange(path_, {day(0), "voron"});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("20 changes of this printer's nozzle are noted"));
  EXPECT_TRUE(NoteNozzleChange(path_, {day(0), "ender"}));
  std::string text;
  for (std::size_t i = 0; i < 3 * kMostChanges; ++i) {
    text += fmt::format(R"({{"utc": "{}", "printer": "voron"}})", day(i)) + "\n";
  }
  test::WriteWhole(path_, text);
  ASSERT_TRUE(NoteNozzleChange(path_, {day(3 * kMostChanges), "voron"}));
  const std::string kept = test::ReadWhole(path_);
  EXPECT_EQ(std::ranges::count(kept, '\n'), static_cast<std::ptrdiff_t>(kMostChanges));
  EXPECT_EQ(Last("voron"), day(3 * kMostChanges));
  EXPECT_THAT(kept, Not(HasSubstr(day(2 * kMostChanges))));
}

TEST_F(NozzleChangeTest, LinesThatAreNoChangeArePassedOver) {
  test::WriteWhole(
      path_, "{\n[]\n{\"utc\": 5, \"printer\": \"voron\"}\n" + std::string(2 << 20, 'x') + "\n");
  ASSERT_TRUE(NoteNozzleChange(path_, {"2026-01-02T00:00:00Z", "voron"}));
  EXPECT_EQ(Last("voron"), "2026-01-02T00:00:00Z");
}

}  // namespace
}  // namespace trammel::files
