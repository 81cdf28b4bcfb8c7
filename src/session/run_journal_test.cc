#include "session/run_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>

#include "files/new_file.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

class RunJournalTest : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  const std::filesystem::path path_ = JournalPath(folder_.path(), "ws://pi:7125/websocket");

  static RunJournal Full() {
    RunJournal journal;
    journal.run = "20261122-1a-9";
    journal.address = "ws://pi:7125/websocket";
    journal.started = "2026-11-22T10:00:00";
    journal.upload = "t.gcode";
    journal.before = {{"max_velocity", 300},
                      {"max_accel", 5000},
                      {"square_corner_velocity", 5},
                      {"minimum_cruise_ratio", 0.5},
                      {"pressure_advance extruder", 0.031},
                      {"smooth_time extruder", 0.04},
                      {"pressure_advance extruder_stepper belted", 0.052},
                      {"target extruder", 0},
                      {"target heater_generic chamber", 45.5},
                      {"absolute_extrude", 1},
                      {"offset z", -0.05}};
    journal.given = {{"pressure_advance extruder", {0, 0.005, 0.01}}, {"max_accel", {3000}}};
    journal.last_print = "vase.gcode";
    journal.last_print_s = 3600.5;
    return journal;
  }
  std::string FaultOf(const std::string& from, const std::string& to) {
    EXPECT_TRUE(WriteJournal(path_, Full()));
    std::string text = test::ReadWhole(path_);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    test::WriteWhole(path_, text.replace(at, from.size(), to));
    const auto read = ReadJournal(path_);
    return read ? "no fault" : read.error().message;
  }
};

TEST_F(RunJournalTest, ReadsWhatWasWritten) {
  ASSERT_TRUE(WriteJournal(path_, Full()));
  const auto read = ReadJournal(path_);
  ASSERT_TRUE(read && *read);
  EXPECT_EQ((*read)->run, "20261122-1a-9");
  EXPECT_EQ((*read)->upload, "t.gcode");
  EXPECT_EQ((*read)->before, Full().before);
  EXPECT_EQ((*read)->given, Full().given);
  EXPECT_EQ((*read)->last_print, "vase.gcode");
  EXPECT_EQ((*read)->last_print_s, 3600.5);
  EXPECT_THAT(ReadAllJournals(folder_.path()), SizeIs(1));
}

TEST_F(RunJournalTest, WhatNoRunWritesIsNamedAndNeverReachesThePrinter) {
  EXPECT_THAT(FaultOf("0.031", "9e99"), HasSubstr("before.value"));
  EXPECT_THAT(FaultOf("0.005", "-1"), HasSubstr("given.values"));
  EXPECT_THAT(FaultOf("offset z", "offset"), HasSubstr("setting's name"));
  EXPECT_THAT(FaultOf("extruder_stepper belted", "belted\\nM112"), HasSubstr("setting's name"));
  EXPECT_THAT(FaultOf("5000", "-1"), HasSubstr("before.value"));
  EXPECT_THAT(FaultOf("45.5", "4550"), HasSubstr("before.value"));
  EXPECT_THAT(FaultOf("target extruder", "target extruder\\nM112"), HasSubstr("setting's name"));
  EXPECT_THAT(FaultOf("20261122-1a-9", "a b"), HasSubstr("run's name"));
  EXPECT_THAT(FaultOf("t.gcode", "../t.gcode"), HasSubstr("upload"));
  EXPECT_THAT(FaultOf("{", "["), HasSubstr("JSON"));
}

TEST_F(RunJournalTest, WhatCannotBeNotedIsNotBegun) {
  EXPECT_THAT(WriteJournal("/dev/full/journal.json", Full()), FailsWith("nothing is begun"));
}

TEST_F(RunJournalTest, TheStateFolderIsForItsUserAlone) {
  setenv("XDG_STATE_HOME", folder_.path().c_str(), 1);
  const auto folder = StateFolder();
  unsetenv("XDG_STATE_HOME");
  ASSERT_TRUE(folder);
  EXPECT_EQ(*folder, folder_.path() / "trammel");
  struct stat status {};
  ASSERT_EQ(stat(folder->c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0700U);
}

TEST_F(RunJournalTest, ALockHasOneHolderAndNamesIt) {
  const auto path = LockPath(folder_.path(), "a:1");
  {
    const auto first = FileLock::Take(path, "process 17");
    ASSERT_TRUE(first);
    EXPECT_THAT(FileLock::Take(path, "process 18"), FailsWith(ErrorKind::kMachine, "process 17"));
  }
  EXPECT_TRUE(FileLock::Take(path, "process 18"));
  EXPECT_FALSE(std::filesystem::exists(path)) << "left behind";
}

TEST_F(RunJournalTest, AFileThatADeadProcessLeftIsNoLock) {
  const auto path = LockPath(folder_.path(), "a:1");
  test::WriteWhole(path, "process 17");
  EXPECT_TRUE(FileLock::Take(path, "process 18"));
}

TEST_F(RunJournalTest, ALockFollowsNoLink) {
  const auto path = LockPath(folder_.path(), "a:1");
  std::filesystem::create_symlink(folder_.path() / "elsewhere", path);
  EXPECT_FALSE(FileLock::Take(path, "process 17"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "elsewhere"));
}

}  // namespace
}  // namespace trammel::files
