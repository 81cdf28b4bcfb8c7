// The steps of finding a laser line: from pixels to a path of good candidates, and to each row's
// centre.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/frame.h"
#include "vision/band_column.h"
#include "vision/laser_line.h"

namespace trammel::vision {

/// Median absolute value times this is the sigma of a normal distribution.
inline constexpr float kMadToSigma = 1.4826F;
/// The matched filter's background is a box this many stripe sigmas to either side.
inline constexpr float kBackgroundReach = 4;

/// The shape of the workspace's images. The last band is filled up with its last row.
struct ImageSize {
  int width;
  int height;
  [[nodiscard]] int bands() const { return (height + kBandRows - 1) / kBandRows; }
  [[nodiscard]] std::size_t area() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  /// Values of all bands.
  [[nodiscard]] std::size_t stored() const { return column(bands(), 0); }
  /// Index of a band's column.
  [[nodiscard]] std::size_t column(int band, int x) const {
    return (static_cast<std::size_t>(band) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)) *
           kBandRows;
  }
  [[nodiscard]] std::size_t at(int x, int y) const {
    return column(y / kBandRows, x) + static_cast<std::size_t>(y % kBandRows);
  }
};

/// The median of |sample|, 0 for none; overwrites the sample. REQUIRES no NaN.
[[nodiscard]] float MedianMagnitude(std::span<float> sample);

/// What places a line within a row: the model's colours without those it subtracts. They tell the
/// line from white glints, but the core of a strong line is white itself, and subtracting them
/// there would hollow it out. After ExtractSignal().
[[nodiscard]] std::vector<float>& BrightnessOf(const StripeModel& model,
                                               LaserLineWorkspace& workspace);

/// Takes workspace.signal from the frame's colours, and what BrightnessOf() gives.
void ExtractSignal(const BgrView& frame, const StripeModel& model, LaserLineWorkspace& workspace);

/// workspace.response = Gaussian(sigma) * signal - box mean of the signal, per row; workspace.best
/// has the largest of each row.
/// @returns the response's robust sigma over the whole image, of which the stripe is a small part.
[[nodiscard]] float MatchedFilter(const ImageSize& size, float sigma,
                                  LaserLineWorkspace& workspace);

/// workspace.path: a column per row, with the least sum of (1 - response / the row's best) and the
/// price of steps. Rows without any response above options.detection * noise carry no weight.
void ShortestPath(const ImageSize& size, float sigma, float noise, const LaserLineOptions& options,
                  LaserLineWorkspace& workspace);

/// The response's robust sigma beside the path: beyond the reach of the line's own background box.
[[nodiscard]] float NoiseBesidePath(const ImageSize& size, float sigma,
                                    LaserLineWorkspace& workspace);

/// Whether the path's rows a … b (a <= b) hang together without a step.
[[nodiscard]] bool Connected(const std::vector<int>& path, int a, int b, float sigma);

/// Finds the maximum likelihood position of a Gaussian stripe in rows of the image, each near the
/// path; rows in which there is none stay as they are.
/// @param brightness  as BrightnessOf() gives it.
/// @param pixel_noise  1 sigma, grey levels.
void FitRows(const ImageSize& size, const std::vector<float>& brightness, std::span<const int> rows,
             float sigma, float pixel_noise, LaserLineWorkspace& workspace, LaserLine& line);

/// FindLaserLine() without what rows know of each other: each stands for itself, and its sigma is
/// as noise and speckle predict it. Of the frame it knows what ExtractSignal() took of it, by a
/// model of the same colours.
void FindRows(const ImageSize& size, const StripeModel& model, const LaserLineOptions& options,
              LaserLineWorkspace& workspace, LaserLine& line);

}  // namespace trammel::vision
