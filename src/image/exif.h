// EXIF entries needed to read pictures.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace trammel::image {

/// Finds the orientation in EXIF's TIFF structure. Input may be hostile.
/// @returns 1 … 8 (1: as stored; 6: to be rotated by 90° clockwise), 1 if none is stated.
[[nodiscard]] int ExifOrientation(std::span<const std::uint8_t> tiff);

/// Finds the 35 mm equivalent focal length, whole mm. Input may be hostile.
/// @returns 1 … 65535; absent if none is stated.
[[nodiscard]] std::optional<int> ExifFilmFocal_mm(std::span<const std::uint8_t> tiff);

}  // namespace trammel::image
