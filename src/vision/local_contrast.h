// Differences from the surroundings, in every colour channel.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace trammel::vision {

/// Spreads above the surroundings from which on a pixel counts as filament.
inline constexpr double kFilamentBegins = 0.25;

/// Brightness, blue, red and the two opponent colours, 8-bit: filament and plate differ in at least
/// one. Of a grey picture the brightness only.
[[nodiscard]] std::vector<cv::Mat> ColourChannels(const cv::Mat& bgr);

/// Difference from the surroundings, in units of its own spread there; float.
/// @param smooth_px  sigma before comparing. REQUIRES > 0.
/// @param window_px  side of the surroundings, odd.
[[nodiscard]] cv::Mat LocalContrast(const cv::Mat& channel, double smooth_px, int window_px);

}  // namespace trammel::vision
