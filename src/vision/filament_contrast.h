// Measures the difference between filament and plate.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "vision/image.h"

namespace trammel::vision {

/// Contrast above which a pixel counts as filament, in spreads above the surroundings.
inline constexpr double kFilamentBegins = 0.25;

/// Returns brightness, blue, red and the two opponent colours, 8-bit: filament and plate differ in
/// at least one. For a grey picture only the brightness.
[[nodiscard]] std::vector<cv::Mat> ColourChannels(const cv::Mat& bgr);

/// Returns the difference from the surroundings, in units of their spread; float.
/// @param smooth_px  sigma before comparing. REQUIRES > 0.
/// @param window_px  side of the surroundings, odd.
[[nodiscard]] cv::Mat LocalContrast(const cv::Mat& channel, double smooth_px, int window_px);

/// True if blue, green and red are equal in every pixel, but for a JPEG's rounding.
[[nodiscard]] bool IsGrey(const BgrView& picture);

/// Replaces two of a grey picture's equal channels by the local spread of brightness: brightness
/// remains in the blue one; green and red are the spreads over about 2 and 4 px of a picture of
/// 1920 px. Translucent filament may be as bright as a textured plate, but is smooth.
/// @param picture  8-bit BGR. REQUIRES IsGrey.
[[nodiscard]] Frame WithTexture(const BgrView& picture);

/// Reverts WithTexture: brightness in all three channels.
void DropTexture(Frame& picture);

/// Weights of blue, green and red; filament is higher than the plate beside it.
using ColourWeights = std::array<double, 3>;

/// Computes Fisher's linear discriminant between filament and plate, of colours relative to their
/// surroundings, so that uneven light does not count as a difference.
/// @param picture   8-bit BGR.
/// @param filament  of the same size: 1 on filament, 0 beside it; may be partly wrong.
/// @param surroundings_px  side of the window that counts as surroundings, >= 3.
/// @returns weights that put filament 100 above the plate on average; nothing if either covers
///          less than 5 % or their colours do not differ.
[[nodiscard]] std::optional<ColourWeights> FindContrast(const BgrView& picture,
                                                        const GrayImage& filament,
                                                        int surroundings_px);

/// Returns the weighted sum of each pixel's colours.
[[nodiscard]] GrayImage Mix(const BgrView& picture, const ColourWeights& weights);

}  // namespace trammel::vision
