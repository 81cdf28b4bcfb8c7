#include "service/job_process.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "measurement/remark.h"
#include "support/temporary_folder.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class RunBudgetTest : public testing::Test {
 protected:
  fs::path Run(const std::string& name, const std::string& file, std::size_t bytes) const {
    fs::create_directories(folder_.path() / name);
    test::WriteWhole(folder_.path() / name / file, std::string(bytes, 'x'));
    return folder_.path() / name / file;
  }
  Result<void> MakeRoom(const RunBudget& budget) const {
    return MakeRoomForRun(folder_.path(), "2026-01-02T12:00:00Z", "photo", budget);
  }

  test::TemporaryFolder folder_;
};

TEST_F(RunBudgetTest, ADayTakesSoManyRunsAndTheNextAsMany) {
  for (int i = 0; i < 3; ++i) Run(fmt::format("photo-20260102T00000{}Z", i), "result.json", 1);
  Run("photo-20260101T000000Z", "result.json", 1);
  Run("of mine, 20260102", "result.json", 1);
  EXPECT_TRUE(MakeRoom({.max_runs_a_day = 4}));
  const auto refused = MakeRoom({.max_runs_a_day = 3});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("3 runs were begun today"));
}

TEST_F(RunBudgetTest, UploadsAndSurveysOfAPageAreCountedByThemselves) {
  Run("survey-20260102T000000Z", "photo-001.jpg", 1);
  Run("upload-20260102T000000Z", "photo.jpg", 1);
  EXPECT_TRUE(MakeRoom({.max_runs_a_day = 1}));
  const auto refused =
      MakeRoomForRun(folder_.path(), "2026-01-02T12:00:00Z", kSurvey, {.max_uploads_a_day = 2});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("2 runs"));
}

TEST_F(RunBudgetTest, PinnedCopiesStay) {
  const fs::path pinned = Run("upload-20260101T000000Z", "photo.jpg", 1000);
  const fs::path other = Run("upload-20260102T000000Z", "photo.jpg", 1000);
  ASSERT_TRUE(files::WriteRemark(pinned.parent_path(), {"", true}));
  RemoveOldCopies(folder_.path(), {.max_copied_bytes = 500});
  EXPECT_TRUE(fs::exists(pinned));
  EXPECT_FALSE(fs::exists(other));
}

TEST(FoldersInUse, AreUsedByManyOrDeletedByOne) {
  FoldersInUse in_use;
  auto first = in_use.Use("a");
  const auto second = in_use.Use("a");
  EXPECT_TRUE(first && second);
  first.reset();
  EXPECT_FALSE(in_use.Delete("a"));
  auto other = in_use.Delete("b");
  EXPECT_TRUE(other);
  EXPECT_FALSE(in_use.Use("b"));
  EXPECT_FALSE(in_use.Delete("b"));
  other.reset();
  EXPECT_TRUE(in_use.Use("b"));
}

TEST_F(RunBudgetTest, TheOldestCopiesOfUploadsGoAndNothingElse) {
  const fs::path oldest = Run("photo-20260101T000000Z", "photo.jpg", 1000);
  const fs::path result = Run("photo-20260101T000000Z", "result.json", 5000);
  const fs::path mine = Run("photo-20260101T000000Z", "photographs.jpg", 5000);
  const fs::path scan = Run("tool_offset-20260101T000001Z", "scan-2.pdf", 1000);
  const fs::path newest = Run("photo-20260102T000000Z-2", "photo.jpg", 1000);
  const fs::path elsewhere = Run("my photos", "photo.jpg", 5000);
  ASSERT_TRUE(MakeRoom({.max_copied_bytes = 3000}));
  EXPECT_TRUE(fs::exists(oldest));
  ASSERT_TRUE(MakeRoom({.max_copied_bytes = 2500}));
  EXPECT_FALSE(fs::exists(oldest));
  EXPECT_TRUE(fs::exists(scan));
  ASSERT_TRUE(MakeRoom({.max_copied_bytes = 1000}));
  EXPECT_FALSE(fs::exists(scan));
  for (const fs::path& file : {result, mine, newest, elsewhere})
    EXPECT_TRUE(fs::exists(file)) << file;
}

TEST_F(RunBudgetTest, NoLinkIsFollowed) {
  const test::TemporaryFolder other;
  test::WriteWhole(other.path() / "photo.jpg", std::string(5000, 'x'));
  fs::create_directory_symlink(other.path(), folder_.path() / "photo-20260101T000000Z");
  fs::create_directories(folder_.path() / "photo-20260101T000001Z");
  fs::create_symlink(other.path() / "photo.jpg",
                     folder_.path() / "photo-20260101T000001Z/photo.jpg");
  ASSERT_TRUE(MakeRoom({.max_copied_bytes = 0}));
  EXPECT_TRUE(fs::exists(other.path() / "photo.jpg"));
  EXPECT_TRUE(fs::is_symlink(folder_.path() / "photo-20260101T000001Z/photo.jpg"));
}

}  // namespace
}  // namespace trammel::service
