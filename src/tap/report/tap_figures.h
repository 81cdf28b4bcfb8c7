// Draws the figures of taps, after the plots of the write-up (docs/howto/tap.md): the published
// decomposition in orange, trammel's contact in green.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "document/canvas.h"
#include "document/figure.h"
#include "tap/ensemble/ensemble.h"
#include "tap/report/tap_json.h"
#include "tap/samples/noise_spectrum.h"

namespace trammel::report {

/// Colours of the published method and ours, as in the write-up for old and new; distinguishable in
/// grey too.
inline constexpr Color kOldMethod = kVermilion;
inline constexpr Color kNewMethod = kGreen;
inline constexpr Color kSample = kGrey;

/// Tap with the results of both methods.
struct PlottedTap {
  tap::Recording recording;
  tap::TapAnalysis contact;
  tap::TapAnalysis two_line;
  double latency_s = 0;  ///< used by both
};

// The figures show a result only if its verdict is good. They accept any input: no samples,
// unsorted times, values that are not finite and absurd moves are drawn as far as possible.

/// "tap": force against time with the points and lines of both methods; force against height around
/// the break with the fit and its interval, whole and enlarged; what the fit leaves.
[[nodiscard]] Figure TapFigure(const PlottedTap& tap);

/// "series": contact height tap after tap, with the intervals, outliers, drift and, where it is
/// known, the printer's own result. Nothing without two good taps.
[[nodiscard]] std::optional<Figure> SeriesFigure(std::span<const PlottedTap> taps,
                                                 const tap::Ensemble& ensemble);

/// "mesh": heights over the bed. Nothing with fewer than three places that have a height.
[[nodiscard]] std::optional<Figure> MeshFigure(const tap::Ensemble& ensemble);

/// "noise": amplitude against frequency, with its lines named. Nothing without frequencies.
[[nodiscard]] std::optional<Figure> NoiseFigure(const tap::NoiseSpectrum& spectrum);

}  // namespace trammel::report
