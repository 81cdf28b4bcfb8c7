// Measured points as tables or as JSON.
#include "fuzz.h"
#include "memory_file.h"
#include "part_alignment/files/part_fit_file.h"

TRAMMEL_FUZZ_TARGET(point_table)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  (void)fuzz::Good(files::ParsePointTable(text, "points.csv"));
  static const fuzz::MemoryFile file("points.json");
  file.Write(text);
  (void)fuzz::Good(files::ReadPointTable(file.path()));
  return 0;
}
