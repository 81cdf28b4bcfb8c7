// A video decoded by libav.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.h"
#include "machine/video/video_module.h"

namespace trammel::machine {

/// VideoModule::open. Sets libav's log level to quiet for the whole process, the one global that it
/// offers.
[[nodiscard]] Result<std::unique_ptr<VideoDecoder>> OpenLibavVideo(
    const std::filesystem::path& path, const VideoLimits& limits);

}  // namespace trammel::machine
