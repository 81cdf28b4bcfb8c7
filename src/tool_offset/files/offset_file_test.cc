#include "tool_offset/files/offset_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "measurement/outcome_file.h"
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
    const auto read = ReadOffsetFile(path);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->good.size(), 1u);
    EXPECT_EQ(read->good[0].tool, 1);
    EXPECT_EQ(read->good[0].dx_mm, 0.1);
    EXPECT_EQ(read->good[0].dy95_mm.lo, -0.202);
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

}  // namespace
}  // namespace trammel::files
