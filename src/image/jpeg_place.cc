#include "image/jpeg_place.h"

#include <algorithm>
#include <string_view>

#include "base/check.h"

namespace trammel::image {
namespace {

constexpr std::string_view kName("trammel part\0", 13);
static_assert(kName.size() + 8 == kPlaceBytes);

}  // namespace

std::array<std::uint8_t, kPlaceBytes> FormatPlace(const JpegPlace& place) {
  std::array<std::uint8_t, kPlaceBytes> bytes{};
  auto at = std::copy(kName.begin(), kName.end(), bytes.begin());
  for (const int number : {place.x, place.y, place.whole_width, place.whole_height}) {
    TRAMMEL_CHECK(number >= 0 && number <= 0xFFFF, "a place at {} px", number);
    *at++ = static_cast<std::uint8_t>(number >> 8);
    *at++ = static_cast<std::uint8_t>(number);
  }
  return bytes;
}

std::optional<JpegPlace> ParsePlace(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kPlaceBytes || !std::equal(kName.begin(), kName.end(), bytes.begin())) {
    return std::nullopt;
  }
  const auto number = [&](std::size_t i) {
    const std::size_t at = kName.size() + 2 * i;
    return bytes[at] << 8 | bytes[at + 1];
  };
  return JpegPlace{number(0), number(1), number(2), number(3)};
}

bool Fits(const JpegPlace& place, const JpegGrid& cut) {
  const auto fits = [](int begin, int length, int whole, int mcu) {
    const bool to_the_end = begin + length == whole;
    return begin + length <= whole && begin % mcu == 0 && (to_the_end || length % mcu == 0);
  };
  return fits(place.x, cut.width, place.whole_width, cut.mcu_width) &&
         fits(place.y, cut.height, place.whole_height, cut.mcu_height);
}

PixelRect ExactPart(const JpegPlace& place, const JpegGrid& cut) {
  struct Range {
    int begin;
    int length;
  };
  const auto within = [](int begin, int length, int whole, int margin) -> Range {
    const int first = begin == 0 ? 0 : begin + margin;
    const int last = begin + length == whole ? whole : begin + length - margin;
    return {first, std::max(0, last - first)};
  };
  const Range x = within(place.x, cut.width, place.whole_width, cut.chroma_width());
  const Range y = within(place.y, cut.height, place.whole_height, cut.chroma_height());
  return {x.begin, y.begin, x.length, y.length};
}

PixelRect CutAround(const PixelRect& part, const JpegGrid& whole) {
  TRAMMEL_CHECK(part.x >= 0 && part.y >= 0 && part.width > 0 && part.height > 0 &&
                    part.x <= whole.width - part.width && part.y <= whole.height - part.height,
                "part {}x{} at ({}, {}) of {}x{} px", part.width, part.height, part.x, part.y,
                whole.width, whole.height);
  const auto begin = [](int first, int mcu) { return std::max(0, first) / mcu * mcu; };
  const auto end = [](int last, int most, int mcu) {
    return std::min(most, (last + mcu - 1) / mcu * mcu);
  };
  int x = begin(part.x - whole.chroma_width(), whole.mcu_width);
  const int y = begin(part.y - whole.chroma_height(), whole.mcu_height);
  const int x_end = end(part.x + part.width + whole.chroma_width(), whole.width, whole.mcu_width);
  const int y_end =
      end(part.y + part.height + whole.chroma_height(), whole.height, whole.mcu_height);
  // Decoders do not interpolate in rows of one or two chroma samples.
  if (x > 0 && x_end - x <= 2 * whole.chroma_width()) x -= whole.mcu_width;
  return {x, y, x_end - x, y_end - y};
}

}  // namespace trammel::image
