// Writes advice on taps and the noise by frequency, in words and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tap/ensemble/advice.h"
#include "tap/samples/noise_spectrum.h"

namespace trammel::report {

/// Returns the noise and its lines, then a line for each setting: those that change first.
[[nodiscard]] std::string AdviceText(const tap::TapAdvice& advice, const tap::NoiseSpectrum& noise);

/// Returns one object (docs/reference/formats.md).
[[nodiscard]] nlohmann::ordered_json JsonOf(const tap::TapAdvice& advice,
                                            const tap::NoiseSpectrum& noise);

}  // namespace trammel::report
