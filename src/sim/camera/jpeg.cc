#include "sim/camera/jpeg.h"

#include "base/check.h"
#include "image/jpeg_writer.h"

namespace trammel::sim {

void EncodeJpeg(const BgrView& view, int quality, std::vector<std::uint8_t>& jpeg) {
  const auto encoded = image::EncodeJpeg({view.data, view.width, view.height, 3, view.stride},
                                         {.quality = quality, .dpi = {}}, jpeg);
  TRAMMEL_CHECK(encoded, "{}", encoded.error().message);
}

}  // namespace trammel::sim
