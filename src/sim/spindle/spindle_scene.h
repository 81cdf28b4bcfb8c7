// The scenes of the paper, with the view geometry that it does not print.
#pragma once

#include "sim/spindle/spindle_world.h"

namespace trammel::sim {

/// Where a camera stops for a target: the target's place less the spindle axis, in the spindle's x
/// and y.
using Lever = std::array<double, 2>;

/// Two stops per target, their levers 100 mm apart along x about a middle as a person jogs it,
/// within the field at 150 mm. With the clamp angle taken for 0 these levers lose what Table 2
/// loses, to a factor of 1.3 in every column; levers that are alike at all targets lose nothing in
/// alpha and beta, and levers symmetrical about the axis lose nothing at all.
[[nodiscard]] std::vector<std::array<Lever, 2>> JoggedLevers();

/// The stops, so that each target where it is meant to lie is seen with these levers from
/// `distance_mm` (along the spindle, from the camera's origin), C at 0.
/// REQUIRES one pair of levers per target.
[[nodiscard]] std::vector<SpindleStop> StopsFor(const SpindleSetup& setup, double distance_mm,
                                                const std::vector<std::array<Lever, 2>>& levers);

/// Section 3.2: four targets at the corners of 1.5 m x 1 m in the XY plane, looked at along -Z.
/// The part's origin is the middle of its targets.
[[nodiscard]] SpindleSetup LaboratoryScene(double distance_mm);

/// Section 4: four targets at the corners of 10 m x 3 m in the XZ plane, looked at along Y.
[[nodiscard]] SpindleSetup IndustryScene(double distance_mm);

}  // namespace trammel::sim
