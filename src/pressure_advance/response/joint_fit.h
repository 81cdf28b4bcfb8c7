// Both transitions of a laser's short lines in one fit, with what they share.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/response/fit_transitions.h"
#include "pressure_advance/response/joint_fit_options.h"

namespace trammel::pressure_advance {

/// A value of the joint fit and the variances of what it is made of, s^2.
struct JointValue {
  double value_s = 0;
  double lines = 0;  ///< from the scatter of the lines, by how far each line's residuals moved it
  double slip = 0;   ///< what the prior leaves open of the slip
  double form = 0;   ///< the same of the bends and of the window's tail
};

struct JointFit {
  JointValue both;
  JointValue acceleration;  ///< its own crossing, less slip and tail as both transitions show them
  JointValue deceleration;  ///< in the same way
  JointValue apart;         ///< acceleration less deceleration
  double slip_share = 0;    ///< of the flow
  double tail_s = 0;        ///< crossing of the shorter window less that of the whole one
};

/// Fits one answer, a slope and a bend for each window, slip and tail to all windows of all lines.
///
/// Each line's own lag moves all its windows together, an error of its level moves the two
/// transitions in opposite directions, readings move each by itself: generalised least squares
/// weighs them by that, so that lines far from the answer count as much as their form is known, and
/// the common lag of a line cancels where slip is learnt. The sizes of the first two come from the
/// residuals; an odd line is recognised by Tukey's biweight. What the lines' scatter leaves open is
/// taken from the residuals themselves, not from those sizes.
/// @param start  crossings of the same transitions
/// @returns nothing without an early window and a level, with fewer than four lines that show both
///   transitions, and where the fit does not converge.
[[nodiscard]] std::optional<JointFit> FitJointly(const Transitions& transitions,
                                                 const TransitionCrossings& start,
                                                 const JointFitOptions& options);

}  // namespace trammel::pressure_advance
