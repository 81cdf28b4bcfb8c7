#include "tool_offset/procedure/guided_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <ctime>
#include <deque>

#include "support/temporary_folder.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;

/// Types its lines one after the other, then goes.
class Typist : public Operator {
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

using ::testing::IsEmpty;

class ScanFolderTest : public ::testing::Test {
 protected:
  void Put(const std::string& name, const std::string& bytes, double age_s = 0) {
    const auto path = folder_.path() / name;
    test::WriteWhole(path, bytes);
    std::filesystem::last_write_time(path,
                                     std::filesystem::file_time_type::clock::now() -
                                         std::chrono::milliseconds(static_cast<int>(1000 * age_s)));
  }
  [[nodiscard]] std::filesystem::path At(const std::string& name) const {
    return folder_.path() / name;
  }

  test::TemporaryFolder folder_;
  const std::int64_t now_s_ = static_cast<std::int64_t>(std::time(nullptr));
};

TEST_F(ScanFolderTest, AFileCountsOnceItHasStayedAsItIs) {
  ScanFolder folder(folder_.path(), now_s_ - 60);
  EXPECT_THAT(folder.Next().ready, IsEmpty());
  Put("a.png", "half", 5);
  EXPECT_THAT(folder.Next().ready, IsEmpty());
  Put("a.png", "half and more", 4);
  const auto grown = folder.Next();
  EXPECT_THAT(grown.ready, IsEmpty());
  EXPECT_THAT(grown.growing, ElementsAre(At("a.png")));
  EXPECT_THAT(folder.Next().ready, ElementsAre(At("a.png")));
  EXPECT_THAT(folder.Next().ready, IsEmpty());  // once
  Put("a.png", "again", 1);
  EXPECT_THAT(folder.Next().ready, IsEmpty());
  EXPECT_THAT(folder.Next().ready, ElementsAre(At("a.png")));
}

TEST_F(ScanFolderTest, AnEmptyFileIsBeingWritten) {
  ScanFolder folder(folder_.path(), now_s_ - 60);
  Put("a.png", "");
  for (int i = 0; i < 3; ++i) EXPECT_THAT(folder.Next().ready, IsEmpty());
}

TEST_F(ScanFolderTest, OldFilesCountOnlyWhereTheyChange) {
  Put("old.png", "old", 1000);
  Put("new.png", "new", 0);
  ScanFolder folder(folder_.path(), now_s_ - 60);
  EXPECT_THAT(folder.Next().ready, IsEmpty());
  EXPECT_THAT(folder.Next().ready, ElementsAre(At("new.png")));
  Put("old.png", "scanned over", 900);  // like files of a computer whose clock is slow
  (void)folder.Next();
  EXPECT_THAT(folder.Next().ready, ElementsAre(At("old.png")));
  Put("late.png", "another, with an old date", 5000);
  (void)folder.Next();
  EXPECT_THAT(folder.Next().ready, ElementsAre(At("late.png")));
}

TEST_F(ScanFolderTest, NothingButOrdinaryFilesAreOpened) {
  ScanFolder folder(folder_.path(), 0);
  for (const char* name : {".hidden.png", "a.png.part", "b.png.crdownload", "c.png~"})
    Put(name, "x");
  ASSERT_EQ(mkfifo(At("pipe.png").c_str(), 0600), 0);
  std::filesystem::create_directory(At("folder.png"));
  std::filesystem::create_symlink("/dev/zero", At("zero.png"));
  std::filesystem::create_symlink("nowhere", At("nowhere.png"));
  (void)folder.Next();
  EXPECT_THAT(folder.Next().ready, IsEmpty());
}

TEST_F(ScanFolderTest, AFolderThatIsNotThereHasNothingUntilItIs) {
  ScanFolder folder(At("later"), now_s_ - 60);
  EXPECT_THAT(folder.Next().ready, IsEmpty());
  std::filesystem::create_directory(At("later"));
  test::WriteWhole(At("later") / "a.png", "x");
  (void)folder.Next();
  EXPECT_THAT(folder.Next().ready, ElementsAre(At("later") / "a.png"));
}

TEST_F(ScanFolderTest, OfVeryManyFilesABoundedNumberIsLookedAt) {
  ScanFolder folder(folder_.path(), now_s_ - 60);
  for (std::size_t i = 0; i < ScanFolder::kMaxFiles + 100; ++i) {
    test::WriteWhole(At("f" + std::to_string(i)), "x");
  }
  (void)folder.Next();
  EXPECT_LE(folder.Next().ready.size(), ScanFolder::kMaxFiles);
}

}  // namespace

}  // namespace trammel::procedure
