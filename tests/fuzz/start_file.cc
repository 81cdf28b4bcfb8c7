// start.json of a guided sheet, read to go on with it.
#include "tool_offset/files/start_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(start_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("start.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadStart(file.path().parent_path()));
  return 0;
}
