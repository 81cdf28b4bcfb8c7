// Finds and fits a laser stripe in single rows.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "base/frame.h"
#include "vision/laser_line.h"

namespace trammel::vision {

/// Number of rows processed side by side: the workspace's images are stored in bands of so many
/// rows, in a band column by column. Operations along a row run along all of them.
inline constexpr int kBandRows = 8;

/// One column of a band, or one value a row. Uses the compiler's own vectors: clang 16 compiles
/// Eigen's expressions of this size into slow memory accesses.
class BandColumn {
 public:
  BandColumn() = default;  ///< zeros
  explicit BandColumn(float all) : low_(Half{} + all), high_(low_) {}

  [[nodiscard]] static BandColumn At(const float* from) {
    BandColumn column;
    std::memcpy(&column.low_, from, sizeof(Half));
    std::memcpy(&column.high_, from + kBandRows / 2, sizeof(Half));
    return column;
  }
  void Put(float* to) const {
    std::memcpy(to, &low_, sizeof(Half));
    std::memcpy(to + kBandRows / 2, &high_, sizeof(Half));
  }

  friend BandColumn operator+(const BandColumn& a, const BandColumn& b) {
    return {a.low_ + b.low_, a.high_ + b.high_};
  }
  friend BandColumn operator-(const BandColumn& a, const BandColumn& b) {
    return {a.low_ - b.low_, a.high_ - b.high_};
  }
  friend BandColumn operator*(const BandColumn& a, const BandColumn& b) {
    return {a.low_ * b.low_, a.high_ * b.high_};
  }
  friend BandColumn operator/(const BandColumn& a, const BandColumn& b) {
    return {a.low_ / b.low_, a.high_ / b.high_};
  }
  friend BandColumn operator+(const BandColumn& a, float b) { return a + BandColumn(b); }
  friend BandColumn operator-(const BandColumn& a, float b) { return a - BandColumn(b); }
  friend BandColumn operator*(const BandColumn& a, float b) { return a * BandColumn(b); }
  BandColumn& operator+=(const BandColumn& other) { return *this = *this + other; }
  BandColumn& operator-=(const BandColumn& other) { return *this = *this - other; }
  BandColumn& operator*=(const BandColumn& other) { return *this = *this * other; }

  friend BandColumn Larger(const BandColumn& a, const BandColumn& b) {
    return {a.low_ > b.low_ ? a.low_ : b.low_, a.high_ > b.high_ ? a.high_ : b.high_};
  }
  friend BandColumn Smaller(const BandColumn& a, const BandColumn& b) {
    return {a.low_ < b.low_ ? a.low_ : b.low_, a.high_ < b.high_ ? a.high_ : b.high_};
  }

 private:
  using Half [[gnu::vector_size(16)]] = float;
  BandColumn(const Half& low, const Half& high) : low_(low), high_(high) {}

  Half low_{};
  Half high_{};
};

/// Factor from the median absolute value to the sigma of a normal distribution.
inline constexpr float kMadToSigma = 1.4826F;
/// Half width of the box of the matched filter's background, in stripe sigmas.
inline constexpr float kBackgroundReach = 4;

/// Shape of the workspace's images. The last band is padded with its last row.
struct ImageSize {
  int width;
  int height;
  [[nodiscard]] int bands() const { return (height + kBandRows - 1) / kBandRows; }
  [[nodiscard]] std::size_t area() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  /// Returns the number of values of all bands.
  [[nodiscard]] std::size_t stored() const { return column(bands(), 0); }
  /// Returns the index of a band's column.
  [[nodiscard]] std::size_t column(int band, int x) const {
    return (static_cast<std::size_t>(band) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)) *
           kBandRows;
  }
  [[nodiscard]] std::size_t at(int x, int y) const {
    return column(y / kBandRows, x) + static_cast<std::size_t>(y % kBandRows);
  }
};

/// Returns the median of |sample|, 0 for none; overwrites the sample. REQUIRES no NaN.
[[nodiscard]] float MedianMagnitude(std::span<float> sample);

/// Computes a line's signal within a row: the model's colours without those it subtracts. They
/// separate the line from white glints, but a strong line's core is white itself; subtracting them
/// there would hollow it out. After ExtractSignal().
[[nodiscard]] std::vector<float>& BrightnessOf(const StripeModel& model,
                                               LaserLineWorkspace& workspace);

/// Computes workspace.signal, and the brightness for BrightnessOf(), from the frame's colours.
void ExtractSignal(const BgrView& frame, const StripeModel& model, LaserLineWorkspace& workspace);

/// Computes workspace.response = Gaussian(sigma) * signal - box mean of the signal, per row;
/// workspace.best is the maximum of each row.
/// @returns the response's robust sigma over the whole image, of which the stripe is a small part.
[[nodiscard]] float MatchedFilter(const ImageSize& size, float sigma,
                                  LaserLineWorkspace& workspace);

/// Computes workspace.path: a column per row, with the minimum sum of (1 - response / the row's
/// best) and the price of steps. Rows without any response above options.detection * noise have no
/// weight.
void ShortestPath(const ImageSize& size, float sigma, float noise, const LaserLineOptions& options,
                  LaserLineWorkspace& workspace);

/// Returns the response's robust sigma beside the path: beyond the reach of the line's own
/// background box.
[[nodiscard]] float NoiseBesidePath(const ImageSize& size, float sigma,
                                    LaserLineWorkspace& workspace);

/// True if the path's rows a … b (a <= b) are connected without a step.
[[nodiscard]] bool Connected(const std::vector<int>& path, int a, int b, float sigma);

/// Finds the maximum likelihood position of a Gaussian stripe in rows of the image, each near the
/// path; rows without one are unchanged.
/// @param brightness  as returned by BrightnessOf().
/// @param pixel_noise  1 sigma, grey levels.
void FitRows(const ImageSize& size, const std::vector<float>& brightness, std::span<const int> rows,
             float sigma, float pixel_noise, LaserLineWorkspace& workspace, LaserLine& line);

/// Does the same as FindLaserLine() for independent rows: each sigma is that predicted from noise
/// and speckle. Uses the frame only through ExtractSignal(), by a model of the same colours.
void FindRows(const ImageSize& size, const StripeModel& model, const LaserLineOptions& options,
              LaserLineWorkspace& workspace, LaserLine& line);

}  // namespace trammel::vision
