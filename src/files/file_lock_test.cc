#include "files/file_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <stop_token>
#include <thread>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;

constexpr double kLong_s = 60;  // no test waits for it

class FileLockWithin : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "a.lock";
};

TEST_F(FileLockWithin, WaitsForItsHolder) {
  auto taken = FileLock::Take(path_, "the first");
  ASSERT_TRUE(taken);
  std::optional<FileLock> first(std::move(*taken));
  std::jthread holder([&first] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    first.reset();
  });
  EXPECT_TRUE(FileLock::TakeWithin(path_, "the second", kLong_s));
}

TEST_F(FileLockWithin, NamesAHolderThatStays) {
  const auto first = FileLock::Take(path_, "the first");
  ASSERT_TRUE(first);
  const auto second = FileLock::TakeWithin(path_, "the second", 0.05);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(second.error().message, HasSubstr("the first holds"));
}

TEST_F(FileLockWithin, IsStopped) {
  const auto first = FileLock::Take(path_, "the first");
  ASSERT_TRUE(first);
  std::stop_source stop;
  stop.request_stop();
  const auto second = FileLock::TakeWithin(path_, "the second", kLong_s, stop.get_token());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::kInterrupted);
  EXPECT_FALSE(FileLock::TakeWithin(folder_.path() / "no/a.lock", "x", kLong_s));  // no waiting
}

// In a folder where everybody may make files, others can make it first, and hold it.
TEST_F(FileLockWithin, RefusesALockThatAnotherUserMade) {
  test::WriteWhole(path_, "");
  if (chown(path_.c_str(), 12345, 12345) != 0) GTEST_SKIP() << "not root";
  const auto lock = FileLock::Take(path_, "us");
  ASSERT_FALSE(lock);
  EXPECT_EQ(lock.error().kind, ErrorKind::kInput);
  EXPECT_THAT(lock.error().message, HasSubstr("a.lock: the lock belongs to another user (12345)"));
  // Of whoever the folder belongs to it is as good as of root.
  ASSERT_EQ(chown(folder_.path().c_str(), 12345, 12345), 0);
  EXPECT_TRUE(FileLock::Take(path_, "us"));
}

}  // namespace
}  // namespace trammel::files
