#include "part_alignment/pose/measurement.h"

#include <fmt/format.h>

#include <cmath>

#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

Eigen::Vector3d CameraFromPart(const Camera& camera, const Clamping& clamping, const View& view,
                               const geometry::Pose& machine_from_part,
                               const Eigen::Vector3d& part_mm) {
  using geometry::RotationFromAngles;
  const Eigen::Vector3d machine_mm =
      RotationFromAngles(machine_from_part.angles_rad) * part_mm + machine_from_part.translation_mm;
  Eigen::Vector3d spindle_mm = view.spindle_rotation.transpose() * (machine_mm - view.spindle_mm);
  spindle_mm.head<2>() -= clamping.eccentricity_mm;
  const Eigen::Matrix3d spindle_from_taper = RotationFromAngles({0, 0, -clamping.angle_rad}) *
                                             RotationFromAngles({clamping.tilt_rad.x(), 0, 0}) *
                                             RotationFromAngles({0, clamping.tilt_rad.y(), 0});
  const Eigen::Vector3d taper_mm = spindle_from_taper.transpose() * spindle_mm;
  return RotationFromAngles(camera.taper_from_camera.angles_rad).transpose() *
         (taper_mm - camera.taper_from_camera.translation_mm);
}

double UsualTarget_mm(double extent_mm) {
  constexpr double kLengthError_mm = 0.05;
  constexpr double kLengthErrorPerMm = 20e-6;
  return (kLengthError_mm + kLengthErrorPerMm * extent_mm) / std::sqrt(3.0) / std::sqrt(2.0);
}

InputUncertainty ExactInputs() {
  InputUncertainty exact;
  for (const UncertainInput& input : kUncertainInputs) exact.*input.size = 0;
  return exact;
}

InputUncertainty WithUsualSizes(const InputUncertainty& inputs, OtherwiseStated otherwise,
                                double extent_mm) {
  InputUncertainty usual = inputs;
  for (const UncertainInput& input : kUncertainInputs) {
    usual.*input.size = (inputs.*input.size).value_or(0);
  }
  usual.machine_mm = inputs.machine_mm.value_or(kUsualRepeatability_mm);
  usual.clamp_eccentricity_mm = inputs.clamp_eccentricity_mm.value_or(kUsualEccentricity_mm);
  usual.camera_offset_mm =
      inputs.camera_offset_mm.value_or(otherwise.camera ? 0 : kUsualCameraOffset_mm);
  usual.target_mm = inputs.target_mm.value_or(otherwise.targets ? 0 : UsualTarget_mm(extent_mm));
  return usual;
}

Result<void> Validate(const InputUncertainty& inputs) {
  for (const UncertainInput& input : kUncertainInputs) {
    const double size = (inputs.*input.size).value_or(0);
    if (!(size >= 0 && size <= 1000)) {
      return Fail(fmt::format("uncertainty {} is {}, it must lie in 0 ... 1000", input.name, size));
    }
  }
  return {};
}

}  // namespace trammel::part_alignment
