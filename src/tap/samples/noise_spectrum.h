// Computes a load cell's noise by frequency, from the stretches of taps without contact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tap/samples/tap.h"

namespace trammel::tap {

/// Probable source of a line in the spectrum.
enum class NoiseSource : std::uint8_t {
  kUnknown,
  kMains50Hz,   ///< Or a harmonic.
  kMains60Hz,   ///< Or a harmonic.
  kHeater10Hz,  ///< Klipper's heaters are switched in cycles of 0.1 s; or a harmonic.
};

struct NoiseLine {
  double frequency_hz = 0;  ///< as observed, below half the sample rate
  double amplitude_g = 0;   ///< sine amplitude
  NoiseSource source = NoiseSource::kUnknown;
  int harmonic = 0;              ///< 1 for the fundamental; 0 where the source is not known.
  double true_frequency_hz = 0;  ///< source's frequency; differs from frequency_hz for an alias
};

struct NoiseSpectrum {
  std::vector<double> frequency_hz;  ///< Evenly spaced up to half the sample rate.
  std::vector<double> amplitude_g;   ///< Root mean square over the stretches, of a sine there.
  double sample_rate_hz = 0;
  double resolution_hz = 0;  ///< Lines nearer to each other than this are one.
  double noise_g = 0;        ///< Standard deviation of a sample about the stretches' own lines.
  /// Limit at each frequency; noise without lines exceeds it in one spectrum of a thousand.
  std::vector<double> limit_g;
  std::vector<NoiseLine> lines;  ///< by decreasing amplitude, at most 12
  std::size_t stretches = 0;
};

/// Computes Fourier sums of every stretch before the collision and from the end of the pull-back
/// on, each minus its straight line. Uses a Hann window at the samples' own times, so that a
/// dropped sample does no harm. Averages squares over the stretches. The limit of a line follows
/// the noise near its frequency, so coloured noise causes no false lines.
/// @param taps  Of one printer at one sample rate. Ignores taps without moves or with too few
/// samples, and samples that are not finite.
/// @returns no frequencies if no stretch has 32 samples.
/// Cost: O(samples · 512); uses at most 200 stretches of at most 1024 samples.
[[nodiscard]] NoiseSpectrum FindNoise(std::span<const TapView> taps);

/// "mains 50 Hz, harmonic 3 (150 Hz)" and so on.
[[nodiscard]] std::string Describe(const NoiseLine& line);

}  // namespace trammel::tap
