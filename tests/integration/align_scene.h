// View of the virtual spindle, in the types of part alignment.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "part_alignment/pose/measurement.h"
#include "sim/spindle/spindle_world.h"

namespace trammel::test {

[[nodiscard]] Eigen::Vector3d VectorOf(const sim::Triple& triple);
[[nodiscard]] part_alignment::Camera CameraOf(const sim::SpindleLens& lens);

/// The stated camera, the ideal places, the stated stops, and the noisy centres with `sigma_px`.
/// With `exact`, the centres without their noise.
[[nodiscard]] part_alignment::Measurement MeasurementOf(const sim::SpindleWorld& world,
                                                        const sim::SpindleName& name,
                                                        double sigma_px, bool exact = false);

/// Returns the true values: x y z (mm), alpha beta gamma and the clamp angle (rad), the
/// eccentricity (mm).
[[nodiscard]] Eigen::VectorXd TruthOf(const sim::SpindleWorld& world);

/// The part as the paper had it: aligned with a touch probe.
[[nodiscard]] sim::SpindleSetup Probed(sim::SpindleSetup setup);

/// Every stop again with C at 180 degrees.
[[nodiscard]] sim::SpindleSetup HalfTurned(sim::SpindleSetup setup);

}  // namespace trammel::test
