// Whatever LinuxCNC's shell answers, line by line. The first byte chooses what is asked of it.
#include <stop_token>

#include "fuzz.h"
#include "machine/linuxcnc/linuxcnc.h"
#include "scripted_stream.h"

TRAMMEL_FUZZ_TARGET(linuxcnc_lines)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  if (size == 0) return 0;
  fuzz::SetStream(fuzz::Text(data + 1, size - 1), 0);
  machine::LinuxCncOptions options;
  options.spindle_locked_by_hand = true;
  const std::stop_token never;
  auto machine = machine::LinuxCnc::Connect(options, never);
  if (!fuzz::Good(machine)) return 0;
  constexpr double kFeed_mm_min = 3000;
  constexpr int kSlot = 2;
  switch (data[0]) {
    case 's':
      (void)fuzz::Good((*machine)->State(never));
      break;
    case 'm':
      (void)fuzz::Good((*machine)->MoveTo({10, 20, 5}, kFeed_mm_min, never));
      break;
    case 'r':
      (void)fuzz::Good((*machine)->ReadOffsets(kSlot, never));
      break;
    case 'w':
      (void)fuzz::Good((*machine)->WriteOffset(kSlot, {{1, 2, 3}, 4}, never));
      break;
    default:
      break;
  }
  return 0;
}
