// Raw pixels, as industrial cameras send them, made into a picture that others can read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// One picture in memory, as GenICam cameras deliver it.
struct RawPicture {
  std::uint32_t pixel_format = 0;  ///< by the pixel format naming convention (PFNC) of GenICam
  int width_px = 0;
  int height_px = 0;
  std::size_t row_padding_bytes = 0;  ///< behind each row
  std::span<const std::uint8_t> bytes;
};

/// Whether ToPicture() reads it.
[[nodiscard]] bool IsReadPixelFormat(std::uint32_t pixel_format);

/// "Mono8, BayerGR8, …": those that are read, for messages.
[[nodiscard]] std::string ReadPixelFormats();

/// "Mono8"; where it is not one of those that are read, its number.
[[nodiscard]] std::string PixelFormatName(std::uint32_t pixel_format);

/// Bayer patterns are interpolated (bilinear), everything else keeps its values.
/// @param jpeg_quality  0: PNG, without a loss (grey stays one channel); 1 … 100: JPEG.
/// @returns errors (kMachine): a format that is not read, a size below 1 px or above 50
///          megapixels, fewer bytes than the size needs.
[[nodiscard]] Result<std::vector<std::uint8_t>> ToPicture(const RawPicture& raw, int jpeg_quality);

}  // namespace trammel::machine
