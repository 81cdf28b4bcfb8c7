#include "app/verdict_colour.h"

#include <gtest/gtest.h>

namespace trammel::app {
namespace {

TEST(VerdictColour, IsThatOfTheWordAloneAndOfNothingElse) {
  EXPECT_EQ(WithColouredVerdicts("a\nverdict    good\nb\n", true),
            "a\nverdict    \x1b[32mgood\x1b[0m\nb\n");
  EXPECT_EQ(WithColouredVerdicts("verdict  cannot tell", true),
            "verdict  \x1b[33mcannot tell\x1b[0m");
  EXPECT_EQ(WithColouredVerdicts("verdict   refused: it is torn\n", true),
            "verdict   \x1b[31mrefused\x1b[0m: it is torn\n");
  EXPECT_EQ(WithColouredVerdicts("  acceleration    cannot tell: too few lines\n", true),
            "  acceleration    \x1b[33mcannot tell\x1b[0m: too few lines\n");
  EXPECT_EQ(WithColouredVerdicts("12:30  refused   good  tap.json\n", true),
            "12:30  \x1b[31mrefused\x1b[0m   good  tap.json\n");
  for (const char* plain : {"", "\n", "verdict", "verdict ", "verdict \n", "verdict  goods\n",
                            "\"verdict\": \"good\"\n", "verdict  good enough\n", "verdictgood\n",
                            "notice  good enough\n", "  it was refused: torn\n", "  goods  \n"}) {
    EXPECT_EQ(WithColouredVerdicts(plain, true), plain);
  }
  EXPECT_EQ(WithColouredVerdicts("verdict  good\nverdict  good\n", false),
            "verdict  good\nverdict  \x1b[32mgood\x1b[0m\n");
}

}  // namespace
}  // namespace trammel::app
