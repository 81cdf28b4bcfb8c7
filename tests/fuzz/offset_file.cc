// Measured tool offsets, read again to be applied.
#include "tool_offset/files/offset_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(offset_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadOffsetFile(file.path()));
  return 0;
}
