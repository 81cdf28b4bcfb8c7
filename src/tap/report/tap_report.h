// Writes an HTML page on one tap or many.
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

/// Draws, in the page's order: series, mesh, the single taps, at most `most_taps` of them, noise.
[[nodiscard]] std::vector<Figure> TapFigures(const TapReportInput& input, std::size_t max_taps);

/// Returns a self-contained page: nothing is loaded from elsewhere. Text from outside may have any
/// bytes.
[[nodiscard]] std::string TapReport(const TapReportInput& input);

}  // namespace trammel::report
