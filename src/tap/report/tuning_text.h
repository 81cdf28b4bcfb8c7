// Advice on how to tap, and the noise by frequency, for terminals and pages.
#pragma once

#include <string>

#include "tap/samples/noise_spectrum.h"
#include "tap/tuning/tuning.h"

namespace trammel::report {

/// The advice first, then what its trial gave, then what it rests on.
[[nodiscard]] std::string TuningText(const tap::Tuning& tuning);

[[nodiscard]] std::string NoiseText(const tap::NoiseSpectrum& noise);

}  // namespace trammel::report
