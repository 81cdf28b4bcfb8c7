// Measures the surplus filament of a transition, line by line.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {

/// Surplus of a transition over its whole window, predicted from a part of the window.
struct CompletedWindow {
  double value = 0;
  double per_part = 0;  ///< d value / d part
  double sigma = 0;     ///< 1 sigma of what the part leaves open
};

/// Predicts a cut window from the lines with complete windows: a straight line of their whole
/// surpluses over those of the same part, in which lines with a similar part have the most weight.
/// All lines end their bulges and gaps alike, except for their own scatter.
/// @param parts   surpluses of the part, of the complete lines; at least kFewestWhole, or the
///                answer is empty
/// @param wholes  those of the whole window; same length
/// @param part    of the incomplete line
[[nodiscard]] std::optional<CompletedWindow> CompleteWindow(std::span<const double> parts,
                                                            std::span<const double> wholes,
                                                            double part);

/// Minimum number of lines with a complete window before others are completed by them.
inline constexpr std::size_t kFewestWhole = 5;

/// Surplus of one transition on one line: the integral of (reading / reference - 1) over the
/// transition's window, positive if the pressure advance was too low.
struct Surplus {
  double value = 0;  ///< in the profiles' PositionUnit (mm of nominal bead, or line lengths)
  double sigma = 0;  ///< 1 sigma from the readings' noise and the reference
  bool seen = true;  ///< false where a line that leaves the picture does not show this transition
};

struct LineSurplus {
  Surplus acceleration;
  Surplus deceleration;
  /// Relative change of the reading from the first reference to the last; absent: too few readings.
  std::optional<double> along;
  std::string unusable;  ///< why this line has no surplus; empty if it has
};

/// Measures all lines, shape (lines). The reference is a line's reading in its slow stretches, with
/// one drift along the line common to all (light, tilt, a wandering flow). So neither a drift nor a
/// gap that reaches into one line's slow stretch counts as a transition. Levels from few readings
/// are shrunk towards the other lines'. Unreadable samples are interpolated from their neighbours;
/// a line with more than kMaxUnread of a window unread in one piece is unusable. Transitions that
/// a line does not show by its own flag (LineProfile::shows_acceleration) are skipped. Across a
/// bead larger than the picture the interpolation is only a lower bound: as much again enters that
/// transition's sigma.
[[nodiscard]] std::vector<LineSurplus> MeasureSurplus(const std::vector<LineProfile>& profiles,
                                                      Reading reading, const TransitionPlan& plan);

}  // namespace trammel::pressure_advance
