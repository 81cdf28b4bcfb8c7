// The head's way along several lines in one go, as one number: how far it has come.
#pragma once

#include <span>
#include <vector>

#include "pressure_advance/procedure/sweep_plan.h"

namespace trammel::procedure {

/// A straight part of a run: along a line, or from one line to the next. Positions are the
/// nozzle's; "way" is the distance that the head has come, from the first line's position at its
/// start on, so that of a run of one line way and position along the line are the same.
struct PathLeg {
  double x_mm = 0;  ///< where it begins
  double y_mm = 0;
  double along_x = 1;  ///< unit vector of the motion
  double along_y = 0;
  double begin_mm = 0;  ///< way at its begin
  double length_mm = 0;
  const Sweep* sweep = nullptr;  ///< the line; null on the way to the next one
};

/// Every sweep of a run and the ways between them. The sweeps outlive the legs.
[[nodiscard]] std::vector<PathLeg> PathOf(std::span<const Sweep> run);

/// One line of a run: between which ways it was swept, and which position is which way.
struct SweptStretch {
  double begin_mm = 0;   ///< way at which the sweep along the line begins
  double end_mm = 0;     ///< and ends
  double origin_mm = 0;  ///< way at which the line's printed start was passed, or would have been
  double direction = 1;  ///< -1 where the sweep ran against the print

  [[nodiscard]] double PositionOf(double way_mm) const { return direction * (way_mm - origin_mm); }
};

/// One stretch for each sweep of the run.
[[nodiscard]] std::vector<SweptStretch> StretchesOf(std::span<const Sweep> run);

}  // namespace trammel::procedure
