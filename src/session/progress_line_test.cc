#include "session/progress_line.h"

#include <gtest/gtest.h>

#include <string>

namespace trammel::procedure {
namespace {

TEST(ProgressLine, ComesBackAsItWasSaid) {
  const Progress said{.text = "scanning \"line\"\n2 \xC2\xB5m",
                      .remaining_s = 40.5,
                      .phase = "scanning",
                      .done = 0.25};
  const std::string line = ProgressLine(said);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto heard = ParseProgressLine(line);
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->text, said.text);
  EXPECT_EQ(heard->remaining_s, said.remaining_s);
  EXPECT_EQ(heard->phase, said.phase);
  EXPECT_EQ(heard->done, said.done);
}

TEST(ProgressLine, WhatIsNotKnownStaysUnknown) {
  const auto heard = ParseProgressLine(ProgressLine({"homing", {}}));
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->text, "homing");
  EXPECT_FALSE(heard->remaining_s || heard->done);
  EXPECT_EQ(heard->phase, "");
}

TEST(ProgressLine, OtherWordsAreNoProgress) {
  for (const char* line : {"", "trammel: no printer", "{", "{}", "[1]", R"({"progress":3})",
                           R"({"progress":"a","x":{"y":{"z":1}}})"}) {
    EXPECT_FALSE(ParseProgressLine(line)) << line;
  }
}

TEST(ProgressLine, FiguresAndTextsAreBounded) {
  const auto heard =
      ParseProgressLine(R"({"progress":")" + std::string(5000, 'a') +
                        R"(","remaining_s":-1,"done":7,"phase":")" + std::string(100, 'p') + "\"}");
  ASSERT_TRUE(heard);
  EXPECT_LE(heard->text.size(), 1024U);
  EXPECT_LE(heard->phase.size(), 32U);
  EXPECT_EQ(heard->remaining_s, 0);
  EXPECT_EQ(heard->done, 1);
}

}  // namespace
}  // namespace trammel::procedure
