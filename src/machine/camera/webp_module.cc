// trammel-webp.so: WebP pictures by libwebp.
#include <fmt/format.h>
#include <webp/decode.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <string_view>

#include "image/exif.h"
#include "machine/camera/image_file.h"
#include "machine/camera/phone_picture.h"
#include "machine/module/module.h"

namespace trammel::machine {
namespace {

/// Returns the orientation in the EXIF chunk, 1 … 8; 1 without one.
int OrientationOf(std::span<const std::uint8_t> bytes) {
  const auto whole = [&](std::size_t at) {
    return static_cast<std::size_t>(bytes[at]) | static_cast<std::size_t>(bytes[at + 1]) << 8U |
           static_cast<std::size_t>(bytes[at + 2]) << 16U |
           static_cast<std::size_t>(bytes[at + 3]) << 24U;
  };
  constexpr std::size_t kFirstChunk = 12, kHead = 8;
  for (std::size_t at = kFirstChunk; at + kHead <= bytes.size();) {
    const std::size_t size = std::min(whole(at + 4), bytes.size() - at - kHead);
    if (std::memcmp(bytes.data() + at, "EXIF", 4) == 0) {
      std::span<const std::uint8_t> exif = bytes.subspan(at + kHead, size);
      constexpr std::string_view kPrefix("Exif\0\0", 6);  // JPEG's prefix, kept by some programs
      if (exif.size() >= kPrefix.size() &&
          std::memcmp(exif.data(), kPrefix.data(), kPrefix.size()) == 0) {
        exif = exif.subspan(kPrefix.size());
      }
      return image::ExifOrientation(exif);
    }
    at += kHead + size + size % 2;
  }
  return 1;
}

Result<Frame> Decode(std::span<const std::uint8_t> bytes, const ImageReadOptions& options) {
  WebPDecoderConfig config;
  if (WebPInitDecoderConfig(&config) == 0) return Fail("libwebp is of another version");
  if (WebPGetFeatures(bytes.data(), bytes.size(), &config.input) != VP8_STATUS_OK) {
    return Fail("it is a WebP without a usable header; copy it again");
  }
  if (config.input.has_animation != 0) return Fail("it is an animated WebP; give a still picture");
  const int width = config.input.width, height = config.input.height;
  TRY(CheckPixels(width, height, options));
  TRY(CheckPacking(width, height, bytes.size()));
  const int reduction = ReductionOf(width, height, options);
  try {
    Frame frame(std::max(width / reduction, 1), std::max(height / reduction, 1));
    if (reduction > 1) {
      config.options.use_scaling = 1;
      config.options.scaled_width = frame.width;
      config.options.scaled_height = frame.height;
    }
    config.output.colorspace = MODE_BGR;
    config.output.is_external_memory = 1;
    config.output.u.RGBA = {frame.bgr.data(), 3 * frame.width, frame.bgr.size()};
    const VP8StatusCode status = WebPDecode(bytes.data(), bytes.size(), &config);
    WebPFreeDecBuffer(&config.output);
    if (status == VP8_STATUS_OUT_OF_MEMORY) throw std::bad_alloc();
    if (status != VP8_STATUS_OK) {
      return Fail(fmt::format("the WebP is {}; copy it again",
                              status == VP8_STATUS_NOT_ENOUGH_DATA ? "cut off" : "damaged"));
    }
    return TurnedByExif(std::move(frame), OrientationOf(bytes));
  } catch (const std::bad_alloc&) {
    return Fail(fmt::format("its {} x {} px do not fit into memory; shrink it", width, height));
  }
}

constexpr PictureModule kModule = {Decode};

}  // namespace
}  // namespace trammel::machine

TRAMMEL_MODULE(trammel::machine::kModule)
