// The history of tool offsets.
#include "tool_offset/files/offset_history.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(offset_history)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("offsets.jsonl");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadOffsetChanges(file.path()));
  return 0;
}
