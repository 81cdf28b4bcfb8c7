// Scanned pages as JPEG.
#include "page_input.h"

TRAMMEL_FUZZ_TARGET(page_jpeg)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("page.jpeg");
  fuzz::ReadAsPages(file, fuzz::Text(data, size));
  return 0;
}
