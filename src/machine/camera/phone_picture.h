// Reads photos as phones store them: JPEG, PNG, WebP and HEIC files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "base/frame.h"
#include "base/result.h"
#include "machine/camera/image_file.h"

namespace trammel::machine {

/// What the modules with libwebp and libheif do: trammel-webp.so, trammel-heif.so. Both decode
/// DecodePhoto()'s contract for a picture of their format.
struct PictureModule {
  Result<Frame> (*decode)(std::span<const std::uint8_t> bytes, const ImageReadOptions& options);
};

/// DecodeImage(), and WebP and HEIC beside it, which modules loaded on demand decode. The picture
/// is turned as viewers show it: people name its sides. Of a file with several pictures the main
/// one is taken; an animation is refused.
/// @returns errors (kInput): those of DecodeImage(), and where the module or its libraries are
///          missing.
[[nodiscard]] Result<Frame> DecodePhoto(std::span<const std::uint8_t> bytes,
                                        const ImageReadOptions& options = {});

/// The same from a file; messages name it.
[[nodiscard]] Result<Frame> ReadPhotoFile(const std::filesystem::path& path,
                                          const ImageReadOptions& options = {});

}  // namespace trammel::machine
