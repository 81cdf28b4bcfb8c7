// Recordings in a camera's place: the frames of a video file, or the pictures of a folder.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.h"
#include "machine/camera/camera.h"

namespace trammel::machine {

/// MJPEG in AVI, whose frames come out as they are stored. Another video is an error with the
/// command that converts it. Errors are kMeasurement. A recording that was killed ends where it was
/// cut.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenVideoFrames(
    const std::filesystem::path& path, const CameraOptions& options);

/// The files *.jpg, *.jpeg and *.png of a folder in the order of their names, in which numbers
/// count as numbers (frame9 before frame10). The sequence is the place in that order; there are no
/// times.
[[nodiscard]] Result<std::unique_ptr<FrameSource>> OpenImageFolder(
    const std::filesystem::path& folder, const CameraOptions& options);

}  // namespace trammel::machine
