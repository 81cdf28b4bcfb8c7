// Reads camera files of other programs: OpenCV's YAML, XML and JSON (ROS's, too), mrcal's
// .cameramodel.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "part_alignment/camera/camera_convert.h"

namespace trammel::files {

/// Reads a camera file; its content, not its name, decides the format. mrcal's lens models are
/// PINHOLE and OPENCV4, 5 and 8. Errors (kInput) name file and key: no camera matrix or picture
/// size, a matrix with skew, another lens model (fisheye, splined, thin prism), invalid numbers.
[[nodiscard]] Result<part_alignment::OpenCvCamera> ReadForeignCameraFile(
    const std::filesystem::path& path);
[[nodiscard]] Result<part_alignment::OpenCvCamera> ParseForeignCamera(std::string_view text,
                                                                      const std::string& file);

}  // namespace trammel::files
