#include "image/png_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace trammel::image {
namespace {

constexpr std::size_t kSignature = 8;

std::uint32_t BigEndian(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8U | bytes[at + i];
  return value;
}

std::string_view NameOf(std::span<const std::uint8_t> chunk) {
  return {reinterpret_cast<const char*>(chunk.data()) + 4, 4};
}

}  // namespace

Result<PngOutline> OutlineOfPng(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kHeader = 26;
  if (bytes.size() < kHeader || NameOf(bytes.subspan(kSignature)) != "IHDR") {
    return Fail("it begins like a PNG, but has no header");
  }
  constexpr std::uint32_t kMost = 0x7FFFFFFF;
  PngOutline outline{BigEndian(bytes, 16), BigEndian(bytes, 20), 0};
  if (outline.width_px == 0 || outline.height_px == 0 || outline.width_px > kMost ||
      outline.height_px > kMost) {
    return Fail(fmt::format("its header states {} x {} px", outline.width_px, outline.height_px));
  }
  constexpr std::array<int, 7> kSamples = {1, 1, 3, 1, 2, 1, 4};  // by the kind of colour
  outline.bits = bytes[24] * kSamples[std::min<std::size_t>(bytes[25], kSamples.size() - 1)];
  return outline;
}

Result<void> CheckCost(const PngOutline& outline, std::size_t bytes) {
  constexpr double kMostPacked = 1032;  // of deflate
  const double raster =
      static_cast<double>(outline.width_px) * outline.height_px * std::max(outline.bits, 1) / 8;
  if (raster <= kMostPacked * static_cast<double>(bytes)) return {};
  return Fail(
      fmt::format("its header states {} x {} px, more than its {} bytes can hold; "
                  "it was cut off or is damaged: copy it again, or scan again",
                  outline.width_px, outline.height_px, bytes));
}

}  // namespace trammel::image
