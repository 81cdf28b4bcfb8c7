// The entries of EXIF that pictures are read by.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace trammel::image {

/// Finds the orientation in a TIFF structure, as EXIF has it. Input may be hostile.
/// @returns 1 … 8 (1: as stored; 6: to be turned by 90° clockwise), 1 where none is stated.
[[nodiscard]] int ExifOrientation(std::span<const std::uint8_t> tiff);

/// Finds the focal length as cameras give it for film of 35 mm, whole mm. Input may be hostile.
/// @returns 1 … 65535; nothing where none is stated.
[[nodiscard]] std::optional<int> ExifFilmFocal_mm(std::span<const std::uint8_t> tiff);

}  // namespace trammel::image
