// A camera and its calibration.
#include "part_alignment/files/camera_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(camera_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("camera.json");
  file.Write(fuzz::Text(data, size));
  const auto camera = files::ReadCameraFile(file.path());
  if (!fuzz::Good(camera)) return 0;
  const std::string text = files::CameraFileText(*camera);
  file.Write(text);
  const auto again = files::ReadCameraFile(file.path());
  fuzz::Require(fuzz::Good(again), "a camera that was written can be read");
  fuzz::Require(files::CameraFileText(*again) == text, "a camera reads back as it was written");
  return 0;
}
