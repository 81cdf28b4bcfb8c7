// Scanned pages as PDF.
#include "page_input.h"

/// As in the process that reads PDFs: what asks for more memory than that has gets none.
extern "C" const char* __asan_default_options() {
  return "allocator_may_return_null=1:max_allocation_size_mb=256";
}

TRAMMEL_FUZZ_TARGET(page_pdf)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("page.pdf");
  fuzz::ReadAsPages(file, fuzz::Text(data, size));
  return 0;
}
