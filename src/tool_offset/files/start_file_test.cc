#include "tool_offset/files/start_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;

TEST(StartFile, ComesBackAsItWasWritten) {
  const test::TemporaryFolder folder;
  StartRecord record;
  record.stage = StartStage::kPrinted;
  record.printer = "voron.local:7125";
  record.run = "20261126-101500-a1-0badcafe";
  record.started = "2026-11-26T10:15:00";
  record.printed_s = 1'795'000'000;
  record.tools = {
      {0, tool_offset::KeptOffset{0, 0}}, {2, tool_offset::KeptOffset{0.25, -0.5}}, {3}};
  ASSERT_TRUE(WriteStart(folder.path(), record));
  const auto read = ReadStart(folder.path());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->stage, record.stage);
  EXPECT_EQ(read->printer, record.printer);
  EXPECT_EQ(read->run, record.run);
  EXPECT_EQ(read->started, record.started);
  EXPECT_EQ(read->printed_s, record.printed_s);
  ASSERT_EQ(read->tools.size(), 3U);
  EXPECT_EQ(read->tools[1].tool, 2);
  ASSERT_TRUE(read->tools[1].kept);
  EXPECT_EQ(read->tools[1].kept->y_mm, -0.5);
  EXPECT_FALSE(read->tools[2].kept);
  record.stage = StartStage::kAnalysed;
  ASSERT_TRUE(WriteStart(folder.path(), record));
  EXPECT_EQ(ReadStart(folder.path())->stage, StartStage::kAnalysed);
}

TEST(StartFile, TheLastSheetOfAPrinterIsTheOneThatWasPrintedLast) {
  const test::TemporaryFolder recordings;
  const auto write = [&recordings](const char* name, const char* printer, std::int64_t printed_s) {
    StartRecord record;
    record.stage = printed_s > 0 ? StartStage::kPrinted : StartStage::kPrinting;
    record.printer = printer;
    record.run = name;
    record.printed_s = printed_s;
    record.tools = {{0}, {1}};
    std::filesystem::create_directory(recordings.path() / name);
    EXPECT_TRUE(WriteStart(recordings.path() / name, record));
  };
  std::filesystem::create_directory(recordings.path() / "other");
  test::WriteWhole(recordings.path() / "file", "");
  EXPECT_THAT(LastStart(recordings.path(), "voron").error().message, HasSubstr("print one first"));
  EXPECT_FALSE(LastStart(recordings.path() / "nowhere", "voron"));
  write("a", "voron", 1'700'000'200);
  write("b", "voron", 1'700'000'100);
  write("c", "ender", 1'700'000'900);
  std::filesystem::create_directory(recordings.path() / "broken");
  test::WriteWhole(recordings.path() / "broken" / "start.json", "{");
  auto last = LastStart(recordings.path(), "voron");
  ASSERT_TRUE(last) << last.error().message;
  EXPECT_EQ(last->record.run, "a");
  EXPECT_EQ(last->since_s, 1'700'000'200);
  // One that was begun and not seen to its end counts by when that was noted: now.
  write("d", "voron", 0);
  last = LastStart(recordings.path(), "voron");
  ASSERT_TRUE(last);
  EXPECT_EQ(last->record.run, "d");
  EXPECT_GT(last->since_s, 1'700'000'200);
}

TEST(StartFile, WhatNoStartWroteIsRefusedByName) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(ReadStart(folder.path()).error().message,
              HasSubstr("no folder of trammel offset start"));
  for (
      const char* text :
      {"", "[]", "{\"format\": 1}",
       R"({"format":2,"stage":"printed","printer":"p","run":"r","started":"s","printed_s":0,"tools":[]})",
       R"({"format":1,"stage":"done","printer":"p","run":"r","started":"s","printed_s":0,"tools":[{"tool":0},{"tool":1}]})",
       R"({"format":1,"stage":"printed","printer":"p","run":"r","started":"s","printed_s":-1,"tools":[{"tool":0},{"tool":1}]})",
       R"({"format":1,"stage":"printed","printer":"p","run":"r","started":"s","printed_s":0,"tools":[{"tool":0},{"tool":99}]})",
       R"({"format":1,"stage":"printed","printer":"p","run":"r","started":"s","printed_s":0,"tools":[{"tool":0},{"tool":1,"x_mm":1e9,"y_mm":0}]})"}) {
    test::WriteWhole(folder.path() / kStartFile, text);
    const auto read = ReadStart(folder.path());
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().kind, ErrorKind::kInput);
    EXPECT_THAT(read.error().message, HasSubstr("start.json"));
  }
}

}  // namespace
}  // namespace trammel::files
