// A recording's AVI file, cut into its frames.
#include "machine/video/avi_packets.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(avi_packets)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  constexpr std::size_t kMostBytes = 1 << 20;
  static const fuzz::MemoryFile file("line.avi");
  file.Write(fuzz::Text(data, size));
  const auto packets = machine::OpenAviPackets(file.path(), kMostBytes);
  if (!fuzz::Good(packets) || *packets == nullptr) return 0;
  std::size_t bytes = 0;
  double last_s = -1;
  for (machine::VideoPacket packet;;) {
    const auto next = (*packets)->Next(packet);
    if (!fuzz::Good(next) || !*next) return 0;
    bytes += packet.bytes.size();
    fuzz::Require(!packet.bytes.empty() && bytes <= size, "each byte is part of one frame");
    const double time_s = packet.time_s.value_or(last_s + 1);
    fuzz::Require(time_s > last_s, "times ascend");
    last_s = time_s;
  }
}
