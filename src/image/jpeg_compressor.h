// libjpeg's compressor into a vector, for what writes JPEG.
#pragma once

#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

// After cstdio: it wants FILE declared before it.
#include <jpeglib.h>

namespace trammel::image {

/// A compressor whose errors jump to `back`: nothing with a destructor may live in a function that
/// calls setjmp() on it.
struct JpegCompressor {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_destination_mgr destination{};
  std::jmp_buf back{};
  char said[JMSG_LENGTH_MAX] = {};  ///< why it jumped
  std::array<JOCTET, 1 << 14> chunk{};
  std::vector<std::uint8_t>& bytes;

  explicit JpegCompressor(std::vector<std::uint8_t>& to) : bytes(to) { bytes.clear(); }
  JpegCompressor(const JpegCompressor&) = delete;
  JpegCompressor& operator=(const JpegCompressor&) = delete;
  ~JpegCompressor() { jpeg_destroy_compress(&jpeg); }  // does nothing where it was not created

  /// Makes `jpeg` write to `bytes`. REQUIRES setjmp(back) before.
  void Create();

  /// Adds the first `count` bytes of `chunk`. @returns false where there is no memory for them.
  [[nodiscard]] bool Append(std::size_t count);

  /// Notes libjpeg's message and jumps: an error_exit of any of its structures whose client_data is
  /// a JpegCompressor.
  static void Complain(j_common_ptr jpeg);
};

}  // namespace trammel::image
