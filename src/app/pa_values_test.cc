#include "app/pa_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace trammel::app {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(PaValues, ReadsListsStepsAndCounts) {
  EXPECT_THAT(*ParsePressureAdvances("0,0.01, 0.5"), ElementsAre(0, 0.01, 0.5));
  EXPECT_THAT(*ParsePressureAdvances("0.04"), ElementsAre(0.04));
  EXPECT_THAT(*ParsePressureAdvances("0:0.06:0.02"), ElementsAre(0, 0.02, 0.04, 0.06));
  EXPECT_THAT(*ParsePressureAdvances("0:0.06:4"), ElementsAre(0, 0.02, 0.04, 0.06));
  EXPECT_THAT(*ParsePressureAdvances("0:1:1"), ElementsAre(0, 1));
  EXPECT_EQ(ParsePressureAdvances("0:0.1:0.005")->size(), 21u);
  EXPECT_EQ(ParsePressureAdvances("0:0.06:10")->size(), 10u);
}

TEST(PaValues, NamesWhatIsWrong) {
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

}  // namespace
}  // namespace trammel::app
