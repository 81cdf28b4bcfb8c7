// Advice on how to tap, as JSON.
#pragma once

#include <string>

#include "tap/samples/noise_spectrum.h"
#include "tap/tuning/tuning.h"

namespace trammel::report {

/// One object (docs/formats.md), ended by a newline.
[[nodiscard]] std::string ToJson(const tap::Tuning& tuning, const tap::NoiseSpectrum& noise);

}  // namespace trammel::report
