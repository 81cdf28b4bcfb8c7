// A part's ideal surfaces and scale bars.
#include "fuzz.h"
#include "memory_file.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/stl_file.h"

TRAMMEL_FUZZ_TARGET(part_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadPartFile(file.path(), files::ReadMeshFile));
  return 0;
}
