#include "support/test_pictures.h"

#include <cstddef>
#include <cstdio>
#include <cstdlib>

// After stdio, which it needs and does not include.
#include <jpeglib.h>

namespace trammel::test {

std::string JpegOf(const Frame& frame, int quality) {
  jpeg_compress_struct compress{};
  jpeg_error_mgr errors{};
  compress.err = jpeg_std_error(&errors);  // ends the test program, as is meant
  jpeg_create_compress(&compress);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&compress, &bytes, &size);
  compress.image_width = static_cast<JDIMENSION>(frame.width);
  compress.image_height = static_cast<JDIMENSION>(frame.height);
  compress.input_components = 3;
  compress.in_color_space = JCS_EXT_BGR;
  jpeg_set_defaults(&compress);
  jpeg_set_quality(&compress, quality, TRUE);
  jpeg_start_compress(&compress, TRUE);
  for (int y = 0; y < frame.height; ++y) {
    auto* row =
        const_cast<JSAMPROW>(frame.bgr.data()) + static_cast<std::size_t>(3) * y * frame.width;
    jpeg_write_scanlines(&compress, &row, 1);
  }
  jpeg_finish_compress(&compress);
  jpeg_destroy_compress(&compress);
  std::string jpeg(reinterpret_cast<const char*>(bytes), size);
  std::free(bytes);
  return jpeg;
}

Frame TestPicture(int width, int height, int phase) {
  Frame frame(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        frame.row(y)[3 * x + c] =
            static_cast<std::uint8_t>(40 + (x + 3 * phase) % 64 * 2 + y % 32 + 10 * c);
      }
    }
  }
  return frame;
}

}  // namespace trammel::test
