// An MJPEG video decoded by libjpeg.
#pragma once

#include <filesystem>
#include <memory>

#include "machine/video/video_module.h"

namespace trammel::machine {

/// Decodes the packets of a video; VideoFile's contract. `path` is for messages.
[[nodiscard]] std::unique_ptr<VideoDecoder> DecodeMjpeg(const std::filesystem::path& path,
                                                        std::unique_ptr<VideoPackets> packets,
                                                        const VideoLimits& limits);

}  // namespace trammel::machine
