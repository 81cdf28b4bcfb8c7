#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "base/random.h"
#include "image/png_reader.h"
#include "image/png_writer.h"

namespace trammel::image {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

constexpr int kWidth = 37;
constexpr int kHeight = 21;

struct Kind {
  int color_type = PNG_COLOR_TYPE_RGB;
  int bits = 8;
  bool interlaced = false;
  bool transparent = false;  ///< a palette's entries, or one colour
  int orientation = 0;       ///< EXIF orientation; 0: none
  bool at_the_end = false;   ///< EXIF behind the pixels
};

std::string Name(const Kind& kind) {
  return "colour type " + std::to_string(kind.color_type) + ", " + std::to_string(kind.bits) +
         " bits" + (kind.interlaced ? ", interlaced" : "") +
         (kind.transparent ? ", transparent" : "");
}

void Take(png_structp png, png_bytep bytes, std::size_t count) {
  auto& taken = *static_cast<Bytes*>(png_get_io_ptr(png));
  taken.insert(taken.end(), bytes, bytes + count);
}

// Writes random samples as a PNG by libpng.
Bytes Write(const Kind& kind) {
  Random random(7);
  Bytes bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &bytes, Take, nullptr);
  png_set_IHDR(png, info, kWidth, kHeight, kind.bits, kind.color_type,
               kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (kind.color_type == PNG_COLOR_TYPE_PALETTE) {
    std::vector<png_color> palette(std::size_t{1} << kind.bits);
    for (png_color& color : palette) {
      color = {static_cast<png_byte>(random.Below(256)), static_cast<png_byte>(random.Below(256)),
               static_cast<png_byte>(random.Below(256))};
    }
    png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  }
  if (kind.transparent) {
    const std::array<png_byte, 2> alpha = {0, 128};
    const png_color_16 color{0, 1, 1, 1, 1};
    const bool palette = kind.color_type == PNG_COLOR_TYPE_PALETTE;
    png_set_tRNS(png, info, palette ? alpha.data() : nullptr, palette ? 2 : 0, &color);
  }
  std::array<png_byte, 26> exif = {'M', 'M', 0, 42, 0, 0, 0, 8, 0, 1, 1, 0x12, 0,
                                   3,   0,   0, 0,  1, 0, 0, 0, 0, 0, 0, 0,    0};
  exif[19] = static_cast<png_byte>(kind.orientation);
  if (kind.orientation != 0 && !kind.at_the_end) {
    png_set_eXIf_1(png, info, exif.size(), exif.data());
  }
  png_write_info(png, info);
  std::vector<Bytes> rows(kHeight, Bytes(png_get_rowbytes(png, info)));
  std::vector<png_bytep> starts;
  for (Bytes& row : rows) {
    for (std::uint8_t& byte : row) byte = static_cast<std::uint8_t>(random.Below(256));
    starts.push_back(row.data());
  }
  png_write_image(png, starts.data());
  if (kind.orientation != 0 && kind.at_the_end) {
    const std::array<png_byte, 5> name = {'e', 'X', 'I', 'f', 0};
    png_write_chunk(png, name.data(), exif.data(), exif.size());
  }
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

Result<cv::Mat> Decode(const Bytes& bytes) {
  auto reader = TRY(PngReader::Open(bytes, PngPixels::kBgr8));
  cv::Mat image(reader.header().height_px, reader.header().width_px, CV_8UC3);
  for (int pass = 0; pass < reader.passes(); ++pass) {
    for (int y = 0; y < image.rows; ++y) {
      TRY(reader.ReadRow(image.ptr(y)));
    }
  }
  TRY(reader.Finish());
  return image;
}

TEST(PngReader, DecodesEveryKindExactlyAsOpenCvDoes) {
  const std::vector<std::pair<int, std::vector<int>>> kinds = {
      {PNG_COLOR_TYPE_GRAY, {1, 2, 4, 8, 16}}, {PNG_COLOR_TYPE_RGB, {8, 16}},
      {PNG_COLOR_TYPE_PALETTE, {1, 2, 4, 8}},  {PNG_COLOR_TYPE_GRAY_ALPHA, {8, 16}},
      {PNG_COLOR_TYPE_RGB_ALPHA, {8, 16}},
  };
  for (const auto& [color_type, depths] : kinds) {
    for (const int bits : depths) {
      for (const bool interlaced : {false, true}) {
        for (const bool transparent : {false, true}) {
          if (transparent && (color_type & PNG_COLOR_MASK_ALPHA) != 0) continue;
          const Kind kind{color_type, bits, interlaced, transparent};
          const Bytes bytes = Write(kind);
          const auto image = Decode(bytes);
          ASSERT_TRUE(image) << Name(kind) << ": " << image.error().message;
          const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_COLOR);
          ASSERT_EQ(image->size(), expected.size()) << Name(kind);
          EXPECT_EQ(cv::norm(*image, expected, cv::NORM_INF), 0) << Name(kind);
        }
      }
    }
  }
}

TEST(PngReader, FindsTheOrientationBeforeAndBehindThePixels) {
  for (const bool at_the_end : {false, true}) {
    Kind kind;
    kind.orientation = 6;
    kind.at_the_end = at_the_end;
    const Bytes bytes = Write(kind);
    auto reader = PngReader::Open(bytes, PngPixels::kBgr8);
    ASSERT_TRUE(reader);
    Bytes row(reader->row_bytes());
    for (int y = 0; y < kHeight; ++y) ASSERT_TRUE(reader->ReadRow(row.data()));
    ASSERT_TRUE(reader->Finish());
    EXPECT_EQ(reader->orientation(), 6) << at_the_end;
  }
}

TEST(PngReader, RefusesEveryTruncationAndWhatIsNoPng) {
  const Bytes whole = Write({});
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    const auto cut =
        Decode(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
    ASSERT_FALSE(cut) << size;
    EXPECT_THAT(cut.error().message, HasSubstr("the decoder rejects it ("));
  }
  EXPECT_FALSE(Decode({'G', 'I', 'F', '8'}));
}

cv::Mat Samples(int type) {
  cv::Mat image(kHeight, kWidth, type);
  Random random(11);
  for (int y = 0; y < image.rows; ++y) {
    const std::size_t size = image.cols * image.elemSize();
    for (std::size_t i = 0; i < size; ++i) {
      image.ptr(y)[i] = static_cast<std::uint8_t>(random.Below(256));
    }
  }
  return image;
}

Result<Bytes> Encode(const cv::Mat& image, PngForm form) {
  form.width_px = image.cols;
  form.height_px = image.rows;
  form.channels = image.channels();
  form.bits = image.depth() == CV_8U ? 8 : 16;
  Bytes bytes;
  auto writer = PngWriter::Create(form, [&](std::span<const std::uint8_t> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return Result<void>();
  });
  if (!writer) return tl::unexpected(writer.error());
  for (int y = 0; y < image.rows; ++y) {
    TRY(writer->WriteRow(image.ptr(y)));
  }
  TRY(writer->Finish());
  return bytes;
}

TEST(PngWriter, OpenCvReadsBackEverySample) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
    for (const auto packing : {PngForm::Packing::kFast, PngForm::Packing::kDense}) {
      const cv::Mat image = Samples(type);
      PngForm form;
      form.packing = packing;
      const auto bytes = Encode(image, form);
      ASSERT_TRUE(bytes) << bytes.error().message;
      const cv::Mat read = cv::imdecode(*bytes, cv::IMREAD_UNCHANGED);
      ASSERT_EQ(read.type(), type);
      EXPECT_EQ(cv::norm(read, image, cv::NORM_INF), 0) << type;
    }
  }
}

TEST(PngWriter, TakesBothOrdersOfColours) {
  const cv::Mat red(kHeight, kWidth, CV_8UC3, cv::Scalar(200, 100, 50));
  PngForm form;
  form.order = PngForm::Order::kRgb;
  const auto bytes = Encode(red, form);
  ASSERT_TRUE(bytes);
  EXPECT_EQ(cv::imdecode(*bytes, cv::IMREAD_COLOR).at<cv::Vec3b>(0, 0), cv::Vec3b(50, 100, 200));
}

TEST(PngWriter, StatesTheResolutionThatItIsTold) {
  PngForm form;
  form.dpi_x = 600;
  form.dpi_y = 300;
  const auto bytes = Encode(Samples(CV_8UC1), form);
  ASSERT_TRUE(bytes);
  const auto reader = PngReader::Open(*bytes, PngPixels::kAsStored);
  ASSERT_TRUE(reader);
  constexpr double kRounding = 0.5 * 0.0254;  // whole pixels per metre
  EXPECT_NEAR(reader->header().dpi_x.value_or(0), 600, kRounding);
  EXPECT_NEAR(reader->header().dpi_y.value_or(0), 300, kRounding);
}

TEST(PngWriter, EndsWithTheSinksError) {
  PngForm form;
  form.width_px = form.height_px = 1000;
  int calls = 0;
  auto writer = PngWriter::Create(form, [&](std::span<const std::uint8_t>) -> Result<void> {
    constexpr int kHeader = 6;  // calls
    if (++calls > kHeader) return Fail("the disk is full");
    return {};
  });
  ASSERT_TRUE(writer);
  Random random(1);
  Result<void> written;
  Bytes row(1000);
  for (int y = 0; y < 1000 && written; ++y) {
    for (std::uint8_t& byte : row) byte = static_cast<std::uint8_t>(random.Below(256));
    written = writer->WriteRow(row.data());
  }
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().message, "the disk is full");
}

TEST(PngWriter, NamesSizesThatItCannotWrite) {
  PngForm form;
  form.width_px = 1'000'001;
  form.height_px = 1;
  const auto writer = PngWriter::Create(form, [](auto) { return Result<void>(); });
  ASSERT_FALSE(writer);
  EXPECT_THAT(writer.error().message, HasSubstr("1000001 x 1 px"));
}

}  // namespace
}  // namespace trammel::image
