#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <cstring>
#include <string>

#include "machine/page_decoders.h"
#include "machine/png_outline.h"

namespace trammel::machine {
namespace {

// What the library's callbacks see. Its errors jump: nothing with a destructor may live in the
// functions that they jump out of.
struct Png {
  png_structp reader = nullptr;
  png_infop info = nullptr;
  std::span<const std::uint8_t> bytes;
  std::size_t at = 0;
  char said[200] = {};

  ~Png() { png_destroy_read_struct(&reader, &info, nullptr); }
};

void Complain(png_structp reader, png_const_charp message) {
  auto& png = *static_cast<Png*>(png_get_error_ptr(reader));
  std::strncpy(png.said, message, sizeof png.said - 1);
  png_longjmp(reader, 1);
}

void Ignore(png_structp /*reader*/, png_const_charp /*message*/) {}

void Give(png_structp reader, png_bytep out, std::size_t count) {
  auto& png = *static_cast<Png*>(png_get_io_ptr(reader));
  if (count > png.bytes.size() - png.at) png_error(reader, "it ends early");
  std::memcpy(out, png.bytes.data() + png.at, count);
  png.at += count;
}

bool Begin(Png& png) {
  if (setjmp(png_jmpbuf(png.reader)) != 0) return false;
  png_set_read_fn(png.reader, &png, Give);
  // Texts and profiles may be packed, and would be unpacked; nobody asks for them.
  constexpr char kRemarks[] = "eXIf\0hIST\0iCCP\0iTXt\0sPLT\0tEXt\0zTXt";
  png_set_keep_unknown_chunks(png.reader, PNG_HANDLE_CHUNK_NEVER,
                              reinterpret_cast<png_const_bytep>(kRemarks), 7);
  png_read_info(png.reader, png.info);
  png_set_expand(png.reader);  // palettes, 1 to 4 bits, transparent colours
  constexpr bool kLittleEndian = std::endian::native == std::endian::little;
  if (kLittleEndian && png_get_bit_depth(png.reader, png.info) == 16) png_set_swap(png.reader);
  png_read_update_info(png.reader, png.info);
  return true;
}

bool ReadRow(Png& png, std::uint8_t* row) {
  if (setjmp(png_jmpbuf(png.reader)) != 0) return false;
  png_read_row(png.reader, row, nullptr);
  return true;
}

Error Damaged(const Png& png) {
  return {ErrorKind::kInput,
          fmt::format("the decoder rejects it ({}); copy it again, or scan again", png.said)};
}

void TakeResolution(const Png& png, Page& page) {
  constexpr double kMetersPerInch = 0.0254;
  const double x = png_get_x_pixels_per_meter(png.reader, png.info);
  const double y = png_get_y_pixels_per_meter(png.reader, png.info);
  if (x > 0 && y > 0) {
    page.dpi_x = x * kMetersPerInch;
    page.dpi_y = y * kMetersPerInch;
  }
}

// Interlaced, a picture comes as seven smaller ones, whose pixels lie between one another.
Result<Page> FillPasses(Png& png, const PageLayout& layout, Page page) {
  std::vector<std::uint8_t> row(png_get_rowbytes(png.reader, png.info));
  for (int pass = 0; pass < PNG_INTERLACE_ADAM7_PASSES; ++pass) {
    const int first = PNG_PASS_START_COL(pass);
    const int step = PNG_PASS_COL_OFFSET(pass);
    if (page.width <= first) continue;  // it has no rows then
    for (int y = PNG_PASS_START_ROW(pass); y < page.height; y += PNG_PASS_ROW_OFFSET(pass)) {
      if (!ReadRow(png, row.data())) return tl::unexpected(Damaged(png));
      FillPixels(layout, row, y, first, step, page);
    }
  }
  return page;
}

Result<Page> Fill(Png& png, const PageLayout& layout, Page page) {
  if (png_get_interlace_type(png.reader, png.info) != PNG_INTERLACE_NONE) {
    return FillPasses(png, layout, std::move(page));
  }
  std::vector<std::uint8_t> row(png_get_rowbytes(png.reader, png.info));
  for (int y = 0; y < page.height; ++y) {
    if (!ReadRow(png, row.data())) return tl::unexpected(Damaged(png));
    FillRow(layout, row, y, page);
  }
  return page;
}

}  // namespace

Result<Page> DecodePng(std::span<const std::uint8_t> bytes, const PageReadOptions& options) {
  if (const auto outline = OutlineOfPng(bytes)) {
    if (auto cost = CheckCost(*outline, bytes.size()); !cost) return tl::unexpected(cost.error());
  }
  Png png;
  png.bytes = bytes;
  png.reader = png_create_read_struct(PNG_LIBPNG_VER_STRING, &png, Complain, Ignore);
  png.info = png.reader == nullptr ? nullptr : png_create_info_struct(png.reader);
  if (png.info == nullptr) return Fail("there is no memory for a PNG decoder");
  constexpr png_uint_32 kMostOfASide = 1'000'000;
  png_set_user_limits(png.reader, kMostOfASide, kMostOfASide);
  if (!Begin(png)) return tl::unexpected(Damaged(png));
  PageLayout layout;
  layout.width = png_get_image_width(png.reader, png.info);
  layout.height = png_get_image_height(png.reader, png.info);
  layout.samples = png_get_channels(png.reader, png.info);
  layout.bits = png_get_bit_depth(png.reader, png.info);
  auto page = MakePage(layout, options);
  if (!page) return page;
  TakeResolution(png, *page);
  return Fill(png, layout, std::move(*page));
}

}  // namespace trammel::machine
