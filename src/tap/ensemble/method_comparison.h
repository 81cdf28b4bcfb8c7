// Two methods on the same taps: which of them repeats better.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"
#include "tap/ensemble/ensemble.h"

namespace trammel::tap {

/// One tap as both methods read it. Place and time are taken from `contact`.
struct TwiceRead {
  TapResult two_line;
  TapResult contact;
};

/// How one method's heights repeat, over the taps that both methods read.
struct MethodScatter {
  std::size_t good = 0;   ///< Taps that this method read, whatever the other one did.
  double claimed_mm = 0;  ///< By its own uncertainties (rms); NaN without a tap.
  Measured deviation_mm;  ///< Of heights about the mean of their place.
  /// Of a single height by the steps from each tap to the next one at its place (rms / sqrt 2): a
  /// drift that is slow against the taps is not in it.
  Measured back_to_back_mm;
};

enum class Repeats : std::uint8_t { kCannotTell, kContactBetter, kTwoLineBetter };

/// "cannot_tell", "contact", "two_line", as written to JSON.
[[nodiscard]] std::string_view ToString(Repeats better);

struct MethodComparison {
  std::size_t taps = 0;
  std::size_t used = 0;      ///< Read by both, at a place that has two such taps.
  std::size_t places = 0;    ///< Of the used ones.
  std::size_t unplaced = 0;  ///< Of the used ones, without x and y: taken for repeats of one place.
  MethodScatter two_line;
  MethodScatter contact;
  Measured ratio;               ///< Deviation of contact divided by that of two-line.
  Measured back_to_back_ratio;  ///< The same of what steps give.
  Measured difference_mm;       ///< Mean of contact less two-line.
  Repeats better = Repeats::kCannotTell;
  std::string because;  ///< The figures behind it, and what to do.
  /// Heights less the mean of their place, tap by tap; NaN for taps that are not used.
  std::vector<TwiceRead> residuals;
};

/// Least degrees of freedom (taps less places) that a scatter is told from: with fewer, the
/// interval of a ratio spans more than a factor of four.
inline constexpr double kLeastComparisonFreedom = 8;

/// Compares on the same taps, outliers among them: a method's blunders are its scatter.
///
/// Intervals of a deviation are those of normal heights (1 / sqrt(2 f) in its logarithm) or, where
/// that is wider, the jackknife's over taps, which heavy tails widen (Miller 1968). A ratio's is
/// that of two correlated normal samples (Pitman 1939, Morgan 1939) or the jackknife's. Steps have
/// 2 m^2 / sum(3 n - 4) effective degrees of freedom (von Neumann 1941).
/// @param taps  In the order of time.
/// Cost: O(n log n).
[[nodiscard]] MethodComparison CompareMethods(std::span<const TwiceRead> taps,
                                              const EnsembleOptions& options = {});

}  // namespace trammel::tap
