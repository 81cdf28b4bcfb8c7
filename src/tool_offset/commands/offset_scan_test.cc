// trammel offset scan against SANE's backends that need no scanner, under a configuration of the
// test's own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "machine/page/page_file.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel::test {
namespace {

using ::testing::HasSubstr;

class OffsetScan : public testing::Test {
 protected:
  OffsetScan() {
    std::filesystem::create_directory(config());
    WriteWhole(config() / "dll.conf", "test\n");
    WriteWhole(config() / "test.conf", "number_of_devices 1\n");
    setenv("SANE_CONFIG_DIR", config().c_str(), 1);
  }
  ~OffsetScan() override { unsetenv("SANE_CONFIG_DIR"); }

  [[nodiscard]] std::filesystem::path config() const { return folder_.path() / "sane"; }
  [[nodiscard]] std::filesystem::path Path(const std::string& name) const {
    return folder_.path() / name;
  }
  [[nodiscard]] CommandResult Scan(const std::string& arguments) const {
    return RunTrammel("offset scan " + arguments, folder_.path());
  }
  // Scans with the given read status of the test backend.
  [[nodiscard]] CommandResult ScanWithStatus(const std::string& status) const {
    return Scan("--device test:0 -o a.png --option read-return-value=SANE_STATUS_" + status);
  }
  [[nodiscard]] Page Read(const std::string& name) const {
    auto pages = machine::ReadPages(Path(name));
    EXPECT_TRUE(pages) << pages.error().message;
    return pages ? std::move(pages->front()) : Page{};
  }

  TemporaryFolder folder_;
};

TEST_F(OffsetScan, ListsTheScannersAndRefusesToGuessBetweenThem) {
  WriteWhole(config() / "test.conf", "number_of_devices 2\n");
  EXPECT_THAT(Scan("--list"), Prints(0, "test:0", "virtual device", "test:1"));
  EXPECT_THAT(Scan("-o a.png"), Fails(1, "--device", "test:0"));
}

TEST_F(OffsetScan, TakesTheOnlyScannerThereIs) {
  EXPECT_EQ(Scan("-o a.png --dpi 100").exit_code, 0);
  WriteWhole(config() / "dll.conf", "");
  EXPECT_THAT(Scan("-o b.png"), Fails(3, "no scanner was found"));
}

TEST_F(OffsetScan, KeepsResolutionAndAreaInTheFile) {
  ASSERT_THAT(
      Scan("--device test:0 -o a.tiff --dpi 600 --area 10 10 50 20 --option test-picture=Grid"),
      Ends(0));
  const Page page = Read("a.tiff");
  constexpr double kInch_mm = 25.4;
  EXPECT_NEAR(page.width, 50 * 600 / kInch_mm, 2);
  EXPECT_NEAR(page.height, 20 * 600 / kInch_mm, 2);
  EXPECT_EQ(page.channels, 1);
  ASSERT_TRUE(page.dpi_x && page.dpi_y);
  EXPECT_NEAR(*page.dpi_x, 600, 0.01);
  EXPECT_NEAR(*page.dpi_y, 600, 0.01);
}

TEST_F(OffsetScan, ColoursComeInOnePassOrInThree) {
  const std::string pattern =
      " --device test:0 --color --dpi 75 --option test-picture='Color pattern'";
  ASSERT_EQ(Scan("-o one.png" + pattern).exit_code, 0);
  ASSERT_EQ(Scan("-o three.png --option three-pass=yes" + pattern).exit_code, 0);
  const Page one = Read("one.png");
  EXPECT_EQ(one.channels, 3);
  EXPECT_EQ(one.samples, Read("three.png").samples);
}

TEST_F(OffsetScan, AScannerThatDoesNotKnowItsLengthIsReadToTheEnd) {
  ASSERT_THAT(Scan("--device test:0 -o a.png --dpi 75 --option hand-scanner=yes"), Ends(0));
  EXPECT_GT(Read("a.png").height, 100);
}

TEST_F(OffsetScan, NamesWhatKeepsAScannerFromScanning) {
  struct Case {
    const char* status;
    const char* advice;
  };
  for (const Case& c : {Case{"JAMMED", "take the paper out"}, Case{"COVER_OPEN", "close it"},
                        Case{"DEVICE_BUSY", "another program"}, Case{"NO_DOCS", "on the glass"},
                        Case{"IO_ERROR", "cable"}, Case{"ACCESS_DENIED", "group 'scanner'"}}) {
    SCOPED_TRACE(c.status);
    EXPECT_THAT(ScanWithStatus(c.status), Fails(3, c.advice));
    EXPECT_FALSE(std::filesystem::exists(Path("a.png")));
  }
}

TEST_F(OffsetScan, WhatTheScannerHasNotIsNamedWithWhatItHas) {
  EXPECT_THAT(Scan("--device test:0 -o a.png --dpi 2400").standard_error,
              Containing("no resolution of 2400", "1200"));
  EXPECT_THAT(Scan("--device test:0 -o a.png --option lamp=on").standard_error,
              HasSubstr("no option 'lamp'"));
  EXPECT_THAT(Scan("--device test:0 -o a.png --option mode=Sepia").standard_error,
              Containing("no mode 'Sepia'", "Gray, Color"));
  EXPECT_THAT(Scan("--device test:0 -o a.png --area 10 10 -5 5").standard_error,
              HasSubstr("is no area"));
  EXPECT_EQ(Scan("--device nowhere -o a.png").exit_code, 3);
  EXPECT_THAT(Scan("--device test:0 -o a.bmp --dpi 75").standard_error, HasSubstr(".png, .tif"));
  EXPECT_THAT(Scan("--device test:0 -o a.png --dpi 1200 --most-megapixels 1").standard_error,
              HasSubstr("1 megapixels"));
}

}  // namespace
}  // namespace trammel::test
