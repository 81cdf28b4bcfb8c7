// The noise of a load cell as a free nozzle shows it, and more noise of the same kind.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/random.h"
#include "tap/samples/noise_spectrum.h"

namespace trammel::tap {

/// White noise through a recursive filter, and sines: x_i = sum of regression[k] x_(i-1-k) + e_i.
struct NoiseModel {
  double deviation_g = 0;           ///< Of one sample during the pull-back, without the sines.
  double approach_deviation_g = 0;  ///< The same while the head comes down.
  std::vector<double> regression;   ///< Empty where neighbouring samples do not err together.
  double innovation = 1;            ///< Deviation of e where x has the deviation 1.
  struct Sine {
    double frequency_hz = 0;
    double amplitude_g = 0;
  };
  std::vector<Sine> sines;  ///< Mains hum and the like; each tap meets it at another phase.
};

/// A stretch of samples on which nothing touches, evenly spaced as far as it matters.
struct FreeStretch {
  std::vector<double> force_g;
  bool approach = false;  ///< Before the touch; else after the break.
};

/// Fits the model to stretches, each less its own straight line: autocovariances of all of them,
/// less those of the spectrum's lines, through the Levinson-Durbin recursion; the order by Akaike's
/// criterion. Slower than a stretch nothing shows.
/// @param otherwise_g  The deviation where no stretch is long enough to tell.
[[nodiscard]] NoiseModel FitNoiseModel(std::span<const FreeStretch> stretches,
                                       const NoiseSpectrum& spectrum, double otherwise_g);

/// Noise of deviation 1, sample by sample.
class NoiseDraw {
 public:
  NoiseDraw(const NoiseModel& model, Random& random);
  [[nodiscard]] double Next();

 private:
  const NoiseModel& model_;
  Random& random_;
  std::vector<double> past_;  // a ring, the latest at at_
  std::size_t at_ = 0;
};

}  // namespace trammel::tap
