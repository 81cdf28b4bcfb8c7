#include "part_alignment/pose/measurement.h"

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

}  // namespace trammel::part_alignment
