// JPEG files beside those of OpenCV and libjpeg; parts and cuts of them beside the same pixels of
// the whole.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

// After cstdio: it requires the declaration of FILE.
#include <jpeglib.h>

#include "base/frame.h"
#include "base/random.h"
#include "base/result.h"
#include "image/jpeg_cutter.h"
#include "image/jpeg_reader.h"
#include "image/jpeg_writer.h"

namespace trammel::image {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Kind {
  std::string name;
  int components = 3;
  int across = 1;  ///< luma samples per chroma sample
  int down = 1;
  int restart_rows = 0;  ///< MCU rows; 0: no restarts
  int restart_mcus = 0;
  bool progressive = false;
  bool arithmetic = false;
  bool huffman_tables = true;
  bool dark = false;  ///< but for a stripe
};

Bytes WithoutHuffmanTables(const Bytes& jpeg) {
  constexpr std::uint8_t kTables = 0xC4;
  constexpr std::uint8_t kStartOfScan = 0xDA;
  Bytes stripped(jpeg.begin(), jpeg.begin() + 2);
  std::size_t at = 2;
  for (std::uint8_t marker = 0; marker != kStartOfScan;) {
    marker = jpeg[at + 1];
    const std::size_t end = at + 2 + jpeg[at + 2] * std::size_t{256} + jpeg[at + 3];
    if (marker != kTables) {
      stripped.insert(stripped.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at),
                      jpeg.begin() + static_cast<std::ptrdiff_t>(end));
    }
    at = end;
  }
  stripped.insert(stripped.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
  return stripped;
}

/// Lists cameras' kinds of JPEG: every chroma sampling, grey, restarts, no standard tables, and a
/// dark stripe.
std::vector<Kind> KindsOfCameras() {
  return {{.name = "4:4:4"},
          {.name = "4:2:2", .across = 2},
          {.name = "4:2:0", .across = 2, .down = 2},
          {.name = "4:4:0", .down = 2},
          {.name = "4:1:1", .across = 4},
          {.name = "grey", .components = 1},
          {.name = "restarts of rows", .across = 2, .down = 2, .restart_rows = 1},
          {.name = "restarts within rows", .across = 2, .restart_mcus = 3},
          {.name = "standard tables left out", .across = 2, .huffman_tables = false},
          {.name = "dark", .across = 2, .down = 2, .dark = true},
          {.name = "dark, restarts within rows", .across = 2, .restart_mcus = 3, .dark = true}};
}

/// The same and others.
std::vector<Kind> KindsOfCamerasAnd(std::vector<Kind> others) {
  std::vector<Kind> kinds = KindsOfCameras();
  kinds.insert(kinds.end(), others.begin(), others.end());
  return kinds;
}

/// Encodes interleaved samples by libjpeg, which `set` tells more after its defaults.
Bytes Compressed(const cv::Mat& image, const std::function<void(jpeg_compress_struct&)>& set) {
  constexpr J_COLOR_SPACE kColours[] = {JCS_GRAYSCALE, JCS_UNKNOWN, JCS_RGB, JCS_CMYK};
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(image.cols);
  jpeg.image_height = static_cast<JDIMENSION>(image.rows);
  jpeg.input_components = image.channels();
  jpeg.in_color_space = kColours[image.channels() - 1];
  jpeg_set_defaults(&jpeg);
  set(jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  for (int y = 0; y < image.rows; ++y) {
    auto* row = const_cast<JSAMPROW>(image.ptr(y));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  Bytes written(bytes, bytes + size);
  std::free(bytes);
  return written;
}

/// Slopes, strong colours that change from block to block, and noise.
Bytes EncodeKind(const Kind& kind, int width, int height, Random& random) {
  cv::Mat image(height, width, CV_8UC(kind.components));
  for (int y = 0; y < height; ++y) {
    for (int i = 0; i < kind.components * width; ++i) {
      const int x = i / kind.components;
      const int c = i % kind.components;
      const double level = 128 + 90 * std::sin(0.3 * x * (c + 1) + 0.21 * y) + 12 * random.Normal();
      const bool lit = !kind.dark || (x >= 50 && x < 75);
      image.ptr(y)[i] = static_cast<std::uint8_t>(lit ? std::clamp(level, 0.0, 255.0) : 0.0);
    }
  }
  const Bytes written = Compressed(image, [&kind](jpeg_compress_struct& jpeg) {
    jpeg_set_quality(&jpeg, 85, TRUE);
    jpeg.comp_info[0].h_samp_factor = kind.across;
    jpeg.comp_info[0].v_samp_factor = kind.down;
    jpeg.restart_in_rows = kind.restart_rows;
    jpeg.restart_interval = static_cast<unsigned>(kind.restart_mcus);
    jpeg.arith_code = kind.arithmetic ? TRUE : FALSE;
    if (kind.progressive) jpeg_simple_progression(&jpeg);
  });
  return kind.huffman_tables ? written : WithoutHuffmanTables(written);
}

/// All rows of a started reader, of `samples` a pixel.
Result<Bytes> ReadRows(JpegReader& reader, std::size_t samples) {
  const std::size_t row_bytes = samples * static_cast<std::size_t>(reader.row_px());
  Bytes pixels(row_bytes * static_cast<std::size_t>(reader.rows()));
  for (int y = 0; y < reader.rows(); ++y) {
    TRY(reader.ReadRow(pixels.data() + static_cast<std::size_t>(y) * row_bytes));
  }
  return pixels;
}

Result<Bytes> ReadWhole(const Bytes& jpeg, JpegPixels pixels) {
  auto reader = TRY(JpegReader::Open(jpeg, JpegDamage::kRefuse));
  TRY(reader.Start(pixels));
  return ReadRows(reader, pixels == JpegPixels::kGrey ? 1 : 3);
}

/// The same part of decoded pixels.
Bytes PartOf(const Bytes& whole, int width, std::size_t samples, const PixelRect& part) {
  Bytes cut;
  for (int y = part.y; y < part.y + part.height; ++y) {
    const auto at = whole.begin() + static_cast<std::ptrdiff_t>(samples) * (y * width + part.x);
    cut.insert(cut.end(), at, at + static_cast<std::ptrdiff_t>(samples) * part.width);
  }
  return cut;
}

/// Corners, edges, single pixels, the whole, and `anywhere` more.
std::vector<PixelRect> PartsOf(int width, int height, int anywhere, Random& random) {
  std::vector<PixelRect> parts = {{0, 0, width, height},         {0, 0, 1, 1},
                                  {width - 1, 0, 1, 1},          {0, height - 1, 1, 1},
                                  {width - 1, height - 1, 1, 1}, {0, height / 2, width, 1},
                                  {width / 2, 0, 1, height}};
  const auto within = [&](int count) {
    return std::min(count - 1, static_cast<int>(random.Uniform() * count));
  };
  for (int i = 0; i < anywhere; ++i) {
    const int x = within(width);
    const int y = within(height);
    parts.push_back({x, y, 1 + within(width - x), 1 + within(height - y)});
  }
  return parts;
}

using ::testing::HasSubstr;

// Maximum difference of two decoders with the same transform, computed in another order.
constexpr double kMaxLevels = 2;

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
  return Compressed(cmyk, [&kind](jpeg_compress_struct& jpeg) {
    jpeg_set_colorspace(&jpeg, kind.stored);
    jpeg_set_quality(&jpeg, 98, TRUE);
    jpeg.write_Adobe_marker = kind.adobe ? TRUE : FALSE;
  });
}

// Decodes the bytes, or returns the reader's error.
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
  EXPECT_LE(cv::norm(*image, expected, cv::NORM_INF), kMaxLevels) << what;
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
  for (const auto& [reduction, flag] : {std::pair{2, cv::IMREAD_REDUCED_COLOR_2},
                                        {4, cv::IMREAD_REDUCED_COLOR_4},
                                        {8, cv::IMREAD_REDUCED_COLOR_8}}) {
    ExpectNear(Decode(bytes, JpegPixels::kBgr, reduction), cv::imdecode(bytes, flag),
               std::to_string(reduction));
  }
}

TEST(JpegReader, PrintsFourInksOnWhite) {
  const cv::Mat inks = Scene(48, 32, 4);
  for (const J_COLOR_SPACE stored : {JCS_CMYK, JCS_YCCK}) {
    const Bytes adobe = EncodeInks(inks, {stored, true});
    ExpectNear(Decode(adobe), cv::imdecode(adobe, cv::IMREAD_COLOR), "Adobe's");
  }
  // Without Adobe's marker, 0 is no ink: paper is white, and black ink alone is black.
  cv::Mat plain(16, 32, CV_8UC4, cv::Scalar(0, 0, 0, 0));
  plain.colRange(16, 32).setTo(cv::Scalar(0, 0, 0, 255));
  const auto printed = Decode(EncodeInks(plain, {JCS_CMYK, false}));
  ASSERT_TRUE(printed) << printed.error().message;
  EXPECT_GE(printed->ptr(8)[3 * 4], 255 - kMaxLevels);
  EXPECT_LE(printed->ptr(8)[3 * 28], kMaxLevels);
}

TEST(JpegReader, NamesColoursThatItCannotShow) {
  const auto two = Decode(EncodeInks(Scene(16, 16, 2), {JCS_UNKNOWN, false}));
  ASSERT_FALSE(two);
  EXPECT_THAT(two.error().message, HasSubstr("2 colours; save it as grey or RGB"));
}

// Frames of cameras leave out the tables that the format's standard has.
TEST(JpegReader, TakesTheStandardsTablesWhereAFrameHasNone) {
  const Bytes whole = Encode(Scene(64, 48, 3));
  const Bytes bare = WithoutHuffmanTables(whole);
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
      // Of a larger picture: what lies between its rows is left out.
      const cv::Mat scene = Scene(80, 40, channels)(cv::Rect(8, 4, 67, 33));
      Bytes bytes;
      ASSERT_TRUE(
          EncodeJpeg({scene.data, 67, 33, channels, static_cast<std::ptrdiff_t>(scene.step)},
                     {.quality = quality, .dpi = {}}, bytes));
      const Bytes theirs = Encode(scene, {cv::IMWRITE_JPEG_QUALITY, quality});
      EXPECT_EQ(cv::norm(cv::imdecode(bytes, cv::IMREAD_UNCHANGED),
                         cv::imdecode(theirs, cv::IMREAD_UNCHANGED), cv::NORM_INF),
                0)
          << channels << " at " << quality;
    }
  }
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

const std::vector<Kind> kKinds =
    KindsOfCamerasAnd({{.name = "four inks", .components = 4},
                       {.name = "progressive", .across = 2, .down = 2, .progressive = true}});

Result<Bytes> ReadPart(const Bytes& jpeg, JpegPixels pixels, const PixelRect& part) {
  auto reader = TRY(JpegReader::Open(jpeg, JpegDamage::kRefuse));
  TRY(reader.StartPart(pixels, part));
  EXPECT_EQ(reader.row_px(), part.width);
  EXPECT_EQ(reader.rows(), part.height);
  auto read = ReadRows(reader, pixels == JpegPixels::kGrey ? 1 : 3);
  if (!read) return read;
  TRY(reader.ReadRest());
  return read;
}

TEST(JpegPart, IsTheSameToTheBitAsThatPartOfTheWhole) {
  Random random(11);
  for (const Kind& kind : kKinds) {
    for (const auto& [width, height] :
         {std::pair(1, 1), {16, 16}, {67, 33}, {131, 90}, {160, 121}}) {
      const Bytes jpeg = EncodeKind(kind, width, height, random);
      for (const JpegPixels pixels : {JpegPixels::kBgr, JpegPixels::kGrey}) {
        if (kind.components == 4 && pixels == JpegPixels::kGrey) continue;  // inks come as BGR
        const std::size_t samples = pixels == JpegPixels::kGrey ? 1 : 3;
        const auto whole = ReadWhole(jpeg, pixels);
        ASSERT_TRUE(whole) << kind.name << ": " << whole.error().message;
        for (const PixelRect& part : PartsOf(width, height, 60, random)) {
          const auto read = ReadPart(jpeg, pixels, part);
          ASSERT_TRUE(read) << kind.name << ": " << read.error().message;
          EXPECT_EQ(*read, PartOf(*whole, width, samples, part))
              << kind.name << ", " << part.width << "x" << part.height << " at (" << part.x << ", "
              << part.y << ") of " << width << "x" << height;
        }
      }
    }
  }
}

// Behind the loss the picture has moved, which nothing in the part itself tells.
TEST(JpegPart, FindsBytesLostBeforeItAtTheEndOfTheData) {
  Random random(12);
  const Bytes jpeg = EncodeKind({.name = "4:2:2", .across = 2}, 320, 240, random);
  const PixelRect part{150, 150, 45, 60};
  int found = 0;
  constexpr int kLosses = 40;
  for (int i = 0; i < kLosses; ++i) {
    Bytes lost = jpeg;
    const auto at = lost.begin() + 700 + static_cast<std::ptrdiff_t>(random.Uniform() * 3000);
    lost.erase(at, at + 400);
    found += ReadPart(lost, JpegPixels::kBgr, part) ? 0 : 1;
    EXPECT_EQ(ReadPart(lost, JpegPixels::kBgr, part).has_value(),
              ReadWhole(lost, JpegPixels::kBgr).has_value());
  }
  EXPECT_EQ(found, kLosses);
}

TEST(JpegPart, RefusesDataThatEndsBehindIt) {
  Random random(13);
  Bytes jpeg = EncodeKind({.name = "4:2:0", .across = 2, .down = 2}, 320, 240, random);
  jpeg.resize(jpeg.size() * 9 / 10);
  EXPECT_FALSE(ReadPart(jpeg, JpegPixels::kBgr, {10, 10, 40, 40}));
}

const std::vector<Kind> kCutKinds =
    KindsOfCamerasAnd({{.name = "grey in blocks of four", .components = 1, .across = 2, .down = 2},
                       {.name = "arithmetic", .across = 2, .down = 2, .arithmetic = true}});

/// Pixels of `part` of the whole, decoded from its cut.
Result<Bytes> ReadCut(const Bytes& cut, const PixelRect& part, JpegPixels pixels) {
  auto reader = TRY(JpegReader::Open(cut, JpegDamage::kRefuse));
  const JpegHeader& header = reader.header();
  const JpegPlace place = header.place.value_or(JpegPlace{0, 0, header.width_px, header.height_px});
  const PixelRect exact = ExactPart(place, header.grid());
  if (part.x < exact.x || part.y < exact.y || part.x + part.width > exact.x + exact.width ||
      part.y + part.height > exact.y + exact.height) {
    return Fail("the part is not exact in the cut");
  }
  TRY(reader.StartPart(pixels, {part.x - place.x, part.y - place.y, part.width, part.height}));
  return ReadRows(reader, pixels == JpegPixels::kGrey ? 1 : 3);
}

TEST(JpegCutter, KeepsEveryPixelOfThePartToTheBit) {
  Random random(21);
  for (const Kind& kind : kCutKinds) {
    for (const auto& [width, height] :
         {std::pair(1, 1), {16, 16}, {67, 33}, {131, 90}, {160, 121}}) {
      const Bytes jpeg = EncodeKind(kind, width, height, random);
      const auto bgr = ReadWhole(jpeg, JpegPixels::kBgr);
      const auto grey = ReadWhole(jpeg, JpegPixels::kGrey);
      ASSERT_TRUE(bgr && grey) << kind.name;
      Bytes cut;
      for (const PixelRect& part : PartsOf(width, height, 40, random)) {
        const auto where = ::testing::Message()
                           << kind.name << ", " << part.width << "x" << part.height << " at ("
                           << part.x << ", " << part.y << ") of " << width << "x" << height;
        const auto done = CutJpeg(jpeg, part, cut);
        ASSERT_TRUE(done) << where << ": " << done.error().message;
        const auto cut_bgr = ReadCut(cut, part, JpegPixels::kBgr);
        const auto cut_grey = ReadCut(cut, part, JpegPixels::kGrey);
        ASSERT_TRUE(cut_bgr) << where << ": " << cut_bgr.error().message;
        ASSERT_TRUE(cut_grey) << where << ": " << cut_grey.error().message;
        EXPECT_EQ(*cut_bgr, PartOf(*bgr, width, 3, part)) << where;
        EXPECT_EQ(*cut_grey, PartOf(*grey, width, 1, part)) << where;
      }
    }
  }
}

TEST(JpegCutter, KeepsFewBytesAndSaysWhereTheyLie) {
  Random random(22);
  const Bytes jpeg = EncodeKind({.name = "4:2:2", .across = 2}, 640, 480, random);
  Bytes cut;
  ASSERT_TRUE(CutJpeg(jpeg, {300, 200, 45, 60}, cut));
  EXPECT_LT(cut.size(), jpeg.size() / 20);  // the cut has 1/30 of the pixels
  const auto reader = JpegReader::Open(cut, JpegDamage::kRefuse);
  ASSERT_TRUE(reader);
  const auto& place = reader->header().place;
  ASSERT_TRUE(place);
  EXPECT_EQ(std::tuple(place->x, place->y, place->whole_width, place->whole_height),
            std::tuple(288, 192, 640, 480));
  EXPECT_EQ(std::pair(reader->header().width_px, reader->header().height_px), std::pair(64, 72));
  EXPECT_FALSE(JpegReader::Open(jpeg, JpegDamage::kRefuse)->header().place);
}

TEST(JpegCutter, RefusesByNameWhatItCannotCut) {
  Random random(24);
  const PixelRect part{20, 20, 10, 10};
  Bytes cut;
  const auto why = [&](const Bytes& jpeg, const PixelRect& of) {
    const auto done = CutJpeg(jpeg, of, cut);
    return done ? std::string("cut") : done.error().message;
  };
  const auto encode = [&](const Kind& kind) { return EncodeKind(kind, 200, 100, random); };
  EXPECT_THAT(why(encode({.name = "progressive", .progressive = true}), part),
              HasSubstr("several scans"));
  EXPECT_THAT(why(encode({.name = "four inks", .components = 4}), part),
              HasSubstr("neither grey nor of 3 colours"));
  Bytes jpeg = encode({.name = "chroma of two thirds", .across = 2});
  constexpr std::uint8_t kStartOfFrame = 0xC0;
  const auto frame = std::adjacent_find(
      jpeg.begin(), jpeg.end(), [](int a, int b) { return a == 0xFF && b == kStartOfFrame; });
  *(frame + 14) = 0x31;  // second component's sampling
  EXPECT_THAT(why(jpeg, part), HasSubstr("ampling"));
  jpeg = encode({.name = "4:4:4"});
  for (const PixelRect& outside : {PixelRect{-1, 0, 9, 9},
                                   {0, 95, 9, 9},
                                   {195, 0, 9, 9},
                                   {10, 10, 0, 5},
                                   {10, 10, 5, -5},
                                   {0, 0, 201, 100}}) {
    EXPECT_THAT(why(jpeg, outside), HasSubstr("does not lie within it"));
  }
  ASSERT_EQ(why(jpeg, part), "cut");
  const Bytes once = cut;
  EXPECT_THAT(why(once, {0, 0, 8, 8}), HasSubstr("cut before"));
  EXPECT_THAT(why({}, part), HasSubstr("rejects"));
}

// Neither a crash nor a picture that the reader would have refused.
TEST(JpegCutter, RefusesDamageWhereverItIs) {
  Random random(25);
  const PixelRect part{40, 40, 30, 30};
  const auto at = [&](const Bytes& jpeg) {
    return std::min(jpeg.size() - 1,
                    static_cast<std::size_t>(random.Uniform() * static_cast<double>(jpeg.size())));
  };
  Bytes cut;
  for (const Kind& kind : kCutKinds) {
    const Bytes jpeg = EncodeKind(kind, 160, 120, random);
    for (int i = 0; i < 200; ++i) {
      Bytes damaged = jpeg;
      if (i % 2 == 0) {
        damaged.resize(at(jpeg));
      } else {
        for (int k = 0; k < 3; ++k) {
          damaged[at(jpeg)] = static_cast<std::uint8_t>(256 * random.Uniform());
        }
      }
      if (!CutJpeg(damaged, part, cut)) continue;
      const auto whole = ReadWhole(damaged, JpegPixels::kBgr);
      ASSERT_TRUE(whole) << kind.name << ", damage " << i << ": " << whole.error().message;
      EXPECT_EQ(ReadCut(cut, part, JpegPixels::kBgr).value_or(Bytes{}),
                PartOf(*whole, JpegReader::Open(damaged, JpegDamage::kRefuse)->header().width_px, 3,
                       part))
          << kind.name << ", damage " << i;
    }
  }
}

TEST(JpegPlace, ThatCannotBeIsRefused) {
  Random random(26);
  const Bytes jpeg = EncodeKind({.name = "4:2:0", .across = 2, .down = 2}, 64, 48, random);
  const auto with = [&](const JpegPlace& place) {
    const auto bytes = FormatPlace(place);
    Bytes marked = {0xFF, 0xD8, 0xFF, kPlaceMarker, 0, kPlaceBytes + 2};
    marked.insert(marked.end(), bytes.begin(), bytes.end());
    marked.insert(marked.end(), jpeg.begin() + 2, jpeg.end());
    return JpegReader::Open(marked, JpegDamage::kRefuse);
  };
  EXPECT_TRUE(with({16, 32, 100, 100}));
  EXPECT_TRUE(with({16, 32, 80, 80}));
  for (const JpegPlace& wrong : {JpegPlace{16, 32, 79, 100},
                                 {16, 32, 100, 79},
                                 {8, 32, 100, 100},
                                 {16, 40, 100, 100},
                                 {0, 0, 0, 0},
                                 {65520, 0, 65535, 100}}) {
    const auto read = with(wrong);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("cannot be"));
  }
}

}  // namespace

}  // namespace trammel::image
