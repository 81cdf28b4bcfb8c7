// The parts of a camera's stream. The first byte says in how large pieces they come.
#include "fuzz.h"
#include "machine/camera/camera.h"
#include "machine/camera/frame_check.h"
#include "machine/camera/mjpeg_stream.h"
#include "machine/net/multipart.h"

TRAMMEL_FUZZ_TARGET(multipart_stream)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  if (size < 2) return 0;
  const std::size_t piece = 1 + data[0];
  const auto parts = fuzz::Parts(fuzz::Text(data + 1, size - 1), 2);
  const auto boundary = machine::MultipartBoundary(parts[0]);
  machine::MultipartLimits limits;
  limits.preamble_bytes = 200;
  limits.header_bytes = 300;
  limits.body_bytes = 1000;
  machine::MultipartReader reader(boundary.value_or(""), limits);
  machine::FrameChecker checker;
  const auto take = [&](machine::MultipartPart part) {
    machine::CapturedFrame frame;
    frame.arrival_s = part.arrival_s;
    frame.image = std::move(part.body);
    machine::ReadFrameFields(part.fields, frame);
    checker.Check(frame);
  };
  std::span<const std::uint8_t> rest(reinterpret_cast<const std::uint8_t*>(parts[1].data()),
                                     parts[1].size());
  std::size_t bytes = 0;
  for (double now_s = 0; !rest.empty(); now_s += 1) {
    const std::size_t count = std::min(piece, rest.size());
    reader.Feed(rest.first(count), now_s);
    rest = rest.subspan(count);
    for (;;) {
      auto part = reader.Take();
      if (!fuzz::Good(part)) return 0;
      if (!*part) break;
      bytes += (*part)->body.size();
      fuzz::Require((*part)->arrival_s <= now_s, "a part comes with its bytes, not before");
      take(std::move(**part));
    }
  }
  if (auto last = reader.TakeRest()) {
    bytes += last->body.size();
    take(std::move(*last));
  }
  fuzz::Require(bytes <= size, "parts are no longer than what brought them");
  return 0;
}
