// The frames of a recorded laser scan, as its lines want them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "pressure_advance/laser/stripe_sight.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::procedure {

/// Cropped frames of one line may take this much memory.
inline constexpr std::size_t kMaxSweepBytes = std::size_t{1} << 30;

/// Size of a recording's frames; 0 where there are none.
struct FrameSize {
  int width = 0;
  int height = 0;
  std::string video;  ///< that set it
};

/// The video of a line. Errors (kMeasurement): a link leads out of the recording.
[[nodiscard]] Result<std::filesystem::path> VideoOf(const std::filesystem::path& folder,
                                                    const pressure_advance::ScanLine& line);

/// The size of the first frame of all that may be looked at. Errors: the videos'.
[[nodiscard]] Result<FrameSize> SizeOf(const std::filesystem::path& folder,
                                       const pressure_advance::Scan& scan);

/// All frames of one sweep, cropped and upright; those that must not be looked at are empty.
/// REQUIRES scan.crop. Errors: the video's; frames of another size than `size`, another number of
/// them than scan.json says, more than kMaxSweepBytes, or cut so that they do not hold the crop
/// (all kMeasurement); a crop beyond the frame (kInput).
[[nodiscard]] Result<std::vector<Frame>> ReadFrames(const std::filesystem::path& video,
                                                    const pressure_advance::Scan& scan,
                                                    const pressure_advance::ScanLine& line,
                                                    const FrameSize& size);

/// Looks for the crop in whole frames of one line. Errors: the video's; memory as of some 16 whole
/// frames.
[[nodiscard]] Result<pressure_advance::FoundCrop> FindCropIn(
    const std::filesystem::path& folder, const pressure_advance::Scan& scan,
    const pressure_advance::ScanLine& line);

// Cuts the videos of a recording to what is read of them.

/// Cuts every video of a recording's scan.json by the crop that stands there. Videos that are not
/// cut yet at the stop stay whole.
/// @returns a sentence for each other video that stays whole.
[[nodiscard]] std::vector<std::string> CutRecording(const std::filesystem::path& folder,
                                                    const std::stop_token& stop);

}  // namespace trammel::procedure
