#include "tool_offset/procedure/guided_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <deque>

#include "support/temporary_folder.h"

namespace trammel::procedure {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Types its lines one after the other, then goes.
class Typist : public Person {
 public:
  explicit Typist(std::deque<std::string> lines) : lines_(std::move(lines)) {}
  Result<void> CheckCanAnswer(const std::string&) const override { return {}; }
  bool AnsweredBefore(const std::string&) const override { return false; }
  Result<bool> Confirm(const Question&, const std::function<Result<void>()>&) override {
    return true;
  }
  Result<std::optional<std::string>> LineWithin(double) override {
    if (lines_.empty()) return Fail("gone", ErrorKind::kInterrupted);
    std::string line = lines_.front();
    lines_.pop_front();
    if (line == "(waits)") return std::optional<std::string>();
    return std::optional(std::move(line));
  }

 private:
  std::deque<std::string> lines_;
};

class WaitForScanTest : public ::testing::Test {
 protected:
  Result<void> Wait(std::deque<std::string> lines) {
    Typist typist(std::move(lines));
    ScanWait wait;
    wait.folder = folder_.path();
    wait.since_s = since_s_;
    wait.read = [this](const std::filesystem::path& path) -> Result<bool> {
      read_.push_back(path.filename().string());
      if (path.filename() != "good.png") return Fail(path.filename().string() + " is no sheet");
      return true;
    };
    wait.say = [this](const std::string& line) { said_.push_back(line); };
    return WaitForScan(typist, wait);
  }

  test::TemporaryFolder folder_;
  std::int64_t since_s_ = 0;
  std::vector<std::string> read_;
  std::vector<std::string> said_;
};

TEST_F(WaitForScanTest, WhatDoesNotAnswerIsSaidAndItGoesOnWaiting) {
  test::WriteWhole(folder_.path() / "letter.pdf", "x");
  std::filesystem::create_directory(folder_.path() / "later");
  test::WriteWhole(folder_.path() / "later" / "good.png", "x");
  const std::string good = (folder_.path() / "later" / "good.png").string();
  ASSERT_TRUE(Wait({"(waits)", "(waits)", "no/such file", "", good}));
  EXPECT_THAT(read_, ElementsAre("letter.pdf", "good.png"));
  EXPECT_THAT(said_, ElementsAre("letter.pdf is no sheet; waiting for another",
                                 HasSubstr("no/such file: is not there")));
}

TEST_F(WaitForScanTest, AFolderThatIsTypedIsWatchedInstead) {
  std::filesystem::create_directory(folder_.path() / "later");
  test::WriteWhole(folder_.path() / "later" / "good.png", "x");
  ASSERT_TRUE(Wait({(folder_.path() / "later").string(), "(waits)", "(waits)", "(waits)"}));
  EXPECT_THAT(read_, ElementsAre("good.png"));
}

TEST_F(WaitForScanTest, WhatIsOlderThanThePrintHasToBeTypedTwice) {
  since_s_ = 4'000'000'000;  // in the year 2096
  std::filesystem::create_directory(folder_.path() / "later");
  test::WriteWhole(folder_.path() / "later" / "good.png", "x");
  const std::string good = (folder_.path() / "later" / "good.png").string();
  EXPECT_FALSE(Wait({good, "(waits)"}));
  EXPECT_THAT(read_, IsEmpty());
  EXPECT_THAT(said_, ElementsAre(HasSubstr("before the sheet was printed")));
  EXPECT_TRUE(Wait({good, good}));
  EXPECT_THAT(read_, ElementsAre("good.png"));
}

TEST_F(WaitForScanTest, NoDeviceAndNoPipeIsOpened) {
  const auto ended = Wait({"/dev/zero"});
  EXPECT_EQ(ended.error().kind, ErrorKind::kInterrupted);
  EXPECT_THAT(read_, IsEmpty());
  EXPECT_THAT(said_, Contains(HasSubstr("neither a file nor a folder")));
}

TEST(TypedPath, IsAsShellsAndFileManagersWriteIt) {
  setenv("HOME", "/home/somebody", 1);
  EXPECT_EQ(TypedPath("  scan.png \r"), "scan.png");
  EXPECT_EQ(TypedPath("'/a b/c.png' "), "/a b/c.png");
  EXPECT_EQ(TypedPath("/a\\ b/c.png"), "/a b/c.png");
  EXPECT_EQ(TypedPath("file:///a/c.png"), "/a/c.png");
  EXPECT_EQ(TypedPath("~/Scans/c.png"), "/home/somebody/Scans/c.png");
  EXPECT_EQ(TypedPath("   "), "");
}

TEST(CorrectionsOf, TakesOutOfWhatWasKeptWhileItWasPrinted) {
  files::StartRecord record;
  record.tools = {
      {0, tool_offset::KeptOffset{0, 0}}, {1, tool_offset::KeptOffset{0.25, -0.5}}, {2}};
  files::OffsetFile measured;
  measured.good = {{1, 0.1, -0.05}, {2, 0.3, 0.3}};
  const auto corrections = CorrectionsOf(record, measured);
  ASSERT_EQ(corrections.size(), 1U);  // tool 2's own offset is not told
  EXPECT_EQ(corrections[0].tool, 1);
  EXPECT_DOUBLE_EQ(corrections[0].next.x_mm, 0.15);
  EXPECT_DOUBLE_EQ(corrections[0].next.y_mm, -0.45);
}

}  // namespace
}  // namespace trammel::procedure
