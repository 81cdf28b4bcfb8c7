#include "image/jpeg_compressor.h"

#include <jerror.h>

#include <new>

namespace trammel::image {
namespace {

JpegCompressor& CompressorOf(void* client_data) {
  return *static_cast<JpegCompressor*>(client_data);
}

void BeginChunk(j_compress_ptr jpeg) {
  JpegCompressor& compressor = CompressorOf(jpeg->client_data);
  compressor.destination.next_output_byte = compressor.chunk.data();
  compressor.destination.free_in_buffer = compressor.chunk.size();
}

boolean TakeChunk(j_compress_ptr jpeg) {
  JpegCompressor& compressor = CompressorOf(jpeg->client_data);
  if (!compressor.Append(compressor.chunk.size())) ERREXIT1(jpeg, JERR_OUT_OF_MEMORY, 0);
  BeginChunk(jpeg);
  return TRUE;
}

void TakeRest(j_compress_ptr jpeg) {
  JpegCompressor& compressor = CompressorOf(jpeg->client_data);
  if (!compressor.Append(compressor.chunk.size() - compressor.destination.free_in_buffer)) {
    ERREXIT1(jpeg, JERR_OUT_OF_MEMORY, 0);
  }
}

}  // namespace

bool JpegCompressor::Append(std::size_t count) {
  try {
    bytes.insert(bytes.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(count));
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

void JpegCompressor::Complain(j_common_ptr jpeg) {
  JpegCompressor& compressor = CompressorOf(jpeg->client_data);
  jpeg->err->format_message(jpeg, compressor.said);
  std::longjmp(compressor.back, 1);
}

void JpegCompressor::Create() {
  jpeg.err = jpeg_std_error(&errors);
  errors.error_exit = Complain;
  jpeg.client_data = this;
  jpeg_create_compress(&jpeg);  // keeps err and client_data
  destination.init_destination = BeginChunk;
  destination.empty_output_buffer = TakeChunk;
  destination.term_destination = TakeRest;
  jpeg.dest = &destination;
}

}  // namespace trammel::image
