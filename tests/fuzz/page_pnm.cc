// Scanned pages as PNM.
#include "page_input.h"

TRAMMEL_FUZZ_TARGET(page_pnm)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("page.pnm");
  fuzz::ReadAsPages(file, fuzz::Text(data, size));
  return 0;
}
