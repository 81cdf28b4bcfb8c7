// The result of an alignment, read again for a correction.
#include "part_alignment/files/alignment_result.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(alignment_result)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadAlignmentResult(file.path()));
  return 0;
}
