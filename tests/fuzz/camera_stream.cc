// A camera's whole answer: head, parts, frames. The first byte says in how large pieces it comes.
#include <stop_token>

#include "fuzz.h"
#include "machine/camera/camera.h"
#include "machine/camera/mjpeg_stream.h"
#include "scripted_stream.h"

TRAMMEL_FUZZ_TARGET(camera_stream)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  if (size == 0) return 0;
  fuzz::SetStream(fuzz::Text(data + 1, size - 1), 1 + data[0]);
  const std::stop_token never;
  auto camera = machine::OpenMjpegStream("http://camera/stream", machine::CameraOptions{}, never);
  if (!fuzz::Good(camera)) return 0;
  for (;;) {
    const auto frame = (*camera)->Next(1, never);
    (void)(*camera)->Describe();
    if (!fuzz::Good(frame) || !*frame) return 0;
    fuzz::Require((*frame)->fault == machine::FrameFault::kNotAnImage || (*frame)->width_px >= 1,
                  "a picture has a size");
  }
}
