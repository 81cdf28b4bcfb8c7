#include "part_alignment/pose/solution.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trammel::part_alignment {

Camera SolvedCamera(const Measurement& measurement, const Alignment& alignment) {
  Camera camera = measurement.camera;
  camera.focal_length_mm = alignment.focal_length_mm;
  camera.taper_from_camera.translation_mm = alignment.camera_offset_mm;
  return camera;
}

const PartTarget* FindTarget(const Measurement& measurement, const std::string& id) {
  const auto found = std::find_if(measurement.targets.begin(), measurement.targets.end(),
                                  [&id](const PartTarget& target) { return target.id == id; });
  return found == measurement.targets.end() ? nullptr : &*found;
}

std::optional<Eigen::Vector2d> ImageOf(const Measurement& measurement, const Alignment& alignment,
                                       const View& view, const PartTarget& target) {
  const Camera camera = SolvedCamera(measurement, alignment);
  const auto pixel = Project(camera, CameraFromPart(camera, alignment.clamping, view,
                                                    alignment.machine_from_part, target.ideal_mm));
  const bool inside = pixel && pixel->x() >= 0 && pixel->y() >= 0 &&
                      pixel->x() <= camera.width_px - 1 && pixel->y() <= camera.height_px - 1;
  return inside ? pixel : std::nullopt;
}

DistanceRange SeenDistances(const Measurement& measurement, const Alignment& alignment) {
  const Camera camera = SolvedCamera(measurement, alignment);
  DistanceRange range{std::numeric_limits<double>::infinity(), 0};
  for (const View& view : measurement.views) {
    for (const Observation& seen : view.observations) {
      const PartTarget* target = FindTarget(measurement, seen.target);
      if (target == nullptr) continue;
      const double away_mm = std::abs(CameraFromPart(camera, alignment.clamping, view,
                                                     alignment.machine_from_part, target->ideal_mm)
                                          .z());
      range.nearest_mm = std::min(range.nearest_mm, away_mm);
      range.farthest_mm = std::max(range.farthest_mm, away_mm);
    }
  }
  if (range.farthest_mm == 0) range.nearest_mm = 0;
  return range;
}

}  // namespace trammel::part_alignment
