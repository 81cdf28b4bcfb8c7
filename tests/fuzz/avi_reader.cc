// A recording's AVI file, cut into its frames.
#include "machine/video/avi_reader.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(avi_reader)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  constexpr std::size_t kMostBytes = 1 << 20;
  static const fuzz::MemoryFile file("line.avi");
  file.Write(fuzz::Text(data, size));
  auto avi = machine::AviReader::Open(file.path(), kMostBytes);
  if (!fuzz::Good(avi)) return 0;
  std::size_t bytes = 0;
  double last_s = -1;
  for (machine::AviFrame frame;;) {
    const auto next = avi->Next(frame);
    if (!fuzz::Good(next) || !*next) return 0;
    bytes += frame.bytes.size();
    fuzz::Require(!frame.bytes.empty() && bytes <= size, "each byte is part of one frame");
    const double time_s = frame.time_s.value_or(last_s + 1);
    fuzz::Require(time_s > last_s, "times ascend");
    last_s = time_s;
  }
}
