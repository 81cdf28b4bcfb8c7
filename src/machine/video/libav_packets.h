// The packets of an MJPEG video in any container that is read, through libav.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.h"
#include "machine/video/video_module.h"

namespace trammel::machine {

/// VideoModule::open_packets.
[[nodiscard]] Result<std::unique_ptr<VideoPackets>> OpenLibavPackets(
    const std::filesystem::path& path, std::size_t most_bytes);

}  // namespace trammel::machine
