#include "tool_offset/procedure/guided_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

#include "support/temporary_folder.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;

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
    wait.read = [this](const std::filesystem::path& path) -> Result<bool> {
      read_.push_back(path.filename().string());
      if (path.filename() != "good.png") return Fail(path.filename().string() + " is no sheet");
      return true;
    };
    wait.say = [this](const std::string& line) { said_.push_back(line); };
    return WaitForScan(typist, wait);
  }

  test::TemporaryFolder folder_;
  std::vector<std::string> read_;
  std::vector<std::string> said_;
};

TEST_F(WaitForScanTest, NamesWhatDoesNotAnswerAndGoesOnWaiting) {
  test::WriteWhole(folder_.path() / "letter.pdf", "x");
  EXPECT_EQ(Wait({"(waits)", "typed"}).error().kind, ErrorKind::kInterrupted);
  EXPECT_THAT(read_, ElementsAre("letter.pdf"));
  EXPECT_THAT(said_, ElementsAre("letter.pdf is no sheet; waiting for another"));
  test::WriteWhole(folder_.path() / "good.png", "x");
  EXPECT_TRUE(Wait({"(waits)", "(waits)", "(waits)"}));
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
