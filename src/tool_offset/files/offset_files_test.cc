#include "tool_offset/files/offset_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "measurement/outcome_file.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(KeptOffsets, AreReadFromAFolderAsFromTheFileAndOtherInstrumentsAreNamed) {
  const test::TemporaryFolder folder;
  measurement::Outcome outcome;
  outcome.provenance.instrument = measurement::Instrument::kToolOffset;
  outcome.answers = {{"tool_1_dx", "mm", Measured::Good({0.1, 0.001, {0.098, 0.102}})},
                     {"tool_1_dy", "mm", Measured::Good({-0.2, 0.001, {-0.202, -0.198}})},
                     {"tool_2_dx", "mm", Measured::Good({0.1, 0.001, {0.098, 0.102}})},
                     {"tool_2_dy", "mm", Measured::CannotTell("too little ink")},
                     {"backlash_x", "mm", Measured::Good({0.01, 0.001, {0.008, 0.012}})}};
  ASSERT_TRUE(KeepOutcome(folder.path(), outcome));
  for (const auto& path : {folder.path(), folder.path() / kResultFile}) {
    const auto read = Must(ReadOffsetFile(path));
    ASSERT_EQ(read.good.size(), 1u);
    EXPECT_EQ(read.good[0].tool, 1);
    EXPECT_EQ(read.good[0].dx_mm, 0.1);
    EXPECT_EQ(read.good[0].dy95_mm.lo, -0.202);
    EXPECT_THAT(read.refused, ElementsAre("tool 2: cannot_tell: too little ink"));
  }
  outcome.answers = {{"tool_1_dx", "mm", Measured::Good({90, 1, {88, 92}})},
                     {"tool_1_dy", "mm", Measured::Good({0, 1, {-2, 2}})}};
  ASSERT_TRUE(KeepOutcome(folder.path(), outcome));
  EXPECT_THAT(ReadOffsetFile(folder.path()).error().message, HasSubstr("tool_1: 90 mm"));
  outcome.answers.pop_back();
  ASSERT_TRUE(KeepOutcome(folder.path(), outcome));
  EXPECT_THAT(ReadOffsetFile(folder.path()).error().message,
              HasSubstr("tool_1 has one of dx and dy alone"));
  outcome.provenance.instrument = measurement::Instrument::kPartAlignment;
  test::WriteWhole(folder.path() / kResultFile, ToJson(outcome));
  EXPECT_THAT(ReadOffsetFile(folder.path()).error().message,
              HasSubstr("a result of part alignment, not of tool offsets"));
}

using ::testing::SizeIs;

OffsetChange Change(OffsetStage stage, int tool) {
  OffsetChange change;
  change.stage = stage;
  change.time = "2026-11-22T02:00:00+0000";
  change.printer = "printer.local:7125";
  change.source = "a \"quoted\"\nname.json";
  change.tool = tool;
  change.dx_mm = 0.1234567890123;
  change.dy_mm = -0.25;
  change.old_offset = {0.5, -0.75};
  change.new_offset = {0.377, -0.5};
  return change;
}

class OffsetHistory : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "new" / "history.jsonl";
};

TEST_F(OffsetHistory, GrowsByALineAndComesBackAsItWas) {
  ASSERT_TRUE(AppendToHistory(path_, Change(OffsetStage::kBegun, 1)));
  ASSERT_TRUE(AppendToHistory(path_, Change(OffsetStage::kApplied, 1)));
  ASSERT_TRUE(AppendToHistory(path_, Change(OffsetStage::kKept, 2)));
  const auto changes = Must(ReadOffsetChanges(path_));
  ASSERT_THAT(changes, SizeIs(3));
  const OffsetChange& second = changes[1];
  EXPECT_EQ(second.stage, OffsetStage::kApplied);
  EXPECT_EQ(second.source, "a \"quoted\"\nname.json");
  EXPECT_EQ(second.dx_mm, 0.1234567890123);
  EXPECT_EQ(second.old_offset.y_mm, -0.75);
  EXPECT_EQ(second.new_offset.x_mm, 0.377);
  EXPECT_EQ(changes[2].tool, 2);
}

TEST_F(OffsetHistory, ATornLineIsLeftAndTakesNoOtherWithIt) {
  ASSERT_TRUE(AppendToHistory(path_, Change(OffsetStage::kApplied, 1)));
  const std::string whole = test::ReadWhole(path_);
  test::WriteWhole(path_, whole + whole.substr(0, whole.size() / 2));
  ASSERT_TRUE(AppendToHistory(path_, Change(OffsetStage::kApplied, 2)));
  const auto changes = Must(ReadOffsetChanges(path_));
  ASSERT_THAT(changes, SizeIs(2));
  EXPECT_EQ(changes[1].tool, 2);
}

TEST_F(OffsetHistory, NoFileIsNoHistoryAndALaterFormatIsRefused) {
  EXPECT_THAT(*ReadOffsetChanges(path_), SizeIs(0));
  test::WriteWhole(folder_.path() / "later", "{\"format\": 2, \"kind\": \"applied\"}\n");
  EXPECT_THAT(ReadOffsetChanges(folder_.path() / "later"), FailsWith("format 2"));
}

TEST_F(OffsetHistory, AFileThatCannotBeWrittenIsNamed) {
  EXPECT_THAT(AppendToHistory(folder_.path(), Change(OffsetStage::kBegun, 1)),
              FailsWith("--history"));
  test::WriteWhole(folder_.path() / "file", "x");
  EXPECT_FALSE(AppendToHistory(folder_.path() / "file" / "below", Change(OffsetStage::kBegun, 1)));
}

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
  const auto read = Must(ReadStart(folder.path()));
  EXPECT_EQ(read.stage, record.stage);
  EXPECT_EQ(read.printer, record.printer);
  EXPECT_EQ(read.run, record.run);
  EXPECT_EQ(read.started, record.started);
  EXPECT_EQ(read.printed_s, record.printed_s);
  ASSERT_EQ(read.tools.size(), 3U);
  EXPECT_EQ(read.tools[1].tool, 2);
  ASSERT_TRUE(read.tools[1].kept);
  EXPECT_EQ(read.tools[1].kept->y_mm, -0.5);
  EXPECT_FALSE(read.tools[2].kept);
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
    EXPECT_THAT(ReadStart(folder.path()), FailsWith(ErrorKind::kInput, "start.json")) << text;
  }
}

}  // namespace

}  // namespace trammel::files
