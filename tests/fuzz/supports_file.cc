// Supports of a part that are to be corrected.
#include "fuzz.h"
#include "memory_file.h"
#include "part_alignment/files/alignment_result.h"

TRAMMEL_FUZZ_TARGET(supports_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadSupportsFile(file.path()));
  return 0;
}
