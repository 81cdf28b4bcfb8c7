// Straight lines through stretches of a force curve, and the elbow between two of them.
#pragma once

#include <cstddef>
#include <span>

namespace trammel::tap {

/// Samples that the decomposition works on: times from the pull-back's start, forces from a level
/// of the tap itself, so that single precision holds them to 1 us and 0.1 mgf. Half the memory of
/// the recording, and twice as many in a cache line.
struct Samples {
  std::span<const float> time_s;
  std::span<const float> force_g;

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
};

/// The first sample at or after a time, as rounded to single precision; size() where there is none.
[[nodiscard]] std::size_t IndexAt(std::span<const float> time_s, double at_s);

/// A least-squares line, kept at its centroid: there level and slope are independent.
struct LineFit {
  double mean_time_s = 0;
  double mean_force_g = 0;
  double slope_g_s = 0;
  double time_spread_s2 = 0;  ///< Sum of squared distances from mean_time_s.
  double residual_g2 = 0;     ///< Sum of squared residuals.
  std::size_t count = 0;      ///< Samples; 0 where there is no line.

  [[nodiscard]] double Force(double time_s) const {
    return mean_force_g + slope_g_s * (time_s - mean_time_s);
  }
  /// Of one sample about the line, gf; 0 where fewer than three samples tell nothing.
  [[nodiscard]] double Noise() const;
};

/// Fits samples first … end - 1. Fewer than two distinct times give a level without slope.
[[nodiscard]] LineFit FitLine(const Samples& samples, std::size_t first, std::size_t end);

/// The split of samples first … end - 1 into two independent straight lines with the least summed
/// residual, every split tried.
///
/// Sums run in double: the residual is a difference of sums that are 10^4 times larger, which
/// single precision (24 bits) would leave to rounding.
/// @param least  Samples that either line has at least, >= 2.
/// @returns the first sample of the right line, or `end` where there are fewer than 2 least.
/// Cost: O(end - first), no memory.
[[nodiscard]] std::size_t FindElbow(const Samples& samples, std::size_t first, std::size_t end,
                                    std::size_t least);

/// A crossing of two lines.
struct Crossing {
  double time_s = 0;
  double force_g = 0;
  /// Of time_s, from the scatter about each line alone. It takes both for straight and the elbow
  /// between them for known: a press that curves moves the crossing by more than this says.
  double standard_uncertainty_s = 0;
};

/// Parallel lines cross at infinity: time_s is then not finite.
[[nodiscard]] Crossing Intersect(const LineFit& left, const LineFit& right);

}  // namespace trammel::tap
