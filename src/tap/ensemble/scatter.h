// Why taps scatter more than they claim.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "tap/ensemble/ensemble.h"

namespace trammel::tap {

enum class ScatterCause : std::uint8_t {
  kTooFew,       ///< Taps to say.
  kNoise,        ///< They scatter as they claim.
  kTemperature,  ///< Heights go with the nozzle's temperature.
  kTime,         ///< Heights go on in one direction.
  kAlternating,  ///< Every other tap is higher.
  kPressForce,   ///< Heights go with the force of the press: its form is not the fit's.
  kWander,       ///< Neighbours lie together, without a direction.
  kBacklash,     ///< No pattern, and the drive did not follow at the pull-back's start.
  kMachine,      ///< No pattern.
};

/// "too_few", "noise" and so on, as written to JSON.
[[nodiscard]] std::string_view ToString(ScatterCause cause);

struct Scatter {
  ScatterCause cause = ScatterCause::kTooFew;
  std::size_t taps = 0;                                            ///< Good ones without outliers.
  std::size_t outliers = 0;                                        ///< Left out.
  double deviation_mm = std::numeric_limits<double>::quiet_NaN();  ///< Of the heights at one place.
  double claimed_mm =
      std::numeric_limits<double>::quiet_NaN();  ///< By the taps' own uncertainties.
  /// What is left of the deviation once that is taken off; 0 where nothing is.
  double beyond_mm = 0;
  double explained = 0;  ///< Share of the variance that the cause explains; 0 where none is named.
  std::string because;   ///< The figures, and what to do; one or two sentences.
};

/// A tap with what might move its height.
struct ScatteredTap {
  TapResult result;
  double press_force_g = std::numeric_limits<double>::quiet_NaN();
  bool press_trimmed = false;
};

/// Heights scatter beyond noise where chance makes so much in one series of a hundred
/// (chi-squared). Then the pattern that explains most of the variance is named, if it explains 40 %
/// and chance does so in one series of a hundred.
/// @param taps  In the order of time.
[[nodiscard]] Scatter ExplainScatter(std::span<const ScatteredTap> taps);

}  // namespace trammel::tap
