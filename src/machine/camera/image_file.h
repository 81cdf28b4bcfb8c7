// Reads photos: JPEG and PNG files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "base/frame.h"
#include "base/result.h"

namespace trammel::machine {

enum class ImageFormat { kJpeg, kPng };

/// Format and size of an image file, from its first bytes.
struct ImageHeader {
  ImageFormat format = ImageFormat::kJpeg;
  int width_px = 0;   ///< >= 1, as stored: before any turn that EXIF asks for
  int height_px = 0;  ///< >= 1
};

struct ImageReadOptions {
  std::int64_t max_bytes = 256'000'000;       ///< file size, > 0
  std::int64_t most_pixels = 200'000'000;     ///< per image, > 0: twice a 100-megapixel camera
  std::int64_t reduce_above_px = 30'000'000;  ///< larger images are read at 1/2, 1/4 or 1/8 of
                                              ///< their size, down to about this many pixels
  /// Rotates the picture by EXIF's orientation, for display. Measured pictures are the sensor's
  /// pixels: a camera that looks straight down writes a random orientation.
  bool turn_by_exif = false;
};

/// Finds size and format without decoding. Input may be hostile. The error names the format if it
/// is another one.
[[nodiscard]] Result<ImageHeader> ReadImageHeader(std::span<const std::uint8_t> bytes);

/// True if the picture's end is missing. A decoder silently fills it with grey. REQUIRES bytes for
/// which ReadImageHeader() returned `format`.
[[nodiscard]] bool EndsEarly(std::span<const std::uint8_t> bytes, ImageFormat format);

/// Decodes a JPEG or PNG as 8-bit BGR, in the sensor's pixels unless the options rotate it. Drops
/// transparency, uses the upper 8 of 16 bits, prints four inks on white.
/// @returns errors (kInput): another format, no header, a size above the options' or one that so
///          few bytes cannot hold, a JPEG of too many scans, a truncated file, whatever the
///          decoder rejects. All but the last is checked before decoding.
/// Memory: 3 bytes per pixel of the result, twice that if it is rotated by a quarter turn; also 3
/// of the whole image for a PNG that is reduced, 6 for a progressive JPEG.
[[nodiscard]] Result<Frame> DecodeImage(std::span<const std::uint8_t> bytes,
                                        const ImageReadOptions& options = {});

/// Does the same for a file, which messages name.
[[nodiscard]] Result<Frame> ReadImageFile(const std::filesystem::path& path,
                                          const ImageReadOptions& options = {});

/// Rejects a size above the options'.
[[nodiscard]] Result<void> CheckPixels(int width_px, int height_px,
                                       const ImageReadOptions& options);

/// Rejects an implausible compression ratio: a thousand pixels a byte is ten times that of the
/// plainest wall, and a sign of a decompression bomb.
[[nodiscard]] Result<void> CheckPacking(int width_px, int height_px, std::size_t bytes);

/// Rotates and mirrors the stored picture by EXIF's orientation, 1 … 8.
[[nodiscard]] Frame TurnedByExif(Frame frame, int orientation);

/// Returns the divisor of the side lengths: 1, 2, 4 or 8, so that about enough pixels remain.
[[nodiscard]] int ReductionOf(int width_px, int height_px, const ImageReadOptions& options);

}  // namespace trammel::machine
