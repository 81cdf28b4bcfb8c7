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

/// What an image file says of itself in its first bytes.
struct ImageHeader {
  ImageFormat format = ImageFormat::kJpeg;
  int width_px = 0;   ///< >= 1, as stored: before any turn that EXIF asks for
  int height_px = 0;  ///< >= 1
};

struct ImageReadOptions {
  std::int64_t most_bytes = 256'000'000;      ///< of the file, > 0
  std::int64_t most_pixels = 200'000'000;     ///< of the image, > 0: twice a 100-megapixel camera
  std::int64_t reduce_above_px = 30'000'000;  ///< larger images are read at 1/2, 1/4 or 1/8 of
                                              ///< their size, down to about this many pixels
  /// Turns the picture as EXIF's orientation asks, for people. Measured pictures are the sensor's
  /// pixels: a camera that looks straight down writes any orientation, by chance.
  bool turn_by_exif = false;
};

/// Finds size and format without decoding. Input may be hostile. The message of a failure names
/// the format where it is another one.
[[nodiscard]] Result<ImageHeader> ReadImageHeader(std::span<const std::uint8_t> bytes);

/// Whether the picture's end is missing. A decoder fills what is missing with grey and says
/// nothing. REQUIRES bytes for which ReadImageHeader() gave `format`.
[[nodiscard]] bool EndsEarly(std::span<const std::uint8_t> bytes, ImageFormat format);

/// Decodes a JPEG or PNG as 8-bit BGR, in the sensor's pixels unless the options turn it.
/// Transparency is dropped, of 16 bits the upper 8 are taken, four inks are printed on white.
/// @returns errors (kInput): another format, no header, a size above the options' or one that so
///          few bytes cannot hold, a JPEG of too many scans, a file that ends early, whatever the
///          decoder rejects. All but the last is checked before anything is decoded.
/// Memory: 3 bytes per pixel of the result, twice that where it is laid on its side; also 3 of
/// the whole image for a PNG that is reduced, 6 for a progressive JPEG.
[[nodiscard]] Result<Frame> DecodeImage(std::span<const std::uint8_t> bytes,
                                        const ImageReadOptions& options = {});

/// The same from a file; messages name it.
[[nodiscard]] Result<Frame> ReadImageFile(const std::filesystem::path& path,
                                          const ImageReadOptions& options = {});

/// Refuses a size above the options'.
[[nodiscard]] Result<void> CheckPixels(int width_px, int height_px,
                                       const ImageReadOptions& options);

/// Refuses a size that a photo in so few bytes does not have: a thousand pixels in a byte is ten
/// times what the emptiest wall takes, and a bomb's sign.
[[nodiscard]] Result<void> CheckPacking(int width_px, int height_px, std::size_t bytes);

/// Shows the stored picture as EXIF's orientation, 1 … 8, asks for.
[[nodiscard]] Frame TurnedByExif(Frame frame, int orientation);

/// Side lengths by which a picture is reduced: 1, 2, 4 or 8, so that about enough pixels remain.
[[nodiscard]] int ReductionOf(int width_px, int height_px, const ImageReadOptions& options);

}  // namespace trammel::machine
