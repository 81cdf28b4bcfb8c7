// Photos and frames: JPEG and PNG.
#include "fuzz.h"
#include "machine/camera/image_file.h"

TRAMMEL_FUZZ_TARGET(photo)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::span<const std::uint8_t> bytes(data, size);
  const auto header = machine::ReadImageHeader(bytes);
  if (fuzz::Good(header)) {
    fuzz::Require(header->width_px >= 1 && header->height_px >= 1, "a picture has a size");
    (void)machine::EndsEarly(bytes, header->format);
  }
  const auto frame = machine::DecodeImage(bytes);
  fuzz::Require(!fuzz::Good(frame) || header, "a picture without a header is not decoded");
  return 0;
}
