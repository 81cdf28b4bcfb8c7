#include "tool_offset/files/offset_history.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;
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
  const auto changes = ReadOffsetChanges(path_);
  ASSERT_TRUE(changes) << changes.error().message;
  ASSERT_THAT(*changes, SizeIs(3));
  const OffsetChange& second = (*changes)[1];
  EXPECT_EQ(second.stage, OffsetStage::kApplied);
  EXPECT_EQ(second.source, "a \"quoted\"\nname.json");
  EXPECT_EQ(second.dx_mm, 0.1234567890123);
  EXPECT_EQ(second.old_offset.y_mm, -0.75);
  EXPECT_EQ(second.new_offset.x_mm, 0.377);
  EXPECT_EQ((*changes)[2].tool, 2);
}

TEST_F(OffsetHistory, ATornLineIsLeftAndTakesNoOtherWithIt) {
  ASSERT_TRUE(AppendToHistory(path_, Change(OffsetStage::kApplied, 1)));
  const std::string whole = test::ReadWhole(path_);
  test::WriteWhole(path_, whole + whole.substr(0, whole.size() / 2));
  ASSERT_TRUE(AppendToHistory(path_, Change(OffsetStage::kApplied, 2)));
  const auto changes = ReadOffsetChanges(path_);
  ASSERT_TRUE(changes);
  ASSERT_THAT(*changes, SizeIs(2));
  EXPECT_EQ((*changes)[1].tool, 2);
}

TEST_F(OffsetHistory, NoFileIsNoHistoryAndALaterFormatIsRefused) {
  EXPECT_THAT(*ReadOffsetChanges(path_), SizeIs(0));
  test::WriteWhole(folder_.path() / "later", "{\"format\": 2, \"kind\": \"applied\"}\n");
  const auto later = ReadOffsetChanges(folder_.path() / "later");
  ASSERT_FALSE(later);
  EXPECT_THAT(later.error().message, HasSubstr("format 2"));
}

TEST_F(OffsetHistory, AFileThatCannotBeWrittenIsNamed) {
  const auto written = AppendToHistory(folder_.path(), Change(OffsetStage::kBegun, 1));
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("--history"));
  test::WriteWhole(folder_.path() / "file", "x");
  EXPECT_FALSE(AppendToHistory(folder_.path() / "file" / "below", Change(OffsetStage::kBegun, 1)));
}

}  // namespace
}  // namespace trammel::files
