#include "align_scene.h"

#include <fmt/format.h>

#include <numbers>

namespace trammel::test {

Eigen::Vector3d VectorOf(const sim::Triple& triple) { return {triple[0], triple[1], triple[2]}; }

part_alignment::Camera CameraOf(const sim::SpindleLens& lens) {
  part_alignment::Camera camera;
  camera.convention = part_alignment::CameraConvention::kBrownMeasuredToIdeal;
  camera.width_px = lens.width_px;
  camera.height_px = lens.height_px;
  camera.pixel_pitch_mm = lens.pixel_pitch_mm;
  camera.focal_length_mm = lens.focal_length_mm;
  camera.principal_point_offset_px = {lens.principal_offset_px[0], lens.principal_offset_px[1]};
  camera.k1 = lens.k1;
  camera.k2 = lens.k2;
  camera.p1 = lens.p1;
  camera.p2 = lens.p2;
  camera.looks_along =
      lens.along_plus_z ? part_alignment::LooksAlong::kPlusZ : part_alignment::LooksAlong::kMinusZ;
  camera.taper_from_camera = {VectorOf(lens.offset_mm), VectorOf(lens.angles_rad)};
  return camera;
}

part_alignment::Measurement MeasurementOf(const sim::SpindleWorld& world,
                                          const sim::SpindleName& name, double sigma_px,
                                          bool exact) {
  constexpr double kMargin_px = 20;
  part_alignment::Measurement measurement;
  measurement.camera = CameraOf(world.setup.stated_lens);
  for (const sim::SpindleTarget& target : world.setup.part.targets) {
    measurement.targets.push_back({std::to_string(target.id), VectorOf(target.ideal_mm)});
  }
  Random noise = sim::ObservationNoiseOf(name);
  for (std::size_t stop = 0; stop < world.setup.stops.size(); ++stop) {
    part_alignment::View view;
    view.spindle_mm = VectorOf(world.setup.stops[stop].stated_mm);
    const sim::Turn turn = sim::SpindleTurn(world.setup.machine, world.setup.stops[stop].c_rad);
    for (int i = 0; i < 3; ++i) {
      view.spindle_rotation.row(i) = VectorOf(turn[static_cast<std::size_t>(i)]).transpose();
    }
    for (const sim::SpindleObservation& seen : sim::Look(world, stop, kMargin_px, noise)) {
      const sim::PixelPlace at = exact ? seen.exact_px : seen.noisy_px;
      view.observations.push_back({measurement.targets[seen.target].id, at[0], at[1], sigma_px});
    }
    measurement.views.push_back(view);
  }
  return measurement;
}

Eigen::VectorXd TruthOf(const sim::SpindleWorld& world) {
  Eigen::VectorXd truth(9);
  truth << VectorOf(world.machine_from_part.origin_mm), VectorOf(world.part_angles_rad),
      world.clamping.angle_rad, world.clamping.eccentricity_mm[0],
      world.clamping.eccentricity_mm[1];
  return truth;
}

sim::SpindleSetup Probed(sim::SpindleSetup setup) {
  setup.part.misplaced_mm = 0.5;
  setup.part.misplaced_rad = 5e-4;
  return setup;
}

sim::SpindleSetup HalfTurned(sim::SpindleSetup setup) {
  const auto stops = setup.stops;
  for (sim::SpindleStation stop : stops) {
    stop.c_rad = std::numbers::pi;
    setup.stops.push_back(stop);
  }
  return setup;
}

}  // namespace trammel::test
