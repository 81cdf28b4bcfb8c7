#include "tool_offset/files/offset_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "measurement/outcome_file.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class OffsetFileTest : public testing::Test {
 protected:
  Result<OffsetFile> Read(const std::string& text) {
    const auto path = folder_.path() / "offsets.json";
    test::WriteWhole(path, text);
    return ReadOffsetFile(path);
  }
  std::string Complaint(const std::string& text) {
    const auto read = Read(text);
    EXPECT_FALSE(read);
    return read ? "" : read.error().message;
  }

  test::TemporaryFolder folder_;
};

TEST_F(OffsetFileTest, GoodToolsHaveValuesAndTheOthersAReason) {
  const auto read = Read(R"({"format": 1, "tools": [
    {"tool": 1, "verdict": "good", "dx_mm": 0.123, "dy_mm": -0.045, "later": 1},
    {"tool": 2, "verdict": "refused", "reason": "it did not print", "dx_mm": null}]})");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->good.size(), 1U);
  EXPECT_EQ(read->good[0].tool, 1);
  EXPECT_EQ(read->good[0].dx_mm, 0.123);
  EXPECT_EQ(read->good[0].dy_mm, -0.045);
  EXPECT_THAT(read->refused, ElementsAre("tool 2: refused: it did not print"));
}

TEST_F(OffsetFileTest, AnIntervalIsTakenWhereItHoldsTheValueAndNowhereElse) {
  const auto read = [this](const std::string& interval) {
    return Read(R"({"tools": [{"tool": 1, "verdict": "good", "dx_mm": 0.1, "dy_mm": 0.2,
                 "interval95_mm": )" +
                interval + "}]}");
  };
  const auto both = read(R"({"dx": [0.09, 0.11], "dy": [0.15, 0.25]})");
  ASSERT_TRUE(both) << both.error().message;
  ASSERT_TRUE(both->good[0].dx95_mm && both->good[0].dy95_mm);
  EXPECT_EQ(both->good[0].dx95_mm->lo, 0.09);
  EXPECT_EQ(both->good[0].dy95_mm->hi, 0.25);
  for (const char* interval : {"null", "[1, 2]", R"({"dx": [0.2, 0.3]})", R"({"dx": [0.11, 0.09]})",
                               R"({"dx": [0.1]})", R"({"dx": ["a", "b"]})", R"({"dy": {}})"}) {
    const auto none = read(interval);
    ASSERT_TRUE(none) << interval;
    EXPECT_FALSE(none->good[0].dx95_mm) << interval;
    EXPECT_FALSE(none->good[0].dy95_mm) << interval;
  }
}

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
    const auto read = ReadOffsetFile(path);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->good.size(), 1u);
    EXPECT_EQ(read->good[0].tool, 1);
    EXPECT_EQ(read->good[0].dx_mm, 0.1);
    EXPECT_EQ(read->good[0].dy95_mm->lo, -0.202);
    EXPECT_THAT(read->refused, ElementsAre("tool 2: cannot_tell: too little ink"));
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

TEST_F(OffsetFileTest, WhatCannotBeIsNamed) {
  EXPECT_THAT(Complaint("{}"), HasSubstr("tools"));
  EXPECT_THAT(Complaint(R"({"format": 2, "tools": []})"), HasSubstr("format"));
  EXPECT_THAT(Complaint(R"({"tools": [{"tool": 1, "verdict": "good", "dx_mm": 0.1}]})"),
              HasSubstr("dy_mm"));
  EXPECT_THAT(Complaint(R"({"tools": [{"tool": 1, "verdict": "good", "dx_mm": 900, "dy_mm": 0}]})"),
              HasSubstr("900"));
  EXPECT_THAT(Complaint(R"({"tools": [{"tool": 1, "verdict": "good", "dx_mm": 0, "dy_mm": 0},
                                      {"tool": 1, "verdict": "good", "dx_mm": 0, "dy_mm": 0}]})"),
              HasSubstr("twice"));
  EXPECT_THAT(Complaint(R"({"tools": [{"tool": 1, "verdict": "fine"}]})"), HasSubstr("fine"));
  EXPECT_THAT(Complaint("{\"tools\": ["), HasSubstr("JSON"));
}

}  // namespace
}  // namespace trammel::files
