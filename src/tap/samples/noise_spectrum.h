// The noise of a load cell by frequency, from the stretches of taps on which nothing touches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tap/samples/tap.h"

namespace trammel::tap {

/// What a line in the spectrum probably comes from.
enum class NoiseSource : std::uint8_t {
  kUnknown,
  kMains50Hz,   ///< Or a harmonic.
  kMains60Hz,   ///< Or a harmonic.
  kHeater10Hz,  ///< Klipper's heaters are switched in cycles of 0.1 s; or a harmonic.
};

struct NoiseLine {
  double frequency_hz = 0;  ///< As seen, below half the sample rate.
  double amplitude_g = 0;   ///< Of the sine.
  NoiseSource source = NoiseSource::kUnknown;
  int harmonic = 0;              ///< 1 for the fundamental; 0 where the source is not known.
  double true_frequency_hz = 0;  ///< Of the source; not frequency_hz where it is an alias.
};

struct NoiseSpectrum {
  std::vector<double> frequency_hz;  ///< Evenly spaced up to half the sample rate.
  std::vector<double> amplitude_g;   ///< Root mean square over the stretches, of a sine there.
  double sample_rate_hz = 0;
  double resolution_hz = 0;  ///< Lines nearer to each other than this are one.
  double noise_g = 0;        ///< Standard deviation of a sample about the stretches' own lines.
  /// At each frequency; noise without lines is above it in one spectrum of a thousand.
  std::vector<double> limit_g;
  std::vector<NoiseLine> lines;  ///< By falling amplitude, at most 12.
  std::size_t stretches = 0;
};

/// Fourier sums (Hann window, at the samples' own times, so that a dropped sample does no harm) of
/// every stretch before the collision and from the end of the pull-back on, each less its straight
/// line; squares averaged over the stretches. The limit of a line follows the noise
/// near its frequency, so that a cell whose noise has a colour shows no false ones.
/// @param taps  Of one printer at one sample rate; those without moves or with too few samples add
///              nothing, as do samples that are not finite.
/// @returns no frequencies where no stretch has 32 samples.
/// Cost: O(samples · 512); at most 200 stretches of at most 1024 samples are looked at.
[[nodiscard]] NoiseSpectrum FindNoise(std::span<const TapView> taps);

/// "mains 50 Hz, harmonic 3 (150 Hz)" and so on.
[[nodiscard]] std::string Describe(const NoiseLine& line);

}  // namespace trammel::tap
