#include "tool_offset/files/offset_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

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
