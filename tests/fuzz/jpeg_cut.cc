// JPEG frames cut to a part: x, y, width and height of the part in 16 bits each, then the picture.
#include <algorithm>
#include <cstring>
#include <vector>

#include "fuzz.h"
#include "image/jpeg_cutter.h"
#include "image/jpeg_outline.h"
#include "image/jpeg_reader.h"

namespace {

using trammel::PixelRect;
using trammel::image::JpegDamage;
using trammel::image::JpegPixels;
using trammel::image::JpegReader;

constexpr double kMostPixels = 1 << 20;

std::vector<std::uint8_t> Pixels(std::span<const std::uint8_t> jpeg, const PixelRect& part) {
  auto reader = JpegReader::Open(jpeg, JpegDamage::kRefuse);
  if (!reader || !reader->StartPart(JpegPixels::kBgr, part)) return {};
  const auto row_bytes = 3 * static_cast<std::size_t>(part.width);
  std::vector<std::uint8_t> pixels(row_bytes * static_cast<std::size_t>(part.height));
  for (int y = 0; y < part.height; ++y) {
    if (!reader->ReadRow(pixels.data() + static_cast<std::size_t>(y) * row_bytes)) return {};
  }
  return pixels;
}

}  // namespace

TRAMMEL_FUZZ_TARGET(jpeg_cut)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  std::int16_t numbers[4];
  if (size < sizeof numbers) return 0;
  std::memcpy(numbers, data, sizeof numbers);
  const PixelRect part{numbers[0], numbers[1], numbers[2], numbers[3]};
  const std::span<const std::uint8_t> jpeg(data + sizeof numbers, size - sizeof numbers);
  const auto outline = image::OutlineOf(jpeg);
  if (!fuzz::Good(outline) || !image::CheckCost(*outline, jpeg.size()) ||
      static_cast<double>(outline->width_px) * outline->height_px > kMostPixels) {
    return 0;
  }
  std::vector<std::uint8_t> bytes;
  if (!fuzz::Good(image::CutJpeg(jpeg, part, bytes))) return 0;
  const auto cut = JpegReader::Open(bytes, JpegDamage::kRefuse);
  fuzz::Require(cut.has_value(), "a cut is a JPEG");
  const auto place = cut->header().place.value_or(image::JpegPlace{});
  const auto pixels = Pixels(bytes, {part.x - place.x, part.y - place.y, part.width, part.height});
  fuzz::Require(!pixels.empty() && pixels == Pixels(jpeg, part), "a cut has the whole's pixels");
  return 0;
}
