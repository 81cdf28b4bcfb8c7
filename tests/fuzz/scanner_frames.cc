// What a scanner's driver says of its frames, and the samples that it then sends.
#include <cstring>

#include "fuzz.h"
#include "machine/scanner/frame_assembler.h"
#include "machine/scanner/sane_scan.h"

TRAMMEL_FUZZ_TARGET(scanner_frames)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  machine::PageReadOptions limits;
  limits.most_pixels = 100'000;
  machine::FrameAssembler page(limits);
  std::span<const std::uint8_t> rest(data, size);
  const auto take = [&rest](std::size_t count) {
    const auto bytes = rest.first(std::min(count, rest.size()));
    rest = rest.subspan(bytes.size());
    return bytes;
  };
  // Each frame: a head of eight bytes, how many samples come, and these.
  constexpr std::size_t kHead = 8;
  while (rest.size() >= kHead) {
    const auto head = take(kHead);
    machine::FrameHead frame;
    frame.colors = static_cast<machine::FrameHead::Colors>(head[0] % 5);
    frame.bits = static_cast<std::int8_t>(head[1]);
    frame.last = head[2] & 1;
    frame.width_px = static_cast<std::int8_t>(head[3]);
    frame.lines = static_cast<std::int8_t>(head[4]);
    std::int16_t line = 0;
    std::memcpy(&line, head.data() + 5, sizeof line);
    frame.bytes_per_line = line;
    if (!fuzz::Good(page.Begin(frame))) return 0;
    if (!fuzz::Good(page.Add(take(head[7])))) return 0;
    if (!fuzz::Good(page.Add(take(head[7] / 2)))) return 0;
    if (!fuzz::Good(page.End())) return 0;
    page.Tell([](double share) {
      fuzz::Require(share >= 0 && share <= 1, "a share is one of the whole");
    });
  }
  (void)fuzz::Good(page.Finish());
  return 0;
}
