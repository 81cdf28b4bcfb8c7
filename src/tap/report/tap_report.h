// One HTML page on a tap or on many.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tap/ensemble/advice.h"
#include "tap/report/tap_figures.h"

namespace trammel::report {

struct TapReportInput {
  std::span<const PlottedTap> taps;
  tap::Ensemble ensemble;
  tap::NoiseSpectrum noise;
  tap::TapAdvice advice;
};

/// In the order of the page: series, mesh, the single taps, at most `most_taps` of them, noise.
[[nodiscard]] std::vector<Figure> TapFigures(const TapReportInput& input, std::size_t most_taps);

/// Stands alone: nothing is loaded from elsewhere. Text from outside may hold any bytes.
[[nodiscard]] std::string TapReport(const TapReportInput& input);

}  // namespace trammel::report
