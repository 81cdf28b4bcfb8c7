#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <memory>
#include <string>
#include <system_error>

#include "machine/page/page_decoders.h"

namespace trammel::machine {
namespace {

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Tiff = std::unique_ptr<TIFF, CloseTiff>;

struct FreeOptions {
  void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};

// Records the library's first message. 1: suppresses further output.
int Keep(TIFF* /*tiff*/, void* first, const char* /*module*/, const char* format, va_list values) {
  auto& message = *static_cast<std::string*>(first);
  if (message.empty()) {
    char text[256] = {};
    std::vsnprintf(text, sizeof text, format, values);
    message = text;
  }
  return 1;
}

int Ignore(TIFF* /*tiff*/, void* /*data*/, const char* /*module*/, const char* /*format*/,
           va_list /*values*/) {
  return 1;
}

template <class T>
T Tag(const Tiff& tiff, std::uint32_t tag, T otherwise) {
  T value = otherwise;
  return TIFFGetFieldDefaulted(tiff.get(), tag, &value) == 1 ? value : otherwise;
}

void TakeResolution(const Tiff& tiff, Page& page) {
  const auto unit = Tag<std::uint16_t>(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH);
  float x = 0;
  float y = 0;
  const bool stated = TIFFGetField(tiff.get(), TIFFTAG_XRESOLUTION, &x) == 1 &&
                      TIFFGetField(tiff.get(), TIFFTAG_YRESOLUTION, &y) == 1;
  if (stated && unit != RESUNIT_NONE && x > 0 && y > 0) {
    const double per_inch = unit == RESUNIT_CENTIMETER ? 2.54 : 1;
    page.dpi_x = per_inch * static_cast<double>(x);
    page.dpi_y = per_inch * static_cast<double>(y);
  }
}

Error EndsEarly(int row, const std::string& said) {
  return {ErrorKind::kInput,
          fmt::format("it ends in row {}, or is damaged there ({}); copy it again, or scan again",
                      row + 1, said.empty() ? "the decoder gives no reason" : said)};
}

constexpr std::int64_t kMaxOfRare = 200'000'000;

/// Returns the highest compression ratio of a method for a raster; 0 for unsupported methods.
double MostPacked(std::uint16_t compression, std::uint32_t width) {
  switch (compression) {
    case COMPRESSION_NONE:
      return 1;
    case COMPRESSION_PACKBITS:
      return 64;
    case COMPRESSION_LZW:
      return 2600;  // 12 bits for the longest text in its table
    case COMPRESSION_DEFLATE:
    case COMPRESSION_ADOBE_DEFLATE:
      return 1032;
    case COMPRESSION_JPEG:
      return 3 * 512;  // a bit for each block of 8 x 8
    case COMPRESSION_CCITTRLE:
    case COMPRESSION_CCITTRLEW:
    case COMPRESSION_CCITTFAX3:
    case COMPRESSION_CCITTFAX4:
      return static_cast<double>(width) + 8;  // a bit for a row
    default:
      return 0;
  }
}

/// Checks that the file's size fits its header.
Result<void> CheckPacked(const Tiff& tiff, const PageLayout& layout, std::uintmax_t file_bytes) {
  const auto compression = Tag<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  const double packed = MostPacked(compression, static_cast<std::uint32_t>(layout.width));
  if (packed == 0) {
    return Fail(
        fmt::format("it is packed in a way (TIFF's compression {}) that is not read; save it with "
                    "LZW, Deflate, JPEG or without packing",
                    compression));
  }
  return CheckRaster(layout, packed, file_bytes);
}

// Reads any format that the library supports, through four bytes a pixel.
Result<Page> ReadRare(const Tiff& tiff, PageLayout layout, const PageReadOptions& options,
                      const std::string& said) {
  PageReadOptions fewer = options;
  fewer.most_pixels = std::min(fewer.most_pixels, kMaxOfRare);
  layout.samples = 4;
  layout.bits = 8;
  layout.white_is_zero = false;
  auto page = MakePage(layout, fewer);
  if (!page) return page;
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(layout.width * layout.height));
  if (TIFFReadRGBAImageOriented(tiff.get(), static_cast<std::uint32_t>(layout.width),
                                static_cast<std::uint32_t>(layout.height), pixels.data(),
                                ORIENTATION_TOPLEFT, 1) != 1) {
    return tl::unexpected(EndsEarly(0, said));
  }
  std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(layout.width));
  for (int y = 0; y < page->height; ++y) {
    for (std::size_t x = 0; x < static_cast<std::size_t>(layout.width); ++x) {
      const std::uint32_t pixel =
          pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(layout.width) + x];
      row[4 * x] = static_cast<std::uint8_t>(TIFFGetR(pixel));
      row[4 * x + 1] = static_cast<std::uint8_t>(TIFFGetG(pixel));
      row[4 * x + 2] = static_cast<std::uint8_t>(TIFFGetB(pixel));
      row[4 * x + 3] = static_cast<std::uint8_t>(TIFFGetA(pixel));
    }
    FillRow(layout, row, y, *page);
  }
  return page;
}

// Reads rows in strips, as scanners write them.
Result<Page> ReadRows(const Tiff& tiff, const PageLayout& layout, const PageReadOptions& options,
                      const std::string& said) {
  auto page = MakePage(layout, options);
  if (!page) return page;
  const tmsize_t bytes = TIFFScanlineSize(tiff.get());
  const std::int64_t needed = (layout.width * layout.samples * layout.bits + 7) / 8;
  if (bytes < needed) return tl::unexpected(EndsEarly(0, said));
  std::vector<std::uint8_t> row(static_cast<std::size_t>(bytes));
  for (int y = 0; y < page->height; ++y) {
    if (TIFFReadScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(y)) != 1) {
      return tl::unexpected(EndsEarly(y, said));
    }
    FillRow(layout, row, y, *page);
  }
  return page;
}

Result<Page> ReadDirectory(const Tiff& tiff, const PageReadOptions& options,
                           std::uintmax_t file_bytes, const std::string& said) {
  PageLayout layout;
  layout.width = Tag<std::uint32_t>(tiff, TIFFTAG_IMAGEWIDTH, 0);
  layout.height = Tag<std::uint32_t>(tiff, TIFFTAG_IMAGELENGTH, 0);
  layout.samples = Tag<std::uint16_t>(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  layout.bits = Tag<std::uint16_t>(tiff, TIFFTAG_BITSPERSAMPLE, 1);
  TRY(CheckPacked(tiff, layout, file_bytes));
  const auto photometric = Tag<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  layout.white_is_zero = photometric == PHOTOMETRIC_MINISWHITE;
  const bool grey = photometric == PHOTOMETRIC_MINISWHITE || photometric == PHOTOMETRIC_MINISBLACK;
  const bool in_rows =
      TIFFIsTiled(tiff.get()) == 0 && (grey || photometric == PHOTOMETRIC_RGB) &&
      Tag<std::uint16_t>(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_CONTIG &&
      Tag<std::uint16_t>(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) == SAMPLEFORMAT_UINT &&
      (layout.bits == 1 || layout.bits == 8 || layout.bits == 16);
  auto page =
      in_rows ? ReadRows(tiff, layout, options, said) : ReadRare(tiff, layout, options, said);
  if (page) TakeResolution(tiff, *page);
  return page;
}

}  // namespace

Result<void> ReadTiff(const std::filesystem::path& path, const PageReadOptions& options,
                      const PageSink& sink) {
  constexpr tmsize_t kMaxAtOnce = 4 * kMaxOfRare;  // bytes that a hostile header may ask for
  constexpr int kMaxDirectories = 1000;            // including thumbnails
  std::string said;
  const std::unique_ptr<TIFFOpenOptions, FreeOptions> open(TIFFOpenOptionsAlloc());
  TIFFOpenOptionsSetErrorHandlerExtR(open.get(), Keep, &said);
  TIFFOpenOptionsSetWarningHandlerExtR(open.get(), Ignore, nullptr);
  TIFFOpenOptionsSetMaxSingleMemAlloc(open.get(), kMaxAtOnce);
  // m: no memory map of the file, which may shrink during reading.
  const Tiff tiff(TIFFOpenExt(path.c_str(), "rm", open.get()));
  if (!tiff) return tl::unexpected(EndsEarly(0, said));
  std::error_code unknown;
  const std::uintmax_t file_bytes = std::filesystem::file_size(path, unknown);
  int pages = 0;
  int directories = 0;
  do {
    if (++directories > kMaxDirectories) {
      return Fail(fmt::format("it has more than {} pictures; give fewer", kMaxDirectories));
    }
    const auto kind = Tag<std::uint32_t>(tiff, TIFFTAG_SUBFILETYPE, 0);
    if ((kind & FILETYPE_REDUCEDIMAGE) != 0) continue;  // a thumbnail
    if (++pages > options.max_pages) {
      return Fail(fmt::format("it has more than {} pages; give fewer", options.max_pages));
    }
    auto page = TRY(ReadDirectory(tiff, options, unknown ? 0 : file_bytes, said));
    TRY(sink(std::move(page)));
  } while (TIFFReadDirectory(tiff.get()) == 1);
  if (pages == 0) return Fail("it holds no page; scan again");
  return {};
}

}  // namespace trammel::machine
