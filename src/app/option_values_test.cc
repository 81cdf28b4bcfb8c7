#include "app/option_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace trammel::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(WholePair, ReadsTwoNumbersAndNothingElse) {
  ASSERT_TRUE(ParseWholePair("1280x720"));
  EXPECT_EQ(ParseWholePair("1280x720")->first, 1280);
  EXPECT_EQ(ParseWholePair("1280x720")->second, 720);
  for (const char* text : {"", "x", "9", "9x", "x3", "9x3x2", "9X3", "9.5x3", " 9x3", "9x3 ",
                           "99999999999x3", "axb"}) {
    EXPECT_FALSE(ParseWholePair(text)) << text;
  }
}

}  // namespace
}  // namespace trammel::app
