// Scanned pages as PNG.
#include "page_input.h"

TRAMMEL_FUZZ_TARGET(page_png)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("page.png");
  fuzz::ReadAsPages(file, fuzz::Text(data, size));
  return 0;
}
