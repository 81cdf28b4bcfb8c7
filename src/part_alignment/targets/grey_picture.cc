#include "part_alignment/targets/grey_picture.h"

#include "base/check.h"

namespace trammel::part_alignment {

Page GreyPicture(int width, int height, std::span<const std::uint8_t> bgr) {
  Page page{width, height, 1, {}, {}, {}};
  page.samples.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  TRAMMEL_CHECK(bgr.size() == 3 * page.samples.size(), "{} bytes of {} x {} px", bgr.size(), width,
                height);
  for (std::size_t i = 0; i < page.samples.size(); ++i) {
    const std::uint8_t* pixel = &bgr[3 * i];
    page.samples[i] =
        static_cast<std::uint8_t>((29 * pixel[0] + 150 * pixel[1] + 77 * pixel[2] + 128) >> 8U);
  }
  return page;
}

}  // namespace trammel::part_alignment
