// Reads the frames of a recorded laser scan, as needed per line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "pressure_advance/laser/stripe_observation.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::procedure {

/// Maximum memory of one line's cropped frames.
inline constexpr std::size_t kMaxSweepBytes = std::size_t{1} << 30;

/// Size of a recording's frames; 0 if there are none.
struct FrameSize {
  int width = 0;
  int height = 0;
  std::string video;  ///< video that set it
};

/// Returns the path of a line's video. Errors (kMeasurement): a link leads out of the recording.
[[nodiscard]] Result<std::filesystem::path> VideoOf(const std::filesystem::path& folder,
                                                    const pressure_advance::ScanLine& line);

/// Returns the size of the first readable frame. Errors: the videos'.
[[nodiscard]] Result<FrameSize> SizeOf(const std::filesystem::path& folder,
                                       const pressure_advance::Scan& scan);

/// Reads all frames of one sweep, cropped and upright; unused ones are empty. REQUIRES scan.crop.
/// Errors: the video's; frames of another size than `size`, another number of them than in
/// scan.json, more than kMaxSweepBytes, or cut so that they lack the crop (all kMeasurement); a
/// crop beyond the frame (kInput).
[[nodiscard]] Result<std::vector<Frame>> ReadFrames(const std::filesystem::path& video,
                                                    const pressure_advance::Scan& scan,
                                                    const pressure_advance::ScanLine& line,
                                                    const FrameSize& size);

/// Finds the crop in whole frames of one line. Errors: the video's; memory as of some 16 whole
/// frames.
[[nodiscard]] Result<pressure_advance::FoundCrop> FindCropIn(
    const std::filesystem::path& folder, const pressure_advance::Scan& scan,
    const pressure_advance::ScanLine& line);

// Cuts a recording's videos to the part that is read.

/// Cuts every video of a recording's scan.json by the crop stored there. Videos not yet cut when
/// stopped remain whole.
/// @returns a sentence for each other video that remains whole.
[[nodiscard]] std::vector<std::string> CutRecording(const std::filesystem::path& folder,
                                                    const std::stop_token& stop);

}  // namespace trammel::procedure
