#include "pressure_advance/commands/pattern_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace trammel::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(PressureAdvances, ReadsListsStepsAndCounts) {
  EXPECT_THAT(*ParsePressureAdvances("0,0.01, 0.5"), ElementsAre(0, 0.01, 0.5));
  EXPECT_THAT(*ParsePressureAdvances("0.04"), ElementsAre(0.04));
  EXPECT_THAT(*ParsePressureAdvances("0:0.06:0.02"), ElementsAre(0, 0.02, 0.04, 0.06));
  EXPECT_THAT(*ParsePressureAdvances("0:0.06:4"), ElementsAre(0, 0.02, 0.04, 0.06));
  EXPECT_THAT(*ParsePressureAdvances("0:1:1"), ElementsAre(0, 1));
  EXPECT_EQ(ParsePressureAdvances("0:0.1:0.005")->size(), 21u);
  EXPECT_EQ(ParsePressureAdvances("0:0.06:10")->size(), 10u);
}

TEST(PressureAdvances, NamesWhatIsWrong) {
  struct Mistake {
    const char* text;
    const char* says;
  };
  for (const Mistake& mistake : {
           Mistake{"", "\"\" is not a number"},
           Mistake{"0,,1", "\"\" is not a number"},
           Mistake{"abc", "\"abc\" is not a number"},
           Mistake{"0x1", "\"0x1\" is not a number"},
           Mistake{"0,inf", "\"inf\" is not a number"},
           Mistake{"0:1", "START:END:STEP"},
           Mistake{"0:1:2:3", "START:END:STEP"},
           Mistake{"0.1:0:0.01", "the end 0 is not above the start 0.1"},
           Mistake{"0:0.1:-0.01", "must be above 0"},
           Mistake{"0:0.1:0", "must be above 0"},
           Mistake{"0:0.1:0.03", "neither divides the range 0.1 nor is a count"},
           Mistake{"0:0.1:2.5", "neither divides"},
           Mistake{"0:0.1:1e-9", "more than 1000"},
           Mistake{"0:0.1:1e300", "more than 1000"},
           Mistake{"-0.1,0.1", "-0.1 s is outside 0 ... 10 s"},
           Mistake{"0:20:5", "15 s is outside"},
       }) {
    const auto values = ParsePressureAdvances(mistake.text);
    ASSERT_FALSE(values) << mistake.text;
    EXPECT_THAT(values.error().message, HasSubstr(mistake.says)) << mistake.text;
  }
  EXPECT_FALSE(ParsePressureAdvances(std::string(100000, ',')));
}

TEST(Segments, ReadsFractionsAndSpeedsInTheirOrder) {
  const auto segments = ParseSegments("0.1:10,0.6:100,0.3:12.5");
  ASSERT_TRUE(segments) << segments.error().message;
  ASSERT_EQ(segments->size(), 3u);
  EXPECT_EQ((*segments)[0].fraction, 0.1);
  EXPECT_EQ((*segments)[1].fraction, 0.6);
  EXPECT_EQ((*segments)[1].speed_mm_s, 100);
  EXPECT_EQ((*segments)[2].speed_mm_s, 12.5);
}

TEST(Segments, LetsThirdsOfThreeDigitsSumToOne) {
  EXPECT_TRUE(ParseSegments("0.333:10,0.333:100,0.333:10"));
  EXPECT_TRUE(ParseSegments("0.5:0.1,0.5:2000"));
}

TEST(Segments, NamesThePartAndTheBound) {
  struct Mistake {
    const char* text;
    const char* says;
  };
  for (const Mistake& mistake : {
           Mistake{"", "'' is not FRACTION:SPEED"},
           Mistake{"0.5:10,", "'' is not FRACTION:SPEED"},
           Mistake{"0.5", "'0.5' is not FRACTION:SPEED"},
           Mistake{"0.5:10:3,0.5:10", "'0.5:10:3' is not FRACTION:SPEED"},
           Mistake{"0.5:ten,0.5:10", "'0.5:ten'"},
           Mistake{"0.5:10mm,0.5:10", "'0.5:10mm'"},
           Mistake{"nan:10,0.5:10", "'nan:10'"},
           Mistake{"0.5:inf,0.5:10", "'0.5:inf'"},
           Mistake{"0:10,1:10", "'0:10'"},
           Mistake{"1:10", "a fraction between 0 and 1"},
           Mistake{"-0.5:10,0.5:10", "'-0.5:10'"},
           Mistake{"0.5:0.05,0.5:10", "a speed of 0.1 to 2000 mm/s"},
           Mistake{"0.5:2001,0.5:10", "'0.5:2001'"},
           Mistake{"0.5:10,0.49:10", "sum to 0.99; they must sum to 1"},
           Mistake{"0.5:10,0.5:10,0.5:10", "sum to 1.5"},
       }) {
    const auto segments = ParseSegments(mistake.text);
    ASSERT_FALSE(segments) << mistake.text;
    EXPECT_THAT(segments.error().message, HasSubstr("--segments")) << mistake.text;
    EXPECT_THAT(segments.error().message, HasSubstr(mistake.says)) << mistake.text;
  }
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "0.001:10,";
  EXPECT_FALSE(ParseSegments(many + "0.001:10"));
}

}  // namespace
}  // namespace trammel::app
