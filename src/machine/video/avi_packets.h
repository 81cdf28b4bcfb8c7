// The JPEG frames of an AVI file, without any library of videos.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "base/result.h"
#include "machine/video/video_module.h"

namespace trammel::machine {

/// Reads the chunks of an AVI in the order of the file, by their own sizes: indices and counts in
/// its heads are not believed. Of any size; OpenDML's further segments are read, too.
///
/// A frame's time is its place among the stream's chunks, empty ones included, at the rate that the
/// stream states; absent where it states none.
///
/// @param most_bytes  of a frame.
/// @returns null where the file is no AVI, or its first video is none of whole JPEG frames: another
///          reader may know it. Errors (kMeasurement): cut off, damaged heads, a frame of more
///          bytes. A recording that was killed ends where it was cut.
[[nodiscard]] Result<std::unique_ptr<VideoPackets>> OpenAviPackets(
    const std::filesystem::path& path, std::size_t most_bytes);

}  // namespace trammel::machine
