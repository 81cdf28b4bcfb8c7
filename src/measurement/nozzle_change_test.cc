#include "measurement/nozzle_change.h"

#include <gtest/gtest.h>

#include <string>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

constexpr const char* kEver = "9999-01-01T00:00:00Z";

class NozzleChangeTest : public ::testing::Test {
 protected:
  std::string Last(const std::string& printer, const std::string& until = kEver) {
    const auto last = LastNozzleChange(path_, printer, until);
    EXPECT_TRUE(last) << last.error().message;
    return last.value_or("");
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
  EXPECT_EQ(Last("voron"), "2026-01-02T00:00:00Z");
  EXPECT_EQ(Last("ender"), "2026-01-03T00:00:00Z");
  EXPECT_EQ(Last("other"), "");
  EXPECT_EQ(Last("voron", "2026-01-01T12:00:00Z"), "2026-01-01T00:00:00Z")
      << "a change after the result is none of its";
}

TEST_F(NozzleChangeTest, LinesThatAreNoChangeArePassedOver) {
  test::WriteWhole(
      path_, "{\n[]\n{\"utc\": 5, \"printer\": \"voron\"}\n" + std::string(2 << 20, 'x') + "\n");
  ASSERT_TRUE(NoteNozzleChange(path_, {"2026-01-02T00:00:00Z", "voron"}));
  EXPECT_EQ(Last("voron"), "2026-01-02T00:00:00Z");
}

}  // namespace
}  // namespace trammel::files
