#include "pressure_advance/files/print_footprint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;

constexpr gcode::PlateArea kPlate{0, 0, 250, 250};
constexpr double kLow_mm = 1.25;

class PrintFootprint : public testing::Test {
 protected:
  Result<gcode::Footprint> Read(const std::string& text) {
    std::ofstream(folder_.path() / "part.gcode", std::ios::binary) << text;
    return ReadFootprint(folder_.path() / "part.gcode", kPlate, kLow_mm);
  }

  std::string WhyNot(const std::string& text) {
    const auto print = Read(text);
    return print ? "read" : print.error().message;
  }

  test::TemporaryFolder folder_;
};

TEST_F(PrintFootprint, IsThatOfAllLinesHoweverTheyEndAndHoweverLongTheFile) {
  const std::string head = "; thumbnail " + std::string(3 << 20, 'x') + "\r\nM83\r\nG1 Z5\r\n";
  const auto print =
      Read(head + "G1 X20 Y30\r\nG1 X60 Y30 E1 ; " + std::string(90000, 'y') + "\r\nG1 X60 Y90 E1");
  ASSERT_TRUE(print) << print.error().message;
  EXPECT_FALSE(print->Clear({59, 85, 61, 95}));
  EXPECT_TRUE(print->Clear({0, 0, 250, 29}));
}

TEST_F(PrintFootprint, RefusesWhatIsNoPrintByItsName) {
  EXPECT_THAT(WhyNot(""), HasSubstr("part.gcode: prints nothing on the plate"));
  EXPECT_THAT(WhyNot("M83\nG1 X5 Y5\nG20\n"), HasSubstr("part.gcode: line 3: G20"));
  EXPECT_THAT(WhyNot("GCDE\1"), HasSubstr("part.gcode: is binary G-code, which is not read"));
  EXPECT_THAT(
      WhyNot("PK\3\4xxxx"),
      HasSubstr("part.gcode: is a ZIP archive (a 3MF is one), which is not read: export the "
                "print as plain G-code"));
  EXPECT_THAT(WhyNot("\x1f\x8b\x08"), HasSubstr("is a gzip archive"));
  EXPECT_THAT(WhyNot("<html>"), HasSubstr("is a web page"));
  EXPECT_THAT(WhyNot(std::string("G1 X5\0", 6)), HasSubstr("bytes that no text has"));
  EXPECT_THAT(WhyNot("G28\n" + std::string(70000, 'G')),
              HasSubstr("line 2 has more than 65536 characters"));
  const auto folder = ReadFootprint(folder_.path(), kPlate, kLow_mm);
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr("is no regular file"));
  const auto missing = ReadFootprint(folder_.path() / "none.gcode", kPlate, kLow_mm);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("none.gcode: there is no such file"));
}

}  // namespace
}  // namespace trammel::files
