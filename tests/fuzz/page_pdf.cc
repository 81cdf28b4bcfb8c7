// Scanned pages as PDF.
#include "page_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("page.pdf");
  fuzz::ReadAsPages(file, fuzz::Text(data, size));
  return 0;
}
