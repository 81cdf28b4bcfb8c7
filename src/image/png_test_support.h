// Pages as PNG, for tests of what reads pictures.
#pragma once

#include <string>

#include "base/check.h"
#include "base/page.h"
#include "image/png_writer.h"

namespace trammel::image {

/// The bytes of a page as PNG, with the resolution that it states.
[[nodiscard]] inline std::string PngOf(const Page& page) {
  const auto png = EncodePng(page.view(), page.dpi_x, page.dpi_y);
  TRAMMEL_CHECK(png.has_value(), "a page of {} x {} px", page.width, page.height);
  return {png->begin(), png->end()};
}

}  // namespace trammel::image
