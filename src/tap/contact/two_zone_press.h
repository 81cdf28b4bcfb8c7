// Alternative to the smooth presses, whose stiffness changes at once or over a short way: the
// nozzle meets something soft (plastic, a hollow sheet) or stiffer before the bed itself.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "tap/contact/break_search.h"
#include "tap/contact/press_profile.h"

namespace trammel::tap {

/// The outer zone of presses that break at t: what kinks below t need to know of its column
/// max(0, t - y).
struct OuterZone {
  OuterZone(const PressProfile& profile, double t);

  double t = 0;
  double sum = 0;          ///< Of the column,
  double sum_y = 0;        ///< and of it times y - mean.
  double inverse = 0;      ///< Of its sum of squares, the baseline taken out.
  double slope = 0;        ///< Of the press without an inner zone,
  double sum_squares = 0;  ///< and what it leaves.
  /// Limits of kinks with enough samples in either zone.
  double above = std::numeric_limits<double>::infinity();
  double up_to = 0;
};

/// Press c max(0, t - y) + k e + q e^2, e = max(0, s - y), s < t, with a straight outer zone.
struct TwoZones {
  double sum_squares = 0;         ///< With q = 0, >= 0 but for rounding,
  double sum_squares_curved = 0;  ///< and with q as it comes.
  double outer_slope = 0;         ///< c, with q as it comes,
  double added_slope = 0;         ///< k
  double added_curve = 0;         ///< and q.
};

/// A kink at s = u = v; or one that is rounded from u to v, v < u <= t, between which the slope
/// changes evenly: k (h^2 - e^2) / (2 (u - v)) + q e^2, h = max(0, u - y), e = max(0, v - y).
[[nodiscard]] TwoZones EvaluateTwoZones(const PressProfile& profile, const OuterZone& outer,
                                        double u, double v);

/// force = a + b y + c max(0, t - y) + k e (+ q e^2), e = max(0, s - y), s < t: an outer zone that
/// is straight, and below the kink s a press that is straight or quadratic. EvaluateTwoZones says
/// what a rounded kink is; s is its middle then.
struct TwoZonePress {
  double t = 0;                        ///< The break,
  double s = 0;                        ///< and below it the kink.
  double outer_slope = 0;              ///< slope between them,
  double inner_slope = 0;              ///< and just below the kink,
  double inner_curve = 0;              ///< and the curve of the inner zone.
  double sum_squares = 0;              ///< for a straight inner press,
  double sum_squares_curved = kNever;  ///< and with it quadratic.
  bool found = false;

  /// Returns the end of the inner press, extrapolated from the kink: the visible end if one
  /// extrapolates the last samples of the bed itself.
  [[nodiscard]] double Elbow() const { return s + outer_slope / inner_slope * (t - s); }
};

/// The best kink for a break. Both zones must press: the outer one by at least 5 % of the inner
/// one's slope, for less cannot be told from none.
/// @param near_s    The best kink for a break close by, from where a better one is looked for;
/// where
///                  it is none for this break, or 0, zones of several widths are tried first.
/// @param rounding  Part of the outer zone, 0 to 1, over which to either side of the kink the slope
///                  changes evenly and not at once: a film that is pressed flat, a round tip in
///                  plastic.
[[nodiscard]] TwoZonePress FitTwoZones(const PressProfile& profile, const OuterZone& outer,
                                       double near_s = 0, double rounding = 0);

/// Start of the search for a press in two zones.
enum class ZonesStart : std::size_t {
  kClose,   ///< Close to the break of the smooth press: a stiff outer zone, or a wide one,
  kBeyond,  ///< beyond it: a soft one of more than a tenth of the depth,
  kNarrow,  ///< and one of less.
};
inline constexpr std::array kZonesStarts = {ZonesStart::kClose, ZonesStart::kBeyond,
                                            ZonesStart::kNarrow};

/// Searches quickly for break and kink around the break of a smooth press: zones of several widths
/// that such a press would average, and some steps from the best of them.
[[nodiscard]] TwoZonePress GuessTwoZones(const PressProfile& profile, double smooth_t,
                                         ZonesStart start);

}  // namespace trammel::tap
