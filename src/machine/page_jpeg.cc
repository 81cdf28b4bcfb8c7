#include <fmt/format.h>
#include <jpeglib.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>

#include "machine/jpeg_outline.h"
#include "machine/page_decoders.h"

namespace trammel::machine {
namespace {

// The library's errors jump: nothing with a destructor may live in the functions that they jump out
// of.
struct Jpeg {
  jpeg_decompress_struct reader{};
  jpeg_error_mgr errors{};
  std::jmp_buf back{};
  char said[JMSG_LENGTH_MAX] = {};
  bool created = false;

  ~Jpeg() {
    if (created) jpeg_destroy_decompress(&reader);
  }
};

void Complain(j_common_ptr reader) {
  auto& jpeg = *static_cast<Jpeg*>(reader->client_data);
  reader->err->format_message(reader, jpeg.said);
  std::longjmp(jpeg.back, 1);
}

// A warning means that the decoder makes up what is missing.
void Warn(j_common_ptr reader, int level) {
  if (level < 0) Complain(reader);
}

bool Begin(Jpeg& jpeg, std::span<const std::uint8_t> bytes) {
  if (setjmp(jpeg.back) != 0) return false;
  jpeg.reader.err = jpeg_std_error(&jpeg.errors);
  jpeg.errors.error_exit = Complain;
  jpeg.errors.emit_message = Warn;
  jpeg.reader.client_data = &jpeg;
  jpeg_create_decompress(&jpeg.reader);
  jpeg.created = true;
  jpeg.reader.client_data = &jpeg;
  jpeg_mem_src(&jpeg.reader, bytes.data(), bytes.size());
  jpeg_read_header(&jpeg.reader, TRUE);
  return true;
}

bool Start(Jpeg& jpeg) {
  if (setjmp(jpeg.back) != 0) return false;
  jpeg_start_decompress(&jpeg.reader);
  return true;
}

bool ReadRow(Jpeg& jpeg, std::uint8_t* row) {
  if (setjmp(jpeg.back) != 0) return false;
  JSAMPROW rows[] = {row};
  return jpeg_read_scanlines(&jpeg.reader, rows, 1) == 1;
}

Error Damaged(const Jpeg& jpeg) {
  return {ErrorKind::kInput,
          fmt::format("the decoder rejects it ({}); copy it again, or scan again", jpeg.said)};
}

void TakeResolution(const Jpeg& jpeg, Page& page) {
  constexpr int kPerInch = 1;
  constexpr int kPerCentimetre = 2;
  const int unit = jpeg.reader.density_unit;
  if (jpeg.reader.saw_JFIF_marker && (unit == kPerInch || unit == kPerCentimetre) &&
      jpeg.reader.X_density > 0 && jpeg.reader.Y_density > 0) {
    const double per_inch = unit == kPerCentimetre ? 2.54 : 1;
    page.dpi_x = per_inch * jpeg.reader.X_density;
    page.dpi_y = per_inch * jpeg.reader.Y_density;
  }
}

}  // namespace

Result<Page> DecodeJpeg(std::span<const std::uint8_t> bytes, const PageReadOptions& options) {
  const auto outline = OutlineOf(bytes);
  if (!outline) return Fail(outline.error().message + "; copy it again, or scan again");
  if (auto cost = CheckCost(*outline, bytes.size()); !cost) return tl::unexpected(cost.error());
  Jpeg jpeg;
  if (!Begin(jpeg, bytes)) return tl::unexpected(Damaged(jpeg));
  const bool grey = jpeg.reader.jpeg_color_space == JCS_GRAYSCALE;
  if (!grey && jpeg.reader.num_components != 3) {
    return Fail(fmt::format("it has {} colours (CMYK?); save it as grey or RGB",
                            jpeg.reader.num_components));
  }
  jpeg.reader.out_color_space = grey ? JCS_GRAYSCALE : JCS_EXT_BGR;
  auto page = MakePage({jpeg.reader.image_width, jpeg.reader.image_height, grey ? 1 : 3}, options);
  if (!page) return page;
  constexpr std::int64_t kMostOfWhole = 200'000'000;
  if (jpeg_has_multiple_scans(&jpeg.reader) != 0 &&
      std::int64_t{page->width} * page->height > kMostOfWhole) {
    return Fail(fmt::format(
        "it has {} x {} px, and of a progressive JPEG at most {} megapixels are read; save it as "
        "TIFF, PNG or baseline JPEG",
        page->width, page->height, kMostOfWhole / 1'000'000));
  }
  TakeResolution(jpeg, *page);
  if (!Start(jpeg)) return tl::unexpected(Damaged(jpeg));
  for (int y = 0; y < page->height; ++y) {
    if (!ReadRow(jpeg, RowOf(*page, y))) return tl::unexpected(Damaged(jpeg));
  }
  return page;
}

}  // namespace trammel::machine
