// Raw pixels as industrial cameras send them: pixel format, width, height and padding, then bytes.
#include "machine/camera/raw_picture.h"

#include <cstring>

#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(raw_picture)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  struct Head {
    std::uint32_t pixel_format;
    std::int16_t width;
    std::int16_t height;
    std::uint16_t padding;
  } head{};
  constexpr std::size_t kHead = 10;
  if (size < kHead) return 0;
  std::memcpy(&head, data, kHead);
  machine::RawPicture raw;
  raw.pixel_format = head.pixel_format;
  raw.width_px = head.width;
  raw.height_px = head.height;
  raw.row_padding_bytes = head.padding;
  raw.bytes = {data + kHead, size - kHead};
  (void)machine::PixelFormatName(raw.pixel_format);
  constexpr int kQuality = 90;
  for (const int quality : {0, kQuality}) {
    const auto picture = machine::ToPicture(raw, quality);
    fuzz::Require(!fuzz::Good(picture) || machine::IsReadPixelFormat(raw.pixel_format),
                  "only formats that are read give a picture");
  }
  return 0;
}
