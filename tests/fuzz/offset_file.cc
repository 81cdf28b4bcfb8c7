// Measured tool offsets, read again to be applied.
#include "store/offset_file.h"

#include "fuzz.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(store::ReadOffsetFile(file.path()));
  return 0;
}
