// Cuts the videos of a recording to what is read of them.
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::procedure {

/// Cuts a video (machine/video/video_cutter.h), once each of its lines reads well within the crop
/// and every frame's crop is the same to the bit in the cut. A whole frame stays every 6 s.
/// @param scan  with the crop and the lines of this video alone.
/// Errors, which leave the video whole: a line cannot be read, or its bead reaches out of the
/// crop; the video's, the disk's, kInterrupted.
[[nodiscard]] Result<void> CutLine(const std::filesystem::path& folder,
                                   const pressure_advance::Scan& scan, const std::stop_token& stop);

/// Cuts every video of a recording's scan.json by the crop that stands there. Videos that are not
/// cut yet at the stop stay whole.
/// @returns a sentence for each other video that stays whole.
[[nodiscard]] std::vector<std::string> CutRecording(const std::filesystem::path& folder,
                                                    const std::stop_token& stop);

}  // namespace trammel::procedure
