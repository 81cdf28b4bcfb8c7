#include "image/jpeg_writer.h"

#include <fmt/format.h>

#include <cmath>

#include "base/check.h"
#include "image/jpeg_compressor.h"

namespace trammel::image {
namespace {

bool Compress(const PageView& pixels, const JpegOptions& options, int dpi, JpegCompressor& writer) {
  if (setjmp(writer.back) != 0) return false;
  writer.Create();
  jpeg_compress_struct& jpeg = writer.jpeg;
  jpeg.image_width = static_cast<JDIMENSION>(pixels.width);
  jpeg.image_height = static_cast<JDIMENSION>(pixels.height);
  jpeg.input_components = pixels.channels;
  jpeg.in_color_space = pixels.channels == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, options.quality, TRUE);
  jpeg.optimize_coding = options.own_tables ? TRUE : FALSE;
  if (dpi > 0) {
    constexpr UINT8 kPerInch = 1;
    jpeg.density_unit = kPerInch;
    jpeg.X_density = jpeg.Y_density = static_cast<UINT16>(dpi);
  }
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    // libjpeg's interface has no read-only rows, but it does not write to them.
    auto* row = const_cast<JSAMPROW>(pixels.row(static_cast<int>(jpeg.next_scanline)));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

}  // namespace

Result<void> EncodeJpeg(const PageView& pixels, const JpegOptions& options,
                        std::vector<std::uint8_t>& jpeg) {
  const long dpi = options.dpi ? std::lround(*options.dpi) : 0;
  TRAMMEL_CHECK(options.quality >= 1 && options.quality <= 100, "JPEG quality {}", options.quality);
  TRAMMEL_CHECK(dpi >= (options.dpi ? 1 : 0) && dpi <= 65535, "{} dpi", dpi);
  TRAMMEL_CHECK(pixels.channels == 1 || pixels.channels == 3, "{} channels", pixels.channels);
  if (pixels.width < 1 || pixels.height < 1 || pixels.width > JPEG_MAX_DIMENSION ||
      pixels.height > JPEG_MAX_DIMENSION) {
    return Fail(fmt::format("a JPEG of {} x {} px; 1 to {} px a side can be written", pixels.width,
                            pixels.height, JPEG_MAX_DIMENSION));
  }
  JpegCompressor writer(jpeg);
  if (!Compress(pixels, options, static_cast<int>(dpi), writer)) {
    return Fail(fmt::format("a JPEG of {} x {} px could not be encoded ({})", pixels.width,
                            pixels.height, writer.said));
  }
  return {};
}

}  // namespace trammel::image
