#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string>

#include "sim/scanner/scanner_page.h"
#include "support/temporary_folder.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kSeed = 31;  // development

class ScannerFile : public ::testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }

  // A line of red ink on white paper.
  static SheetScan Scan(bool colour, int bits) {
    PrintedSheet sheet;
    sheet.paper = {0.8, 0.8, 0.8};
    sheet.inks[0] = {0.6, 0.05, 0.05};
    sheet.strokes = {{0, 1, true, {0, 1}, {{{0, 0}, 0.2, 0.2}, {{0, 6}, 0.2, 0.2}}}};
    ScannerTraits traits;
    traits.colour = colour;
    traits.bits = bits;
    traits.noise = 0.01;
    return std::move(*SheetScan::Lay(sheet, traits));
  }
  std::string Bytes(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void Write(const std::string& name, const SheetScan& scan, const PageFileOptions& options) const {
    std::filesystem::remove(path(name));  // the scan before it: nothing is overwritten
    const auto written = WriteScan(scan, Random(kSeed), options, path(name));
    EXPECT_TRUE(written) << (written ? "" : written.error().message);
  }
  cv::Mat Read(const std::string& name) const {
    return cv::imread(path(name).string(), cv::IMREAD_UNCHANGED);
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(ScannerFile, PngHasTheScansPixelsInEveryForm) {
  for (const bool colour : {false, true}) {
    for (const int bits : {8, 16}) {
      const SheetScan scan = Scan(colour, bits);
      Write("a.png", scan, {600, 90});
      const cv::Mat png = Read("a.png");
      ASSERT_EQ(png.rows, scan.format().height_px);
      ASSERT_EQ(png.channels(), scan.format().channels);
      ASSERT_EQ(png.depth(), bits == 8 ? CV_8U : CV_16U);
      int y = 0;
      const auto compared = scan.Render(Random(kSeed), [&](std::span<const std::uint8_t> row) {
        cv::Mat line;
        const cv::Mat rendered(1, png.cols, png.type(), const_cast<std::uint8_t*>(row.data()));
        colour ? cv::cvtColor(rendered, line, cv::COLOR_RGB2BGR) : rendered.copyTo(line);
        EXPECT_EQ(cv::norm(png.row(y), line, cv::NORM_INF), 0) << y;
        ++y;
        return Result<void>();
      });
      EXPECT_TRUE(compared);
      EXPECT_EQ(y, png.rows);
    }
  }
}

TEST_F(ScannerFile, RedInkIsRed) {
  Write("red.png", Scan(true, 8), {600, 90});
  const cv::Mat image = Read("red.png");
  const auto* middle = image.ptr(image.rows / 2) + 3 * (image.cols / 2);
  EXPECT_GT(middle[2], middle[0] + 50);
}

TEST_F(ScannerFile, PngSaysItsResolutionOnlyWhenTold) {
  Write("with.png", Scan(false, 8), {600, 90});
  const std::string with = Bytes("with.png");
  const std::size_t at = with.find("pHYs");
  ASSERT_NE(at, std::string::npos);
  // 600 dpi are 23622 pixels per metre.
  EXPECT_EQ(
      static_cast<unsigned char>(with[at + 6]) * 256 + static_cast<unsigned char>(with[at + 7]),
      23622);
  EXPECT_EQ(with[at + 12], 1);
  Write("without.png", Scan(false, 8), {});
  EXPECT_EQ(Bytes("without.png").find("pHYs"), std::string::npos);
}

TEST_F(ScannerFile, JpegSaysItsResolutionAndIsWorseAtLowQuality) {
  Write("good.jpg", Scan(true, 8), {600, 95});
  Write("bad.jpg", Scan(true, 8), {std::nullopt, 20});
  const std::string good = Bytes("good.jpg");
  EXPECT_EQ(good[13], 1);
  EXPECT_EQ(static_cast<unsigned char>(good[14]) * 256 + static_cast<unsigned char>(good[15]), 600);
  EXPECT_EQ(Bytes("bad.jpg")[13], 0);
  EXPECT_LT(Bytes("bad.jpg").size(), good.size() / 2);
  EXPECT_FALSE(Read("bad.jpg").empty());
}

TEST_F(ScannerFile, RefusesWhatItCannotWrite) {
  const auto error_of = [this](const std::string& name, int bits, const PageFileOptions& options) {
    const auto written = WriteScan(Scan(false, bits), Random(kSeed), options, path(name));
    return written ? std::string("no error") : written.error().message;
  };
  EXPECT_THAT(error_of("a.bmp", 8, {}), HasSubstr(".bmp"));
  EXPECT_THAT(error_of("a.jpg", 16, {}), HasSubstr("8 bits"));
  EXPECT_THAT(error_of("a.jpg", 8, {600, 0}), HasSubstr("quality is 0"));
  EXPECT_THAT(error_of("a.png", 8, {-5, 90}), HasSubstr("-5 dpi"));
  EXPECT_THAT(error_of("no/such/folder.png", 8, {}), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace trammel::sim
