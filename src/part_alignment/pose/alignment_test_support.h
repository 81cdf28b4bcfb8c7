// A world of the tests as a measurement.
#pragma once

#include <string>

#include "part_alignment/pose/alignment_world_test_support.h"
#include "part_alignment/pose/measurement.h"

namespace trammel::part_alignment {

inline Camera CameraOf(const test_support::WorldCamera& from) {
  Camera camera;
  camera.convention = from.opencv ? CameraConvention::kBrownIdealToDistorted
                                  : CameraConvention::kBrownMeasuredToIdeal;
  camera.width_px = test_support::kWorldWidth_px;
  camera.height_px = test_support::kWorldHeight_px;
  camera.pixel_pitch_mm = test_support::kWorldPitch_mm;
  camera.focal_length_mm = from.focal_length_mm;
  camera.principal_point_offset_px = from.principal_point_offset_px;
  camera.k1 = from.k1;
  camera.k2 = from.k2;
  camera.p1 = from.p1;
  camera.p2 = from.p2;
  camera.looks_along = from.looks_along_plus_z ? LooksAlong::kPlusZ : LooksAlong::kMinusZ;
  camera.taper_from_camera = from.taper_from_camera;
  return camera;
}

inline std::string TargetId(int target) { return "T" + std::to_string(target + 1); }

inline Measurement MeasurementOf(const test_support::AlignmentWorld& world, double sigma_px) {
  Measurement measurement;
  measurement.camera = CameraOf(world.camera);
  for (std::size_t i = 0; i < world.targets_mm.size(); ++i) {
    measurement.targets.push_back({TargetId(static_cast<int>(i)), world.targets_mm[i]});
  }
  for (const test_support::WorldView& from : world.views) {
    View view{from.spindle_mm, from.spindle_rotation, {}};
    for (const test_support::WorldObservation& observation : from.observations) {
      view.observations.push_back(
          {TargetId(observation.target), observation.pixel.x(), observation.pixel.y(), sigma_px});
    }
    measurement.views.push_back(view);
  }
  return measurement;
}

}  // namespace trammel::part_alignment
