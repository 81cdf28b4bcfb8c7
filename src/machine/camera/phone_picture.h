// Reads photos in the formats of phones: JPEG, PNG, WebP and HEIC files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "base/frame.h"
#include "base/result.h"
#include "machine/camera/image_file.h"

namespace trammel::machine {

/// Interface of the modules with libwebp and libheif: trammel-webp.so, trammel-heif.so. Both fulfil
/// DecodePhoto()'s contract for a picture of their format.
struct PictureModule {
  Result<Frame> (*decode)(std::span<const std::uint8_t> bytes, const ImageReadOptions& options);
};

/// Decodes as DecodeImage(), and also WebP and HEIC, by modules loaded on demand. The picture is
/// rotated as viewers show it, since people name its sides. Decodes the main picture of several;
/// rejects an animation.
/// @returns errors (kInput): those of DecodeImage(), and a missing module or
///          library.
[[nodiscard]] Result<Frame> DecodePhoto(std::span<const std::uint8_t> bytes,
                                        const ImageReadOptions& options = {});

/// Does the same for a file, which messages name.
[[nodiscard]] Result<Frame> ReadPhotoFile(const std::filesystem::path& path,
                                          const ImageReadOptions& options = {});

}  // namespace trammel::machine
