// The steps of finding a laser line: from pixels to a path of good candidates, and to each row's
// centre.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/frame.h"
#include "vision/laser_line.h"

namespace trammel::vision {

/// Median absolute value times this is the sigma of a normal distribution.
inline constexpr float kMadToSigma = 1.4826F;
/// The matched filter's background is a box this many stripe sigmas to either side.
inline constexpr float kBackgroundReach = 4;

/// The shape of the workspace's images.
struct ImageSize {
  int width;
  int height;
  [[nodiscard]] std::size_t area() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  /// Index of the first pixel of row y.
  [[nodiscard]] std::size_t at(int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
};

/// The median of |sample|, 0 for none; overwrites the sample. REQUIRES no NaN.
[[nodiscard]] float MedianMagnitude(std::span<float> sample);

/// workspace.signal from the frame's colours.
void ExtractSignal(const BgrView& frame, const StripeModel& model, LaserLineWorkspace& workspace);

/// workspace.response = Gaussian(sigma) * signal - box mean of the signal, per row.
/// @returns the response's robust sigma over the whole image, of which the stripe is a small part.
[[nodiscard]] float MatchedFilter(const ImageSize& size, float sigma,
                                  LaserLineWorkspace& workspace);

/// workspace.path: a column per row, with the least sum of (1 - response / the row's best) and the
/// price of steps. Rows without any response above options.detection * noise carry no weight.
void ShortestPath(const ImageSize& size, float sigma, float noise, const LaserLineOptions& options,
                  LaserLineWorkspace& workspace);

/// Whether the path's rows a … b (a <= b) hang together without a step.
[[nodiscard]] bool Connected(const std::vector<int>& path, int a, int b, float sigma);

/// FindLaserLine() without what rows know of each other: each stands for itself, and its sigma is
/// as noise and speckle predict it.
void FindRows(const BgrView& frame, const StripeModel& model, const LaserLineOptions& options,
              LaserLineWorkspace& workspace, LaserLine& line);

}  // namespace trammel::vision
