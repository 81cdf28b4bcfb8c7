#include "machine/page/page_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jpeglib.h>
#include <png.h>
#include <tiffio.h>

#include <array>
#include <boost/crc.hpp>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "machine/camera/camera.h"
#include "support/little_memory.h"
#include "support/matchers.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 37;  // no multiple of eight: rows of bits end within a byte
constexpr int kHeight = 23;

// A picture in which no two neighbours are alike.
unsigned Value(int x, int y, int channel) {
  return static_cast<unsigned>(x * 5 + y * 9 + channel * 60) % 256U;
}

struct Kind {
  int samples = 1;
  int bits = 8;
};

// Rows as TIFF and PNG have them, 16 bits in the processor's order.
std::string Row(const Kind& kind, int y) {
  std::string row;
  for (int x = 0; x < kWidth; ++x) {
    for (int channel = 0; channel < kind.samples; ++channel) {
      const bool alpha = channel + 1 == kind.samples && kind.samples % 2 == 0;
      const auto value = static_cast<std::uint16_t>(alpha ? 255U : Value(x, y, channel));
      if (kind.bits == 16) {
        const auto wide = static_cast<std::uint16_t>(value * 257U);
        row.append(reinterpret_cast<const char*>(&wide), sizeof wide);
      } else {
        row.push_back(static_cast<char>(value));
      }
    }
  }
  return row;
}

void ExpectPicture(const Page& page, int channels) {
  ASSERT_EQ(page.width, kWidth);
  ASSERT_EQ(page.height, kHeight);
  ASSERT_EQ(page.channels, channels);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int channel = 0; channel < channels; ++channel) {
        const int rgb = channels == 3 ? 2 - channel : 0;
        ASSERT_EQ(page.view().row(y)[x * channels + channel], Value(x, y, rgb))
            << x << ", " << y << ", " << channel;
      }
    }
  }
}

// Smooth and grey, so that little is lost.
std::string JpegBytes(bool progressive = false) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &out, &size);
  jpeg.image_width = kWidth;
  jpeg.image_height = kHeight;
  jpeg.input_components = 1;
  jpeg.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 100, TRUE);
  jpeg.density_unit = 1;
  jpeg.X_density = 600;
  jpeg.Y_density = 300;
  if (progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  for (int y = 0; y < kHeight; ++y) {
    std::array<JSAMPLE, kWidth> row{};
    for (int x = 0; x < kWidth; ++x) {
      row[static_cast<std::size_t>(x)] = static_cast<JSAMPLE>(4 * x + 3 * y);
    }
    JSAMPROW rows[] = {row.data()};
    jpeg_write_scanlines(&jpeg, rows, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::string bytes(reinterpret_cast<const char*>(out), size);
  jpeg_destroy_compress(&jpeg);
  std::free(out);
  return bytes;
}

const std::string kGrey = "/ColorSpace /DeviceGray /BitsPerComponent 8";  // grey picture in a PDF

class PageFile : public testing::Test {
 protected:
  std::string Path(const std::string& name) { return folder_.path() / name; }

  std::string Written(const std::string& name, const std::string& bytes) {
    test::WriteWhole(Path(name), bytes);
    return Path(name);
  }

  std::string Tiff(const Kind& kind, std::uint16_t photometric, bool tiled = false, int pages = 1) {
    const std::string path = Path("page.tiff");
    TIFF* tiff = TIFFOpen(path.c_str(), "w");
    for (int page = 0; page < pages; ++page) {
      TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kWidth);
      TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kHeight);
      TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
      TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
      TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, photometric);
      TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
      TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
      TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_CENTIMETER);
      TIFFSetField(tiff, TIFFTAG_XRESOLUTION, 600 / 2.54);
      TIFFSetField(tiff, TIFFTAG_YRESOLUTION, 300 / 2.54);
      if (tiled) {
        WriteTiles(tiff);
      } else {
        for (int y = 0; y < kHeight; ++y) {
          std::string row = Row(kind, y);
          TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(y));
        }
      }
      TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
    return path;
  }

  std::string Png(const Kind& kind, int color_type, int interlace = PNG_INTERLACE_NONE) {
    const std::string path = Path("page.png");
    std::FILE* file = std::fopen(path.c_str(), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, kWidth, kHeight, kind.bits, color_type, interlace,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_pHYs(png, info, 23622, 11811, PNG_RESOLUTION_METER);
    png_write_info(png, info);
    if (kind.bits == 16) png_set_swap(png);
    for (int pass = png_set_interlace_handling(png); pass > 0; --pass) {
      for (int y = 0; y < kHeight; ++y) {
        const std::string row = Row(kind, y);
        png_write_row(png, reinterpret_cast<png_const_bytep>(row.data()));
      }
    }
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    std::fclose(file);
    return path;
  }

  // Writes a page of 37 x 23 pixels at 600 dpi. `beside` is another object, 6 0, which the page
  // names Im1.
  std::string Pdf(const std::string& entries, const std::string& stream,
                  const std::string& draw = "q 4.44 0 0 2.76 0 0 cm /Im0 Do Q",
                  const std::string& beside = "null") {
    std::string pdf = "%PDF-1.4\n";
    std::vector<std::size_t> at;
    const auto add = [&](const std::string& object) {
      at.push_back(pdf.size());
      pdf += fmt::format("{} 0 obj\n{}\nendobj\n", at.size(), object);
    };
    add("<< /Type /Catalog /Pages 2 0 R >>");
    add("<< /Type /Pages /Kids [3 0 R] /Count 1 >>");
    add("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 4.44 2.76] /Contents 5 0 R /Resources << "
        "/XObject << /Im0 4 0 R /Im1 6 0 R >> >> >>");
    add(fmt::format(
        "<< /Type /XObject /Subtype /Image /Width {} /Height {} {} /Length {} >>\nstream\n{}"
        "\nendstream",
        kWidth, kHeight, entries, stream.size(), stream));
    add(fmt::format("<< /Length {} >>\nstream\n{}\nendstream", draw.size(), draw));
    add(beside);
    const std::size_t table = pdf.size();
    pdf += fmt::format("xref\n0 {}\n0000000000 65535 f \n", at.size() + 1);
    for (const std::size_t offset : at) pdf += fmt::format("{:010} 00000 n \n", offset);
    pdf += fmt::format("trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n", at.size() + 1,
                       table);
    return Written("page.pdf", pdf);
  }

  static std::string GreyRows() {
    std::string rows;
    for (int y = 0; y < kHeight; ++y) rows += Row({}, y);
    return rows;
  }

  static Page Only(const std::string& path) {
    auto pages = ReadPages(path);
    if (!pages) {
      ADD_FAILURE() << pages.error().message;
      return {};
    }
    EXPECT_EQ(pages->size(), 1U);
    return std::move(pages->front());
  }

  static void ExpectDpi(const Page& page, double x, double y) {
    ASSERT_TRUE(page.dpi_x && page.dpi_y);
    EXPECT_NEAR(*page.dpi_x, x, 0.01);
    EXPECT_NEAR(*page.dpi_y, y, 0.01);
  }

  static std::string Complaint(const std::string& path, const PageReadOptions& options = {}) {
    return ErrorOf(ReadPages(path, options));
  }

 private:
  static void WriteTiles(TIFF* tiff) {
    constexpr int kSide = 16;
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kSide);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, kSide);
    for (int top = 0; top < kHeight; top += kSide) {
      for (int left = 0; left < kWidth; left += kSide) {
        std::array<std::uint8_t, kSide * kSide> tile{};
        for (int i = 0; i < kSide * kSide; ++i) {
          tile[static_cast<std::size_t>(i)] =
              static_cast<std::uint8_t>(Value(left + i % kSide, top + i / kSide, 0));
        }
        TIFFWriteTile(tiff, tile.data(), static_cast<std::uint32_t>(left),
                      static_cast<std::uint32_t>(top), 0, 0);
      }
    }
  }

  test::TemporaryFolder folder_;
};

TEST_F(PageFile, ReadsTiffsOfEveryDepthWithTheirResolution) {
  for (const int samples : {1, 2, 3, 4}) {
    for (const int bits : {8, 16}) {
      SCOPED_TRACE(fmt::format("{} samples of {} bits", samples, bits));
      const Page page =
          Only(Tiff({samples, bits}, samples < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB));
      ExpectPicture(page, samples < 3 ? 1 : 3);
      ExpectDpi(page, 600, 300);
    }
  }
}

TEST_F(PageFile, ReadsTilesAndManyPages) {
  const Page page = Only(Tiff({}, PHOTOMETRIC_MINISBLACK, true));
  // Tiles are decoded as colour: grey becomes three equal channels.
  ASSERT_EQ(page.channels, 3);
  EXPECT_EQ(page.view().row(20)[3 * 30], Value(30, 20, 0));
  const auto pages = Must(ReadPages(Tiff({}, PHOTOMETRIC_MINISBLACK, false, 3)));
  ASSERT_EQ(pages.size(), 3U);
  ExpectPicture(pages.back(), 1);
  EXPECT_THAT(Complaint(Path("page.tiff"), {.max_pages = 2}), HasSubstr("more than 2 pages"));
}

TEST_F(PageFile, ReadsPngsOfEveryDepthWithTheirResolution) {
  const std::array<int, 4> types = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA,
                                    PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
  for (const int samples : {1, 2, 3, 4}) {
    for (const int bits : {8, 16}) {
      SCOPED_TRACE(fmt::format("{} samples of {} bits", samples, bits));
      for (const int interlace : {PNG_INTERLACE_NONE, PNG_INTERLACE_ADAM7}) {
        const Page page =
            Only(Png({samples, bits}, types[static_cast<std::size_t>(samples) - 1], interlace));
        ExpectPicture(page, samples < 3 ? 1 : 3);
        ExpectDpi(page, 600, 300);
      }
    }
  }
}

TEST_F(PageFile, ReadsJpegs) {
  for (const bool progressive : {false, true}) {
    const Page page = Only(Written("page.jpg", JpegBytes(progressive)));
    ExpectDpi(page, 600, 300);
    ASSERT_EQ(page.channels, 1);
    constexpr int kLoss = 2;  // at quality 100, from rounding in the transform
    EXPECT_NEAR(page.view().row(20)[30], 4 * 30 + 3 * 20, kLoss);
  }
}

// Whatever a camera that looks straight down wrote: both readers of measured pictures have the
// sensor's pixels.
TEST_F(PageFile, AgreesWithACamerasFramesOnEveryOrientation) {
  const std::string jpeg = JpegBytes();
  for (int orientation = 1; orientation <= 8; ++orientation) {
    SCOPED_TRACE(orientation);
    std::string exif(
        "\xFF\xE1\x00\x22"
        "Exif\0\0MM\0\x2A\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0?\0\0\0\0\0\0",
        36);
    exif[exif.find('?')] = static_cast<char>(orientation);
    const std::string turned = jpeg.substr(0, 2) + exif + jpeg.substr(2);
    const Page page = Only(Written("turned.jpg", turned));
    CapturedFrame captured;
    captured.image.assign(turned.begin(), turned.end());
    const auto frame = Must(DecodeFrame(captured));
    ASSERT_EQ(frame.width, kWidth);
    ASSERT_EQ(frame.height, kHeight);
    ASSERT_EQ(page.channels, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_EQ(page.view().row(y)[x], frame.view().row(y)[3 * x]) << x << ", " << y;
      }
    }
  }
}

TEST_F(PageFile, TakesThePictureOfAPdfAsItWasStored) {
  const Page raw = Only(Pdf(kGrey, GreyRows()));
  ExpectPicture(raw, 1);
  ExpectDpi(raw, 600, 600);
  const Page jpeg = Only(Pdf(kGrey + " /Filter /DCTDecode", JpegBytes()));
  EXPECT_NEAR(jpeg.view().row(20)[30], 4 * 30 + 3 * 20, 2);
  ExpectDpi(jpeg, 600, 600);
}

// A viewer shows what the page draws, whichever way the rows are stored.
TEST_F(PageFile, TakesThePictureOfAPdfTheWayItIsDrawn) {
  const auto top = [&](const char* draw) {
    const Page page = Only(Pdf(kGrey, GreyRows(), draw));
    EXPECT_EQ(page.height, kHeight) << draw;
    ExpectDpi(page, 600, 600);
    return int{page.view().row(0)[5]};
  };
  const int first = static_cast<int>(Value(5, 0, 0));
  const int last = static_cast<int>(Value(5, kHeight - 1, 0));
  ASSERT_NE(first, last);
  EXPECT_EQ(top("q 4.44 0 0 2.76 0 0 cm /Im0 Do Q"), first);
  EXPECT_EQ(top("0 4.44 -2.76 0 2.76 0 cm /Im0 Do"), first);      // turned by 90 degrees
  EXPECT_EQ(top("-4.44 0 0 -2.76 4.44 2.76 cm /Im0 Do"), first);  // rotated by 180
  EXPECT_EQ(top("q 4.44 0 0 -2.76 0 2.76 cm /Im0 Do Q"), last);   // rows from the bottom
  EXPECT_EQ(top("-4.44 0 0 2.76 4.44 0 cm /Im0 Do"), last);       // mirrored left to right
  EXPECT_EQ(top("1 0 0 -1 0 2.76 cm q 4.44 0 0 -2.76 0 2.76 cm /Im0 Do Q"), first);  // twice
  // The resolution is that of the drawing, not of the sheet.
  const Page half = Only(Pdf(kGrey, GreyRows(), "2.22 0 0 1.38 1 1 cm /Im0 Do"));
  ExpectDpi(half, 1200, 1200);
}

TEST_F(PageFile, TakesThePictureOfAPdfOutOfAForm) {
  const std::string draw = "4.44 0 0 -2.76 0 2.76 cm /Im0 Do";
  const std::string form = fmt::format(
      "<< /Type /XObject /Subtype /Form /BBox [0 0 9 9] /Matrix [1 0 0 1 0 0] /Resources << "
      "/XObject << /Im0 4 0 R >> >> /Length {} >>\nstream\n{}\nendstream",
      draw.size(), draw);
  const Page page = Only(Pdf(kGrey, GreyRows(), "q /Im1 Do Q", form));
  EXPECT_EQ(page.view().row(0)[5], Value(5, kHeight - 1, 0));
  ExpectDpi(page, 600, 600);
}

TEST_F(PageFile, ReadsIndexedPicturesAndMasksOfAPdf) {
  std::string colours;
  for (int i = 0; i < 256; ++i) colours += fmt::format("{:02x}{:02x}{:02x}", i, 255 - i, i / 2);
  const Page page = Only(Pdf(fmt::format("/ColorSpace [/Indexed /DeviceRGB 255 <{}>] "
                                         "/BitsPerComponent 8",
                                         colours),
                             GreyRows()));
  ASSERT_EQ(page.channels, 3);
  const auto number = Value(30, 20, 0);
  const std::uint8_t* pixel = page.view().row(20) + 3 * 30;
  EXPECT_EQ(pixel[2], number);
  EXPECT_EQ(pixel[1], 255 - number);
  EXPECT_EQ(pixel[0], number / 2);
  // Two bits a number, rows in whole bytes: 37 of them take 10.
  std::string two;
  for (int y = 0; y < kHeight; ++y) two += std::string(10, '\x1B');  // 0 1 2 3 ...
  const Page few =
      Only(Pdf("/ColorSpace [/Indexed /DeviceGray 3 <0A64C8FF>] /BitsPerComponent 2", two));
  ASSERT_EQ(few.channels, 1);
  for (int x = 0; x < kWidth; ++x) {
    constexpr std::array<int, 4> kGreys = {0x0A, 0x64, 0xC8, 0xFF};
    EXPECT_EQ(few.view().row(kHeight - 1)[x], kGreys[static_cast<std::size_t>(x % 4)]) << x;
  }
  // Black is drawn through a mask where its samples are 0.
  std::string bits;
  for (int y = 0; y < kHeight; ++y) bits += std::string(5, '\x55');
  const Page mask = Only(Pdf("/ImageMask true /BitsPerComponent 1", bits));
  for (int x = 0; x < kWidth; ++x) EXPECT_EQ(mask.view().row(3)[x], x % 2 == 0 ? 0 : 255) << x;
}

TEST_F(PageFile, NamesAPdfThatIsPutTogether) {
  const std::string mask =
      "<< /Type /XObject /Subtype /Image /Width 80 /Height 46 /ImageMask true "
      "/BitsPerComponent 1 /Length 460 >>\nstream\n" +
      std::string(460, 'x') + "\nendstream";
  const std::string whole = "q 4.44 0 0 2.76 0 0 cm /Im0 Do Q ";
  EXPECT_THAT(Complaint(Pdf(kGrey, GreyRows(), whole + "4.44 0 0 2.76 0 0 cm /Im1 Do", mask)),
              Containing("put together from 2 pictures", "scan to TIFF"));
  // A stamp beside it is none.
  Only(Pdf(kGrey, GreyRows(), whole + "0.4 0 0 0.3 1 1 cm /Im1 Do", mask));
  EXPECT_THAT(Complaint(Pdf(kGrey + " /SMask 6 0 R", GreyRows(), whole, mask)),
              HasSubstr("layers"));
  EXPECT_THAT(Complaint(Pdf(kGrey, GreyRows(), "4 0 2 2 0 0 cm /Im0 Do")), HasSubstr("askew"));
  EXPECT_THAT(Complaint(Pdf(kGrey, GreyRows(), "q Q")), HasSubstr("no picture"));
}

TEST_F(PageFile, SaysWhatIsWrongWithAPdf) {
  EXPECT_THAT(Complaint(Pdf("/ColorSpace /DeviceGray /BitsPerComponent 1 "
                            "/Filter /CCITTFaxDecode",
                            "x")),
              HasSubstr("/CCITTFaxDecode; scan to TIFF"));
  EXPECT_THAT(Complaint(Pdf(kGrey, std::string(kWidth * kHeight - 1, 'x'))),
              HasSubstr("ends early"));
  EXPECT_THAT(Complaint(Pdf(kGrey, "too short")), Containing("37 x 23 px", "bytes can hold"));
  EXPECT_THAT(Complaint(Written("none.pdf", "%PDF-1.4\nnothing")), HasSubstr("none.pdf"));
}

TEST_F(PageFile, FilesThatEndEarlyAreNamed) {
  const std::array<std::string, 3> paths = {Tiff({}, PHOTOMETRIC_MINISBLACK),
                                            Png({}, PNG_COLOR_TYPE_GRAY),
                                            Written("page.jpg", JpegBytes())};
  for (const std::string& path : paths) {
    const std::string whole = test::ReadWhole(path);
    ASSERT_GT(whole.size(), 100U);
    for (std::size_t size : {whole.size() / 2, whole.size() * 3 / 4, std::size_t{9}}) {
      SCOPED_TRACE(fmt::format("{} of {} bytes of {}", size, whole.size(), path));
      EXPECT_THAT(Complaint(Written("cut", whole.substr(0, size))),
                  Containing("cut", "scan again"));
    }
  }
}

TEST_F(PageFile, LimitsAreKeptBeforeAnythingIsDecoded) {
  EXPECT_THAT(Complaint(Tiff({}, PHOTOMETRIC_MINISBLACK), {.most_pixels = 100}),
              Containing("37 x 23 px", "at most 0 megapixels"));
  EXPECT_THAT(Complaint(Png({}, PNG_COLOR_TYPE_GRAY), {.most_pixels = 100}),
              HasSubstr("37 x 23 px"));
  EXPECT_THAT(Complaint(Written("page.jpg", JpegBytes()), {.most_pixels = 100}),
              HasSubstr("37 x 23 px"));
}

TEST_F(PageFile, WhatIsNoPageIsNamed) {
  EXPECT_THAT(Complaint(Written("text.txt", "hello world")), HasSubstr("no TIFF, PNG, JPEG"));
  EXPECT_THAT(Complaint(Written("empty.tiff", "")), HasSubstr("it is empty"));
  EXPECT_THAT(Complaint(Path("missing.png")), HasSubstr("missing.png"));
}

using ::testing::AnyOf;

std::string BigEndian(std::uint32_t value) {
  return {static_cast<char>(value >> 24U), static_cast<char>(value >> 16U),
          static_cast<char>(value >> 8U), static_cast<char>(value)};
}

std::string LittleEndian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(value >> (8U * i)));
  return text;
}

// Computes the CRC of a PNG chunk.
std::uint32_t CheckSum(const std::string& text) {
  boost::crc_32_type sum;
  sum.process_bytes(text.data(), text.size());
  return sum.checksum();
}

class PageBombs : public testing::Test {
 protected:
  std::string Refusal(const std::string& name, const std::string& bytes) {
    const std::string path = folder_.path() / name;
    test::WriteWhole(path, bytes);
    return RefusalOf(path);
  }
  static std::string RefusalOf(const std::filesystem::path& path) {
    return test::WithLittleMemory([&] {
      const auto pages = ReadPages(path);
      return pages ? std::string("read") : pages.error().message;
    });
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(PageBombs, APngHeaderAloneTakesNoMemory) {
  for (const char interlaced : {'\0', '\1'}) {
    std::string header = "IHDR" + BigEndian(63000) + BigEndian(63000) + "\x08\x02";
    header += std::string(2, '\0') + interlaced;
    std::string png = "\x89PNG\r\n\x1A\n" + BigEndian(13) + header + BigEndian(CheckSum(header));
    png += BigEndian(12) + "IDAT" + std::string(16, 'x') + BigEndian(0) + "IEND\xAE\x42\x60\x82";
    EXPECT_THAT(Refusal("a.png", png), Containing("63000 x 63000 px", "bytes can hold"));
  }
}

TEST_F(PageBombs, ATiffHeaderAloneTakesNoMemory) {
  constexpr std::uint32_t kShort = 3;
  constexpr std::uint32_t kLong = 4;
  for (const std::uint32_t compression : {1U, 5U, 7U, 8U, 32773U}) {
    for (const std::uint32_t photometric : {2U, 6U}) {
      struct Entry {
        std::uint32_t tag, type, value;
      };
      const std::array<Entry, 10> entries = {{{256, kLong, 63000},
                                              {257, kLong, 63000},
                                              {258, kShort, 8},
                                              {259, kShort, compression},
                                              {262, kShort, photometric},
                                              {273, kLong, 200},
                                              {277, kShort, 3},
                                              {278, kLong, 63000},
                                              {279, kLong, 100},
                                              {284, kShort, 1}}};
      std::string tiff = "II*" + std::string(1, '\0') + LittleEndian(8, 4);
      tiff += LittleEndian(entries.size(), 2);
      for (const Entry& entry : entries) {
        tiff += LittleEndian(entry.tag, 2) + LittleEndian(entry.type, 2) + LittleEndian(1, 4) +
                LittleEndian(entry.value, 4);
      }
      tiff.resize(300);
      EXPECT_THAT(Refusal("a.tif", tiff), Containing("63000 x 63000 px", "300 bytes can hold"))
          << compression;
    }
  }
}

// A grey progressive JPEG whose last scan comes so many times.
std::string ManyScans(int times) {
  const std::string bytes = JpegBytes(true);
  const std::size_t last = bytes.rfind("\xFF\xDA");
  const std::string scan = bytes.substr(last, bytes.size() - 2 - last);
  std::string many = bytes.substr(0, last);
  for (int i = 0; i < times; ++i) many += scan;
  return many + "\xFF\xD9";
}

TEST_F(PageBombs, AJpegOfThousandsOfScansIsRefusedByTheirNumber) {
  EXPECT_THAT(Refusal("a.jpg", ManyScans(5000)),
              Containing("500", "scans, and at most 100 are read"));
}

TEST_F(PageBombs, AJpegThatStatesMoreThanItHoldsIsRefused) {
  std::string jpeg = ManyScans(1);
  std::size_t frame = jpeg.find("\xFF\xC2");
  ASSERT_NE(frame, std::string::npos);
  for (std::size_t i = 0; i < 4; ++i) jpeg[frame + 5 + i] = i % 2 == 0 ? '\xFF' : '\xDC';
  EXPECT_THAT(Refusal("a.jpg", jpeg), Containing("65500 x 65500 px", "bytes can hold"));
  // Decoders look for the next marker behind FF 00; a walk by lengths would step over it.
  jpeg.insert(2, std::string("\xFF\x00\x00\x08", 4));
  EXPECT_THAT(Refusal("b.jpg", jpeg), HasSubstr("does not state a size"));
}

TEST_F(PageBombs, APdfMayNotUnpackWithoutEnd) {
  if (test::kSanitized) GTEST_SKIP() << "decoders get no bound on addresses here";
  // Rows of four gigabytes, in the table of the file's own objects.
  const std::string stream(120, 'x');
  EXPECT_THAT(
      Refusal("a.pdf",
              fmt::format("%PDF-1.5\n5 0 obj\n<< /Type /XRef /Size 6 /W [1 2 1] /Root 1 0 R "
                          "/DecodeParms << /Predictor 12 /Columns 2147483647 /Colors 4 "
                          "/BitsPerComponent 16 >> /Filter /FlateDecode /Length {} "
                          ">>\nstream\n{}\nendstream\nendobj\nstartxref\n9\n%%EOF\n",
                          stream.size(), stream)),
      HasSubstr("unpacking it takes more than 256 MB"));
}

TEST_F(PageBombs, TheRealOnesAreRefusedInLittleMemoryAndTime) {
  if (test::kSanitized) GTEST_SKIP() << "decoders get no bound on addresses here";
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  const std::filesystem::path bombs =
      std::filesystem::path(data != nullptr ? data : "") / "hostile" / "bombs";
  if (data == nullptr || !std::filesystem::is_directory(bombs)) {
    GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with hostile/bombs/";
  }
  int seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(bombs)) {
    if (entry.path().extension() == ".gcode") continue;
    const std::string said = RefusalOf(entry.path());
    EXPECT_THAT(said, Containing("said: page ", entry.path().filename().string()));
    if (entry.path().extension() == ".pdf") {
      // One of them draws nothing, so that its picture is not looked at.
      EXPECT_THAT(said, AnyOf(HasSubstr("unpacking it takes more"), HasSubstr("no picture")));
    }
    ++seen;
    RecordProperty(entry.path().filename().string(), said);
  }
  EXPECT_GE(seen, 8);
}

}  // namespace
}  // namespace trammel::machine
