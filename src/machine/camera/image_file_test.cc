#include "machine/camera/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "machine/camera/camera.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Left half blue, right half red.
cv::Mat TwoColours(int width, int height) {
  cv::Mat image(height, width, CV_8UC3, cv::Scalar(200, 0, 0));
  image.colRange(width / 2, width).setTo(cv::Scalar(0, 0, 200));
  return image;
}

Bytes Encode(const cv::Mat& image, const std::string& extension) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes));
  return bytes;
}

// An EXIF block that states nothing but an orientation, put behind the start of a JPEG.
Bytes WithOrientation(Bytes jpeg, std::uint8_t orientation) {
  const Bytes exif = {0xFF, 0xE1, 0, 34, 'E', 'x',         'i', 'f', 0, 0,    'M', 'M',
                      0,    42,   0, 0,  0,   8,           0,   1,   1, 0x12, 0,   3,
                      0,    0,    0, 1,  0,   orientation, 0,   0,   0, 0,    0,   0};
  jpeg.insert(jpeg.begin() + 2, exif.begin(), exif.end());
  return jpeg;
}

Bytes HugePngHeader(std::uint32_t width, std::uint32_t height) {
  Bytes bytes = {0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A, 0, 0, 0, 13, 'I', 'H', 'D', 'R'};
  for (const std::uint32_t value : {width, height}) {
    for (const int shift : {24, 16, 8, 0}) {
      bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    }
  }
  bytes.insert(bytes.end(), {8, 2, 0, 0, 0, 0, 0, 0, 0});
  return bytes;
}

/// Decodes a picture upright, by EXIF.
Result<Frame> DecodeTurned(std::span<const std::uint8_t> bytes) {
  ImageReadOptions options;
  options.turn_by_exif = true;
  return DecodeImage(bytes, options);
}

cv::Mat PixelsOf(const Frame& frame) {
  return {frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.bgr.data())};
}

TEST(ImageFile, ShowsEveryOrientationAsOpenCvDoes) {
  cv::Mat corners(24, 40, CV_8UC3, cv::Scalar(90, 90, 90));
  corners(cv::Rect(0, 0, 16, 8)).setTo(cv::Scalar(200, 0, 0));
  corners(cv::Rect(24, 0, 16, 8)).setTo(cv::Scalar(0, 0, 200));
  for (std::uint8_t orientation = 0; orientation <= 9; ++orientation) {
    const Bytes jpeg = WithOrientation(Encode(corners, ".jpg"), orientation);
    const auto frame = Must(DecodeTurned(jpeg));
    const cv::Mat expected = cv::imdecode(jpeg, cv::IMREAD_COLOR);
    ASSERT_EQ(frame.width, expected.cols) << int{orientation};
    ASSERT_EQ(frame.height, expected.rows) << int{orientation};
    constexpr double kMaxLevels = 2;  // between two orders of the same transform
    EXPECT_LE(cv::norm(PixelsOf(frame), expected, cv::NORM_INF), kMaxLevels) << int{orientation};
  }
}

TEST(ImageFile, MeasuredPicturesAreTheSensorsPixelsWhateverExifSays) {
  cv::Mat noise(24, 40, CV_8UC3);
  cv::theRNG().state = 7;
  cv::randu(noise, 0, 256);
  const Bytes stored = Encode(noise, ".jpg");
  const auto plain = Must(DecodeImage(stored));
  for (std::uint8_t orientation = 1; orientation <= 8; ++orientation) {
    CapturedFrame captured;
    captured.image = WithOrientation(stored, orientation);
    const auto frame = Must(DecodeFrame(captured));
    ASSERT_EQ(frame.width, plain.width) << int{orientation};
    EXPECT_EQ(frame.bgr, plain.bgr) << int{orientation};
  }
}

TEST(ImageFile, ReducesAPngExactlyAsOpenCvDoes) {
  cv::Mat noise(53, 81, CV_8UC3);
  cv::theRNG().state = 5;
  cv::randu(noise, 0, 256);
  const Bytes png = Encode(noise, ".png");
  for (const auto& [enough, mode] : {std::pair{std::int64_t{2000}, cv::IMREAD_REDUCED_COLOR_2},
                                     std::pair{std::int64_t{500}, cv::IMREAD_REDUCED_COLOR_4},
                                     std::pair{std::int64_t{100}, cv::IMREAD_REDUCED_COLOR_8}}) {
    ImageReadOptions options;
    options.reduce_above_px = enough;
    const auto frame = Must(DecodeImage(png, options));
    const cv::Mat expected = cv::imdecode(png, mode);
    ASSERT_EQ(PixelsOf(frame).size(), expected.size());
    EXPECT_EQ(cv::norm(PixelsOf(frame), expected, cv::NORM_INF), 0) << enough;
  }
}

TEST(ImageFile, RefusesTooManyPixelsBeforeDecoding) {
  EXPECT_THAT(DecodeImage(HugePngHeader(60'000, 60'000)),
              FailsWith("60000 x 60000 px = 3600 megapixels", "200"));
}

TEST(ImageFile, RefusesAJpegOfThousandsOfScansBeforeDecoding) {
  Bytes jpeg;
  ASSERT_TRUE(cv::imencode(".jpg", TwoColours(80, 40), jpeg, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}));
  ASSERT_TRUE(DecodeImage(jpeg));
  const std::string whole(jpeg.begin(), jpeg.end());
  const std::string scan = whole.substr(whole.rfind("\xFF\xDA"));
  std::string many = whole.substr(0, whole.size() - 2);
  for (int i = 0; i < 5000; ++i) many += scan.substr(0, scan.size() - 2);
  many += "\xFF\xD9";
  EXPECT_THAT(DecodeImage(Bytes(many.begin(), many.end())),
              FailsWith("scans, and at most 100 are read"));
}

TEST(ImageFile, RefusesMorePixelsThanItsBytesCanHold) {
  Bytes jpeg = Encode(TwoColours(80, 40), ".jpg");
  const std::array<std::uint8_t, 2> frame = {0xFF, 0xC0};
  const auto at = std::search(jpeg.begin(), jpeg.end(), frame.begin(), frame.end());
  ASSERT_NE(at, jpeg.end());
  std::fill_n(at + 5, 4, std::uint8_t{0x30});  // 12336 x 12336
  for (const Bytes& bytes : {jpeg, HugePngHeader(12336, 12336)}) {
    Bytes ended = bytes;
    const Bytes end = {'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};
    ended.insert(ended.end(), 4, 0);
    ended.insert(ended.end(), end.begin(), end.end());
    EXPECT_THAT(DecodeImage(ended), FailsWith("bytes can hold"));
  }
}

TEST(ImageFile, LeavesTextsInAPngPacked) {
  Bytes png = Encode(TwoColours(80, 40), ".png");
  // A text whose check sum is wrong: a decoder that looked at it would refuse the picture or warn.
  const Bytes text = {0, 0, 0, 4, 'z', 'T', 'X', 't', 'a', 0, 0, 'b', 1, 2, 3, 4};
  png.insert(png.begin() + 33, text.begin(), text.end());
  testing::internal::CaptureStderr();
  EXPECT_TRUE(DecodeImage(png));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ImageFile, ErrorsNameTheFormatThatAFileHas) {
  const std::vector<std::pair<std::string, std::string>> starts = {
      {"BM12", "a BMP"},
      {"GIF89a", "a GIF"},
      {std::string("RIFF\1\0\0\0WEBPVP8 ", 16), "a WebP"},
      {std::string("II*\0\x08", 5), "a TIFF or raw picture"},
      {std::string("\0\0\0\x1c"
                   "ftypheic",
                   12),
       "a HEIC"},
      {std::string("\0\0\0\x1c"
                   "ftypavif",
                   12),
       "an AVIF"},
      {"%PDF-1.4", "a PDF"}};
  for (const auto& [start, name] : starts) {
    const Bytes bytes(start.begin(), start.end());
    EXPECT_EQ(DecodeImage(bytes).error().message,
              "it is " + name + ", neither a JPEG nor a PNG; convert it to one of these");
    for (std::size_t size = 1; size < bytes.size(); ++size) {
      EXPECT_FALSE(DecodeImage(std::span(bytes).first(size)));
    }
  }
}

}  // namespace
}  // namespace trammel::machine
