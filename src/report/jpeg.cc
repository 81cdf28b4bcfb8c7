#include "report/jpeg.h"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>

// jpeglib.h wants FILE and size_t declared before it.
#include <jpeglib.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/check.h"

namespace trammel::report {
namespace {

struct ErrorManager {
  jpeg_error_mgr base;
  std::jmp_buf failed;
};

[[noreturn]] void JumpOut(j_common_ptr info) {
  std::longjmp(reinterpret_cast<ErrorManager*>(info->err)->failed, 1);
}

/// Runs no destructor of its own between setjmp and longjmp: everything with one is the caller's.
bool Compress(const BgrView& picture, int quality, std::vector<std::uint8_t>& row,
              unsigned char** bytes, unsigned long* size) {
  jpeg_compress_struct info{};
  ErrorManager errors{};
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = JumpOut;
  if (setjmp(errors.failed) != 0) {
    jpeg_destroy_compress(&info);
    return false;
  }
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, bytes, size);
  info.image_width = static_cast<JDIMENSION>(picture.width);
  info.image_height = static_cast<JDIMENSION>(picture.height);
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  info.optimize_coding = TRUE;
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < info.image_height) {
    const std::uint8_t* from = picture.row(static_cast<int>(info.next_scanline));
    for (std::size_t i = 0; i < row.size(); i += 3) {
      row[i] = from[i + 2];
      row[i + 1] = from[i + 1];
      row[i + 2] = from[i];
    }
    JSAMPROW line = row.data();
    jpeg_write_scanlines(&info, &line, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  return true;
}

}  // namespace

std::string EncodeJpeg(const BgrView& picture, int quality) {
  TRAMMEL_CHECK(picture.width > 0 && picture.height > 0 && quality >= 1 && quality <= 100,
                "{} x {} px at quality {}", picture.width, picture.height, quality);
  std::vector<std::uint8_t> row(std::size_t{3} * static_cast<std::size_t>(picture.width));
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool done = Compress(picture, quality, row, &bytes, &size);
  std::string jpeg;
  if (done) jpeg.assign(reinterpret_cast<const char*>(bytes), size);
  std::free(bytes);
  TRAMMEL_CHECK(done, "libjpeg encodes no {} x {} px", picture.width, picture.height);
  return jpeg;
}

}  // namespace trammel::report
