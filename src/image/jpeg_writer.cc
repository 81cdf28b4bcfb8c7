#include "image/jpeg_writer.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <new>

// After cstdio: they want FILE declared before them.
#include <jerror.h>
#include <jpeglib.h>

#include "base/check.h"

namespace trammel::image {
namespace {

// libjpeg's errors jump: nothing with a destructor may live in the functions that they jump out of.
struct Writer {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_destination_mgr destination{};
  std::jmp_buf back{};
  char said[JMSG_LENGTH_MAX] = {};
  std::array<JOCTET, 1 << 14> chunk{};
  std::vector<std::uint8_t>& bytes;

  explicit Writer(std::vector<std::uint8_t>& to) : bytes(to) { bytes.clear(); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { jpeg_destroy_compress(&jpeg); }  // does nothing where it was not created

  bool Append(std::size_t count) {
    try {
      bytes.insert(bytes.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(count));
      return true;
    } catch (const std::bad_alloc&) {
      return false;
    }
  }
};

Writer& WriterOf(void* client_data) { return *static_cast<Writer*>(client_data); }

void Complain(j_common_ptr jpeg) {
  Writer& writer = WriterOf(jpeg->client_data);
  jpeg->err->format_message(jpeg, writer.said);
  std::longjmp(writer.back, 1);
}

void BeginChunk(j_compress_ptr jpeg) {
  Writer& writer = WriterOf(jpeg->client_data);
  writer.destination.next_output_byte = writer.chunk.data();
  writer.destination.free_in_buffer = writer.chunk.size();
}

boolean TakeChunk(j_compress_ptr jpeg) {
  Writer& writer = WriterOf(jpeg->client_data);
  if (!writer.Append(writer.chunk.size())) ERREXIT1(jpeg, JERR_OUT_OF_MEMORY, 0);
  BeginChunk(jpeg);
  return TRUE;
}

void TakeRest(j_compress_ptr jpeg) {
  Writer& writer = WriterOf(jpeg->client_data);
  if (!writer.Append(writer.chunk.size() - writer.destination.free_in_buffer)) {
    ERREXIT1(jpeg, JERR_OUT_OF_MEMORY, 0);
  }
}

bool Compress(const PageView& pixels, const JpegOptions& options, int dpi, Writer& writer) {
  jpeg_compress_struct& jpeg = writer.jpeg;
  jpeg.err = jpeg_std_error(&writer.errors);
  writer.errors.error_exit = Complain;
  if (setjmp(writer.back) != 0) return false;
  jpeg.client_data = &writer;
  jpeg_create_compress(&jpeg);  // keeps err and client_data
  writer.destination.init_destination = BeginChunk;
  writer.destination.empty_output_buffer = TakeChunk;
  writer.destination.term_destination = TakeRest;
  jpeg.dest = &writer.destination;
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
    // libjpeg takes no read-only rows; it does not write to them.
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
  Writer writer(jpeg);
  if (!Compress(pixels, options, static_cast<int>(dpi), writer)) {
    return Fail(fmt::format("a JPEG of {} x {} px could not be encoded ({})", pixels.width,
                            pixels.height, writer.said));
  }
  return {};
}

}  // namespace trammel::image
