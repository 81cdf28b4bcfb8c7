// Measures how much filament a transition left over or fell short of, line by line.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {

/// A transition's surplus over its whole window, as far as a part of the window tells it.
struct CompletedWindow {
  double value = 0;
  double per_part = 0;  ///< d value / d part
  double sigma = 0;     ///< 1 sigma of what the part leaves open
};

/// Foretells a cut window from the lines that show all of theirs: a straight line of their whole
/// surpluses over those of the same part, in which lines with a like part count most. All lines end
/// their bulges and gaps alike, but for their own scatter.
/// @param parts   surpluses of the part, of the lines that show all; at least kFewestWhole, or the
///                answer is empty
/// @param wholes  those of the whole window; same length
/// @param part    of the line that shows no more
[[nodiscard]] std::optional<CompletedWindow> CompleteWindow(std::span<const double> parts,
                                                            std::span<const double> wholes,
                                                            double part);

/// Lines that must show all of a window before others are completed by them.
inline constexpr std::size_t kFewestWhole = 5;

/// The surplus of one transition on one line: the integral of (reading / reference - 1) over the
/// transition's window, signed so that it is positive where the pressure advance was too low.
struct Excess {
  double value = 0;  ///< in the profiles' PositionUnit (mm of nominal bead, or line lengths)
  double sigma = 0;  ///< 1 sigma from the readings' noise and the reference
  bool seen = true;  ///< false where a line that leaves the picture does not show this transition
};

struct LineExcess {
  Excess acceleration;
  Excess deceleration;
  std::string unusable;  ///< why this line has no excess; empty where it has
};

/// Measures all lines, shape (lines). The reference is what a line reads in its slow stretches,
/// with one drift along the line common to all (light, tilt, a wandering flow), so that neither a
/// drift nor a gap that reaches into one line's slow stretch is taken for a transition. Levels that
/// few readings tell are drawn towards the other lines'. Samples
/// that the eye could not read are bridged by their neighbours; a line with more than
/// kMostUnread of a window unread in one piece is unusable; what a line does not show by its own
/// word (LineProfile::shows_acceleration) is not looked at. Across a bead larger than the picture a
/// bridge says only what is there at least: as much again enters that transition's sigma.
[[nodiscard]] std::vector<LineExcess> MeasureExcess(const std::vector<LineProfile>& profiles,
                                                    Reading reading, const TransitionPlan& plan);

}  // namespace trammel::pressure_advance
