// Cameras of OpenCV, ROS and mrcal.
#include "part_alignment/files/foreign_camera_file.h"

#include "fuzz.h"
#include "part_alignment/camera/camera_convert.h"

TRAMMEL_FUZZ_TARGET(foreign_camera_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  (void)fuzz::Good(files::ParseForeignCamera(fuzz::Text(data, size), "camera"));
  return 0;
}
