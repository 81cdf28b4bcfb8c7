// The times of a recording's frames.
#include "fuzz.h"
#include "machine/video/video_writer.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(frame_times)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("line.times");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(machine::ReadFrameTimes(file.path()));
  return 0;
}
