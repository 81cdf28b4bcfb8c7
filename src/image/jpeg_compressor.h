// libjpeg's compressor with output into a vector, for JPEG writers.
#pragma once

#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

// After cstdio: it requires the declaration of FILE.
#include <jpeglib.h>

namespace trammel::image {

/// Compressor whose errors jump to `back`: a function that calls setjmp() on it may contain no
/// object with a destructor.
struct JpegCompressor {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_destination_mgr destination{};
  std::jmp_buf back{};
  char said[JMSG_LENGTH_MAX] = {};  ///< libjpeg's message
  std::array<JOCTET, 1 << 14> chunk{};
  std::vector<std::uint8_t>& bytes;

  explicit JpegCompressor(std::vector<std::uint8_t>& to) : bytes(to) { bytes.clear(); }
  JpegCompressor(const JpegCompressor&) = delete;
  JpegCompressor& operator=(const JpegCompressor&) = delete;
  ~JpegCompressor() { jpeg_destroy_compress(&jpeg); }  // does nothing where it was not created

  /// Makes `jpeg` write to `bytes`. REQUIRES setjmp(back) before.
  void Create();

  /// Adds the first `count` bytes of `chunk`. @returns false if memory runs out.
  [[nodiscard]] bool Append(std::size_t count);

  /// Records libjpeg's message and jumps: an error_exit for any of its structures whose client_data
  /// is a JpegCompressor.
  static void Complain(j_common_ptr jpeg);
};

}  // namespace trammel::image
