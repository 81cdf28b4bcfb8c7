// Finds mains hum on the flat part of a tap.
#pragma once

#include "tap/samples/line_fit.h"

namespace trammel::tap {

/// Strongest of the mains' lines: 50, 60, 100 and 120 Hz.
struct Hum {
  double mains_hz = 0;     ///< 0 where none stands out.
  double seen_hz = 0;      ///< apparent frequency at this sampling rate, folded below half of it
  double amplitude_g = 0;  ///< Of the sine.
};

/// A sine at each line, fitted to the residuals about `line` of samples first … end - 1.
///
/// One stands out whose power noise alone would reach once in 10^4 taps (power of white noise is
/// exponentially distributed: threshold ln(lines / 10^-4) times its mean), and whose amplitude is
/// at least half the noise; weaker ones cost nothing, for the fits average over them.
[[nodiscard]] Hum FindHum(const Samples& samples, std::size_t first, std::size_t end,
                          const LineFit& line, double period_s);

}  // namespace trammel::tap
