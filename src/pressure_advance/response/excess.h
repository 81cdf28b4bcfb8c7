// How much filament a transition left over or fell short of, line by line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {

/// Of a transition's window: a line is unusable where more than this is unread in one piece.
inline constexpr double kMostUnread = 0.25;

/// Which of an eye's readings stands for the amount of filament.
enum class Reading { kArea, kWidth };

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

/// The reading that most samples have; area before width. Nothing where neither is seen.
[[nodiscard]] std::optional<Reading> ChooseReading(const std::vector<LineProfile>& profiles);

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
