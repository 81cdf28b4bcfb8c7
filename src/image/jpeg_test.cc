#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

// After cstdio: it wants FILE declared before it.
#include <jpeglib.h>

#include "base/random.h"
#include "image/jpeg_reader.h"
#include "image/jpeg_writer.h"

namespace trammel::image {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

// Of two decoders that compute the same transform, one of them in another order.
constexpr double kMostLevels = 2;

// Slopes, an edge and some noise.
cv::Mat Scene(int width, int height, int channels) {
  Random random(3);
  cv::Mat image(height, width, CV_8UC(channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        const double slope = 40 + 150.0 * (c == 1 ? x : y) / (c == 1 ? width : height);
        const double edge = x > width / 3 + c ? 30 : 0;
        image.ptr(y)[channels * x + c] =
            cv::saturate_cast<std::uint8_t>(slope + edge + 4 * random.Normal());
      }
    }
  }
  return image;
}

Bytes Encode(const cv::Mat& image, const std::vector<int>& how = {}) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(".jpg", image, bytes, how));
  return bytes;
}

struct InkFile {
  J_COLOR_SPACE stored = JCS_CMYK;
  bool adobe = true;
};

// Four components, which OpenCV does not write.
Bytes EncodeInks(const cv::Mat& cmyk, const InkFile& kind) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(cmyk.cols);
  jpeg.image_height = static_cast<JDIMENSION>(cmyk.rows);
  jpeg.input_components = cmyk.channels();
  jpeg.in_color_space = cmyk.channels() == 4 ? JCS_CMYK : JCS_UNKNOWN;
  jpeg_set_defaults(&jpeg);
  jpeg_set_colorspace(&jpeg, kind.stored);
  jpeg_set_quality(&jpeg, 98, TRUE);
  jpeg.write_Adobe_marker = kind.adobe ? TRUE : FALSE;
  jpeg_start_compress(&jpeg, TRUE);
  for (int y = 0; y < cmyk.rows; ++y) {
    auto* row = const_cast<JSAMPROW>(cmyk.ptr(y));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  Bytes written(bytes, bytes + size);
  std::free(bytes);
  return written;
}

// What the reader makes of it, or its error as a one-pixel picture's failure.
Result<cv::Mat> Decode(const Bytes& bytes, JpegPixels pixels = JpegPixels::kBgr, int reduction = 1,
                       JpegDamage damage = JpegDamage::kRefuse) {
  auto reader = TRY(JpegReader::Open(bytes, damage));
  TRY(reader.Start(pixels, reduction));
  cv::Mat image(reader.rows(), reader.row_px(), pixels == JpegPixels::kBgr ? CV_8UC3 : CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    TRY(reader.ReadRow(image.ptr(y)));
  }
  return image;
}

void ExpectNear(const Result<cv::Mat>& image, const cv::Mat& expected, const std::string& what) {
  ASSERT_TRUE(image) << what << ": " << image.error().message;
  ASSERT_EQ(image->size(), expected.size()) << what;
  ASSERT_EQ(image->type(), expected.type()) << what;
  EXPECT_LE(cv::norm(*image, expected, cv::NORM_INF), kMostLevels) << what;
}

TEST(JpegReader, DecodesAsOpenCvDoes) {
  for (const int channels : {1, 3}) {
    for (const int progressive : {0, 1}) {
      for (const int quality : {40, 95}) {
        for (const cv::Size size : {cv::Size(1, 1), cv::Size(67, 33), cv::Size(160, 120)}) {
          const Bytes bytes = Encode(
              Scene(size.width, size.height, channels),
              {cv::IMWRITE_JPEG_PROGRESSIVE, progressive, cv::IMWRITE_JPEG_QUALITY, quality});
          const std::string what = testing::PrintToString(size) + " of " +
                                   std::to_string(channels) + " at " + std::to_string(quality);
          ExpectNear(Decode(bytes), cv::imdecode(bytes, cv::IMREAD_COLOR), what);
          ExpectNear(Decode(bytes, JpegPixels::kGrey), cv::imdecode(bytes, cv::IMREAD_GRAYSCALE),
                     what + " as grey");
        }
      }
    }
  }
}

TEST(JpegReader, ReducesAsOpenCvDoes) {
  const Bytes bytes = Encode(Scene(161, 119, 3));
  ExpectNear(Decode(bytes, JpegPixels::kBgr, 2), cv::imdecode(bytes, cv::IMREAD_REDUCED_COLOR_2),
             "1/2");
  ExpectNear(Decode(bytes, JpegPixels::kBgr, 4), cv::imdecode(bytes, cv::IMREAD_REDUCED_COLOR_4),
             "1/4");
  ExpectNear(Decode(bytes, JpegPixels::kBgr, 8), cv::imdecode(bytes, cv::IMREAD_REDUCED_COLOR_8),
             "1/8");
}

TEST(JpegReader, PrintsFourInksOnWhite) {
  const cv::Mat inks = Scene(48, 32, 4);
  for (const J_COLOR_SPACE stored : {JCS_CMYK, JCS_YCCK}) {
    const Bytes adobe = EncodeInks(inks, {stored, true});
    ExpectNear(Decode(adobe), cv::imdecode(adobe, cv::IMREAD_COLOR), "Adobe's");
  }
  // Without Adobe's marker 0 is no ink: paper is white, and black ink alone black.
  cv::Mat plain(16, 32, CV_8UC4, cv::Scalar(0, 0, 0, 0));
  plain.colRange(16, 32).setTo(cv::Scalar(0, 0, 0, 255));
  const auto printed = Decode(EncodeInks(plain, {JCS_CMYK, false}));
  ASSERT_TRUE(printed) << printed.error().message;
  EXPECT_GE(printed->ptr(8)[3 * 4], 255 - kMostLevels);
  EXPECT_LE(printed->ptr(8)[3 * 28], kMostLevels);
}

TEST(JpegReader, NamesColoursThatItCannotShow) {
  const auto two = Decode(EncodeInks(Scene(16, 16, 2), {JCS_UNKNOWN, false}));
  ASSERT_FALSE(two);
  EXPECT_THAT(two.error().message, HasSubstr("2 colours; save it as grey or RGB"));
}

// Frames of cameras leave out the tables that the format's standard has.
TEST(JpegReader, TakesTheStandardsTablesWhereAFrameHasNone) {
  const Bytes whole = Encode(Scene(64, 48, 3));
  Bytes bare(whole.begin(), whole.begin() + 2);
  std::size_t at = 2;
  while (whole[at + 1] != 0xDA) {
    const std::size_t size = 2 + whole[at + 2] * 256U + whole[at + 3];
    const auto segment = whole.begin() + static_cast<std::ptrdiff_t>(at);
    if (whole[at + 1] != 0xC4) {
      bare.insert(bare.end(), segment, segment + static_cast<std::ptrdiff_t>(size));
    }
    at += size;
  }
  bare.insert(bare.end(), whole.begin() + static_cast<std::ptrdiff_t>(at), whole.end());
  ASSERT_LT(bare.size(), whole.size());
  ExpectNear(Decode(bare), cv::imdecode(whole, cv::IMREAD_COLOR), "bare");
}

TEST(JpegReader, RefusesDamageOrFillsItInAsAskedFor) {
  Bytes bytes = Encode(Scene(64, 48, 3));
  const std::size_t middle = bytes.size() - 300;
  bytes[middle] = 0xFF;  // the end of the image, early
  bytes[middle + 1] = 0xD9;
  const auto refused = Decode(bytes);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("the decoder rejects it (Corrupt JPEG data"));
  const auto filled = Decode(bytes, JpegPixels::kBgr, 1, JpegDamage::kFillIn);
  ASSERT_TRUE(filled);
  EXPECT_EQ(filled->rows, 48);
}

TEST(JpegReader, PassesOverWhatCamerasLeaveBeforeTheEnd) {
  Bytes bytes = Encode(Scene(64, 48, 3));
  const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_COLOR);
  bytes.insert(bytes.end() - 2, {0x12, 0x34});
  ExpectNear(Decode(bytes), expected, "two bytes more");
}

TEST(JpegReader, RefusesWhatIsNoJpeg) {
  EXPECT_FALSE(Decode({}));
  EXPECT_FALSE(Decode({0xFF, 0xD8, 0xFF}));
  EXPECT_FALSE(Decode({'G', 'I', 'F', '8'}));
}

TEST(JpegWriter, EncodesAsOpenCvDoes) {
  for (const int channels : {1, 3}) {
    for (const int quality : {1, 60, 95, 100}) {
      const cv::Mat scene = Scene(67, 33, channels);
      Bytes bytes;
      ASSERT_TRUE(EncodeJpeg({scene.data, 67, 33, channels, std::ptrdiff_t{channels} * 67},
                             {.quality = quality, .dpi = {}}, bytes));
      const Bytes theirs = Encode(scene, {cv::IMWRITE_JPEG_QUALITY, quality});
      EXPECT_EQ(cv::norm(cv::imdecode(bytes, cv::IMREAD_UNCHANGED),
                         cv::imdecode(theirs, cv::IMREAD_UNCHANGED), cv::NORM_INF),
                0)
          << channels << " at " << quality;
    }
  }
}

TEST(JpegWriter, LeavesOutWhatLiesBetweenRows) {
  const cv::Mat scene = Scene(60, 40, 3);
  const cv::Mat part = scene(cv::Rect(8, 8, 32, 16));
  Bytes from_part;
  Bytes from_copy;
  ASSERT_TRUE(
      EncodeJpeg({part.data, 32, 16, 3, static_cast<std::ptrdiff_t>(part.step)}, {}, from_part));
  const cv::Mat copy = part.clone();
  ASSERT_TRUE(EncodeJpeg({copy.data, 32, 16, 3, 96}, {}, from_copy));
  EXPECT_EQ(from_part, from_copy);
}

TEST(JpegWriter, StatesTheResolutionThatItIsTold) {
  const Bytes grey(64, 100);
  Bytes bytes;
  ASSERT_TRUE(EncodeJpeg({grey.data(), 8, 8, 1, 8}, {.dpi = 600}, bytes));
  auto reader = JpegReader::Open(bytes, JpegDamage::kRefuse);
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->header().dpi_x, 600);
  EXPECT_EQ(reader->header().dpi_y, 600);
  ASSERT_TRUE(EncodeJpeg({grey.data(), 8, 8, 1, 8}, {}, bytes));
  reader = JpegReader::Open(bytes, JpegDamage::kRefuse);
  ASSERT_TRUE(reader);
  EXPECT_FALSE(reader->header().dpi_x);
}

TEST(JpegWriter, WritesTheSamePixelsInFewerBytesWithTheirOwnTables) {
  const cv::Mat scene = Scene(160, 120, 3);
  const PageView pixels{scene.data, 160, 120, 3, static_cast<std::ptrdiff_t>(scene.step)};
  Bytes usual;
  Bytes own;
  ASSERT_TRUE(EncodeJpeg(pixels, {}, usual));
  ASSERT_TRUE(EncodeJpeg(pixels, {.dpi = {}, .own_tables = true}, own));
  EXPECT_LT(own.size(), usual.size());
  const cv::Mat first = cv::imdecode(usual, cv::IMREAD_COLOR);
  const cv::Mat second = cv::imdecode(own, cv::IMREAD_COLOR);
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(cv::norm(first, second, cv::NORM_INF), 0);
}

TEST(JpegWriter, NamesSizesThatAJpegCannotHave) {
  const Bytes row(65501, 0);
  Bytes bytes;
  EXPECT_TRUE(EncodeJpeg({row.data(), 65500, 1, 1, 65500}, {}, bytes));
  const auto wide = EncodeJpeg({row.data(), 65501, 1, 1, 65501}, {}, bytes);
  ASSERT_FALSE(wide);
  EXPECT_THAT(wide.error().message, HasSubstr("65501 x 1 px"));
  EXPECT_FALSE(EncodeJpeg({row.data(), 0, 1, 1, 0}, {}, bytes));
}

}  // namespace
}  // namespace trammel::image
