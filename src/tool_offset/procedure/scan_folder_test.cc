#include "tool_offset/procedure/scan_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <ctime>

#include "support/temporary_folder.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
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
  Put("old.png", "scanned over", 900);  // as from a computer whose clock is slow
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
  for (std::size_t i = 0; i < ScanFolder::kMostFiles + 100; ++i) {
    test::WriteWhole(At("f" + std::to_string(i)), "x");
  }
  (void)folder.Next();
  EXPECT_LE(folder.Next().ready.size(), ScanFolder::kMostFiles);
}

}  // namespace
}  // namespace trammel::procedure
