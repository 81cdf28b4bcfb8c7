// A recording's video.
#include "machine/video/video_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(video_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("line.avi");
  file.Write(fuzz::Text(data, size));
  auto video = machine::VideoFile::Open(file.path());
  if (!fuzz::Good(video)) return 0;
  for (;;) {
    const auto frame = video->Next();
    if (!fuzz::Good(frame) || *frame == nullptr) return 0;
  }
}
