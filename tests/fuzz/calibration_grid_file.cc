// Pictures' points of a calibration grid.
#include "part_alignment/files/calibration_grid_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(calibration_grid_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadCalibrationGrid(file.path()));
  return 0;
}
