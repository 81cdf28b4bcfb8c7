// Cuts the videos of a recording to what is read of them.
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

namespace trammel::procedure {

/// Cuts every video of a recording's scan.json by the crop that stands there. Videos that are not
/// cut yet at the stop stay whole.
/// @returns a sentence for each other video that stays whole.
[[nodiscard]] std::vector<std::string> CutRecording(const std::filesystem::path& folder,
                                                    const std::stop_token& stop);

}  // namespace trammel::procedure
