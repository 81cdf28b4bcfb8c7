// patterns.jsonl: when a pattern was printed.
#include "pressure_advance/files/pattern_prints.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(pattern_prints)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("patterns.jsonl");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::LastPatternPrint(file.path(), "voron", files::PrintsFor::kEither));
  return 0;
}
