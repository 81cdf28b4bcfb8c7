#include <fmt/format.h>
#include <png.h>

#include <utility>
#include <vector>

#include "image/jpeg_outline.h"
#include "image/jpeg_reader.h"
#include "image/png_reader.h"
#include "machine/page/page_decoders.h"

namespace trammel::machine {
namespace {

tl::unexpected<Error> Damaged(const Error& error) {
  return Fail(error.message + "; copy it again, or scan again");
}

}  // namespace

Result<Page> DecodeJpeg(std::span<const std::uint8_t> bytes, const PageReadOptions& options) {
  const auto outline = image::OutlineOf(bytes);
  if (!outline) return Damaged(outline.error());
  TRY(CheckCost(*outline, bytes.size()));
  auto jpeg = image::JpegReader::Open(bytes, image::JpegDamage::kRefuse);
  if (!jpeg) return Damaged(jpeg.error());
  const image::JpegHeader& header = jpeg->header();
  const bool grey = header.components == 1;
  if (!grey && header.components != 3) {
    return Fail(
        fmt::format("it has {} colours (CMYK?); save it as grey or RGB", header.components));
  }
  auto page = MakePage({header.width_px, header.height_px, grey ? 1 : 3}, options);
  if (!page) return page;
  constexpr std::int64_t kMaxOfWhole = 200'000'000;
  if (header.multiple_scans && std::int64_t{page->width} * page->height > kMaxOfWhole) {
    return Fail(fmt::format(
        "it has {} x {} px, and of a progressive JPEG at most {} megapixels are read; save it as "
        "TIFF, PNG or baseline JPEG",
        page->width, page->height, kMaxOfWhole / 1'000'000));
  }
  page->dpi_x = header.dpi_x;
  page->dpi_y = header.dpi_y;
  page->film_focal_mm = header.film_focal_mm;
  const auto pixels = grey ? image::JpegPixels::kGrey : image::JpegPixels::kBgr;
  if (auto started = jpeg->Start(pixels); !started) return Damaged(started.error());
  for (int y = 0; y < page->height; ++y) {
    if (auto read = jpeg->ReadRow(RowOf(*page, y)); !read) return Damaged(read.error());
  }
  return page;
}

namespace {

// Fills an interlaced picture from its seven smaller passes with interleaved pixels.
Result<Page> FillPasses(image::PngReader& png, const PageLayout& layout, Page page) {
  std::vector<std::uint8_t> row(png.row_bytes());
  for (int pass = 0; pass < PNG_INTERLACE_ADAM7_PASSES; ++pass) {
    const int first = PNG_PASS_START_COL(pass);
    const int step = PNG_PASS_COL_OFFSET(pass);
    if (page.width <= first) continue;  // it has no rows then
    for (int y = PNG_PASS_START_ROW(pass); y < page.height; y += PNG_PASS_ROW_OFFSET(pass)) {
      if (auto read = png.ReadRow(row.data()); !read) return Damaged(read.error());
      FillPixels(layout, row, y, first, step, page);
    }
  }
  return page;
}

Result<Page> Fill(image::PngReader& png, const PageLayout& layout, Page page) {
  std::vector<std::uint8_t> row(png.row_bytes());
  for (int y = 0; y < page.height; ++y) {
    if (auto read = png.ReadRow(row.data()); !read) return Damaged(read.error());
    FillRow(layout, row, y, page);
  }
  return page;
}

}  // namespace

Result<Page> DecodePng(std::span<const std::uint8_t> bytes, const PageReadOptions& options) {
  if (const auto outline = image::OutlineOfPng(bytes)) TRY(CheckCost(*outline, bytes.size()));
  auto png = image::PngReader::Open(bytes, image::PngPixels::kAsStored);
  if (!png) return Damaged(png.error());
  const image::PngHeader& header = png->header();
  const PageLayout layout{header.width_px, header.height_px, header.samples, header.bits};
  auto page = TRY(MakePage(layout, options));
  page.dpi_x = header.dpi_x;
  page.dpi_y = header.dpi_y;
  return header.interlaced ? FillPasses(*png, layout, std::move(page))
                           : Fill(*png, layout, std::move(page));
}

}  // namespace trammel::machine
