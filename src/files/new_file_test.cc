#include "files/new_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "files/whole_file.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> NamesIn(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

mode_t RightsOf(const fs::path& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 ? status.st_mode & 0777U : 0;
}

TEST(NewFile, HoldsEveryByteAndLeavesNothingBeside) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "x.bin";
  for (const std::string& bytes :
       {std::string("a\0b\r\n", 5), std::string(1'000'000, 'x'), std::string()}) {
    ASSERT_TRUE(WriteWholeFile(path, bytes, IfThere::kReplace));
    EXPECT_EQ(test::ReadWhole(path), bytes);
    EXPECT_THAT(NamesIn(folder.path()), ElementsAre("x.bin"));
  }
}

TEST(NewFile, OverwritesNothingUnasked) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "x";
  test::WriteWhole(path, "old");
  const auto refused = WriteWholeFile(path, "new", IfThere::kRefuse);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("x: is there already; name another"));
  EXPECT_EQ(test::ReadWhole(path), "old");
  EXPECT_TRUE(WriteWholeFile(path, "new", IfThere::kReplace));
  EXPECT_EQ(test::ReadWhole(path), "new");
  EXPECT_THAT(NamesIn(folder.path()), ElementsAre("x"));
}

TEST(NewFile, OverwritesNothingThatCameWhileItWasWritten) {
  const test::TemporaryFolder folder;
  auto file = NewFile::Create(folder.path() / "x", IfThere::kRefuse);
  ASSERT_TRUE(file);
  test::WriteWhole(folder.path() / "x", "another's");
  EXPECT_FALSE(file->Commit());
  EXPECT_EQ(test::ReadWhole(folder.path() / "x"), "another's");
}

TEST(NewFile, FollowsNoLinkLaidOutForIt) {
  const test::TemporaryFolder folder;
  test::WriteWhole(folder.path() / "anothers", "precious");
  fs::create_symlink(folder.path() / "anothers", folder.path() / "x.part");
  fs::create_symlink(folder.path() / "anothers", folder.path() / "x");
  for (const IfThere if_there : {IfThere::kRefuse, IfThere::kReplace}) {
    const auto refused = WriteWholeFile(folder.path() / "x", "new", if_there);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("is a link"));
  }
  fs::remove(folder.path() / "x");
  EXPECT_TRUE(WriteWholeFile(folder.path() / "x", "new", IfThere::kRefuse));
  EXPECT_EQ(test::ReadWhole(folder.path() / "anothers"), "precious");
}

TEST(NewFile, NamesThatNobodyCanGuess) {
  const test::TemporaryFolder folder;
  const auto one = NewFile::Create(folder.path() / "x", IfThere::kRefuse);
  const auto two = NewFile::Create(folder.path() / "x", IfThere::kRefuse);
  ASSERT_TRUE(one && two);
  EXPECT_NE(one->temporary_path(), two->temporary_path());
  EXPECT_EQ(one->temporary_path().parent_path(), folder.path());
}

TEST(NewFile, WritesToOrdinaryFilesOnly) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder.path() / "folder");
  test::WriteWhole(folder.path() / "folder" / "inside", "old");
  ASSERT_EQ(mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  const struct {
    fs::path path;
    const char* says;
  } cases[] = {{"/dev/full", "is a device"},
               {"/dev/null", "is a device"},
               {folder.path() / "folder", "is a folder"},
               {folder.path() / "folder" / "", "a folder's name"},
               {folder.path() / "pipe", "is a pipe"},
               {folder.path() / "missing" / "x.bin", "No such file"}};
  for (const auto& odd : cases) {
    const auto refused = WriteWholeFile(odd.path, "new", IfThere::kReplace);
    ASSERT_FALSE(refused) << odd.path;
    EXPECT_THAT(refused.error().message, HasSubstr(odd.path.string()));
    EXPECT_THAT(refused.error().message, HasSubstr(odd.says));
  }
  EXPECT_EQ(test::ReadWhole(folder.path() / "folder" / "inside"), "old");
  EXPECT_THAT(NamesIn(folder.path()), ElementsAre("folder", "pipe"));
}

TEST(NewFile, KeepsASecretForItsOwner) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "key";
  ASSERT_TRUE(WriteWholeFile(path, "1", IfThere::kRefuse, Readable::kByOwner));
  EXPECT_EQ(RightsOf(path), 0600U);
  ASSERT_TRUE(WriteWholeFile(path, "2", IfThere::kReplace));  // previous permissions are kept
  EXPECT_EQ(RightsOf(path), 0600U);
}

TEST(AppendLine, AddsWholeLinesAndEndsATornOne) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "log";
  ASSERT_TRUE(AppendLine(path, "one"));
  ASSERT_TRUE(AppendLine(path, "two"));
  EXPECT_EQ(test::ReadWhole(path), "one\ntwo\n");
  test::WriteWhole(path, "torn");
  ASSERT_TRUE(AppendLine(path, "three"));
  EXPECT_EQ(test::ReadWhole(path), "torn\nthree\n");
}

TEST(AppendLine, LeavesNothingOfALineThatFindsNoRoom) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "log";
  ASSERT_TRUE(AppendLine(path, "one"));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit little{10, before.rlim_max};  // like a disk with room for four more bytes
  const auto old_handler = signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  const auto added = AppendLine(path, "two and more");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  signal(SIGXFSZ, old_handler);
  EXPECT_FALSE(added);
  EXPECT_EQ(test::ReadWhole(path), "one\n");
}

TEST(AppendLine, FollowsNoLinkAndWritesToOrdinaryFilesOnly) {
  const test::TemporaryFolder folder;
  test::WriteWhole(folder.path() / "anothers", "precious");
  fs::create_symlink(folder.path() / "anothers", folder.path() / "log");
  EXPECT_FALSE(AppendLine(folder.path() / "log", "line"));
  EXPECT_EQ(test::ReadWhole(folder.path() / "anothers"), "precious");
  EXPECT_FALSE(AppendLine("/dev/null", "line"));
  EXPECT_FALSE(AppendLine(folder.path(), "line"));
}

TEST(NewFile, LeavesNothingBehindWithoutItsEnd) {
  const test::TemporaryFolder folder;
  {
    const auto file = NewFile::Create(folder.path() / "x", IfThere::kRefuse);
    ASSERT_TRUE(file);
    EXPECT_TRUE(file->Write("half"));
  }
  EXPECT_THAT(NamesIn(folder.path()), IsEmpty());
}

// Runs in its own process, as the limit is permanent.
TEST(NewFile, NamesTheLimitOnFilesAndKeepsTheOldOne) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "x";
  test::WriteWhole(path, "old");
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    const auto failed = WriteWholeFile(path, std::string(2000, 'x'), IfThere::kReplace);
    const bool named = !failed && failed.error().message.find("ulimit -f") != std::string::npos;
    _exit(named ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(test::ReadWhole(path), "old");
  EXPECT_THAT(NamesIn(folder.path()), ElementsAre("x"));
}

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

// In a world-writable folder, others can create the lock file first, and hold the lock.
TEST_F(FileLockWithin, RefusesALockThatAnotherUserMade) {
  test::WriteWhole(path_, "");
  if (chown(path_.c_str(), 12345, 12345) != 0) GTEST_SKIP() << "not root";
  const auto lock = FileLock::Take(path_, "us");
  ASSERT_FALSE(lock);
  EXPECT_EQ(lock.error().kind, ErrorKind::kInput);
  EXPECT_THAT(lock.error().message, HasSubstr("a.lock: the lock belongs to another user (12345)"));
  // A lock of the folder's owner is trusted like one of root.
  ASSERT_EQ(chown(folder_.path().c_str(), 12345, 12345), 0);
  EXPECT_TRUE(FileLock::Take(path_, "us"));
}

TEST(WholeFile, ReadsEveryByte) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "x.bin";
  const std::string small("a\0b\r\n", 5);
  const std::string large(1'000'000, 'x');  // more than is read at once
  for (const std::string& bytes : {small, large, std::string()}) {
    test::WriteWhole(path, bytes);
    EXPECT_EQ(*ReadWholeFile(path, large.size()), bytes);
  }
}

TEST(WholeFile, NamesWhatCannotBeRead) {
  const test::TemporaryFolder folder;
  test::WriteWhole(folder.path() / "four", "1234");
  test::WriteWhole(folder.path() / "huge", "");
  fs::resize_file(folder.path() / "huge", std::uintmax_t{1} << 36);  // a hole: it takes no room
  const struct {
    fs::path path;
    const char* says;
  } cases[] = {{folder.path() / "none", "no such file"},
               {folder.path(), "is a folder"},
               {folder.path() / "four", "larger than 3 bytes"},
               {folder.path() / "huge", "larger than 3 bytes"}};
  for (const auto& bad : cases) {
    const auto read = ReadWholeFile(bad.path, 3);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr(bad.path.string()));
    EXPECT_THAT(read.error().message, HasSubstr(bad.says));
  }
  EXPECT_TRUE(ReadWholeFile(folder.path() / "four", 4));
}

}  // namespace
}  // namespace trammel::files
