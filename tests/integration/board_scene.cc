#include "board_scene.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "align_scene.h"
#include "geometry/euler.h"

namespace trammel::test {

sim::BoardSetup BoardScene(int per_turn) {
  sim::BoardSetup setup;
  setup.lens = sim::AsRealCamera({});
  const auto add = [&](int count, double c_rad) {
    for (const sim::SpindleStation& stop :
         sim::BoardStations(setup, count, 5, 90, 150, 400, {c_rad})) {
      setup.stops.push_back(stop);
    }
  };
  add(per_turn, 0);
  add((per_turn + 1) / 2, std::numbers::pi);
  add((per_turn + 3) / 4, 0);
  setup.touched = {1, 11, 78, 88};
  return setup;
}

part_alignment::BoardMeasurement BoardMeasurementOf(const sim::BoardWorld& world) {
  constexpr double kMargin_px = 20;
  part_alignment::BoardMeasurement measurement;
  const part_alignment::Camera whole = CameraOf(world.setup.lens);
  measurement.camera.convention = whole.convention;
  measurement.camera.width_px = whole.width_px;
  measurement.camera.height_px = whole.height_px;
  measurement.camera.pixel_pitch_mm = whole.pixel_pitch_mm;
  measurement.camera.looks_along = whole.looks_along;
  Random noise = world.noise;
  const sim::SpindleMachine upright;
  for (std::size_t stop = 0; stop < world.setup.stops.size(); ++stop) {
    part_alignment::BoardView& view = measurement.views.emplace_back();
    view.picture = "picture " + std::to_string(stop + 1);
    view.spindle_mm = VectorOf(world.setup.stops[stop].stated_mm);
    const sim::Turn turn = sim::SpindleTurn(upright, world.setup.stops[stop].c_rad);
    for (int i = 0; i < 3; ++i) {
      view.spindle_rotation.row(i) = VectorOf(turn[static_cast<std::size_t>(i)]).transpose();
    }
    for (const sim::SpindleObservation& seen : sim::Look(world, stop, kMargin_px, noise)) {
      view.observations.push_back({std::to_string(seen.target + 1), seen.noisy_px[0],
                                   seen.noisy_px[1], world.setup.sigma_px});
    }
  }
  const double none = std::numeric_limits<double>::infinity();
  for (const sim::BoardTouchStation& touch : world.touches) {
    measurement.touches.push_back({std::to_string(touch.mark),
                                   VectorOf(touch.stated_mm),
                                   world.setup.tool_length_mm,
                                   {none, none, world.setup.machine.touch_mm}});
  }
  measurement.tool_length_sigma_mm = world.setup.machine.tool_length_mm;
  const sim::BoardSheet& sheet = world.setup.sheet;
  for (int row = 0; row < sheet.rows; ++row) {
    for (int column = 0; column < sheet.columns; ++column) {
      measurement.layout.push_back({std::to_string(row * sheet.columns + column + 1),
                                    {column * sheet.pitch_mm, -row * sheet.pitch_mm}});
    }
  }
  return measurement;
}

part_alignment::CameraVector BoardTruth(const sim::BoardWorld& world) {
  part_alignment::Camera camera = CameraOf(world.setup.lens);
  const sim::Place held = sim::TaperFromCameraAsHeld(world);
  Eigen::Matrix3d turn;
  for (int i = 0; i < 3; ++i) {
    turn.row(i) = VectorOf(held.turn[static_cast<std::size_t>(i)]).transpose();
  }
  camera.taper_from_camera = {VectorOf(held.origin_mm), geometry::AnglesFromRotation(turn)};
  return part_alignment::ParametersOf(camera);
}

part_alignment::CameraVector BoardError(const sim::BoardWorld& world,
                                        const part_alignment::Camera& camera) {
  part_alignment::CameraVector error = part_alignment::ParametersOf(camera) - BoardTruth(world);
  for (int i = 10; i < part_alignment::kCameraParameters; ++i) {
    error[i] = std::remainder(error[i], 2 * std::numbers::pi);
  }
  return error;
}

}  // namespace trammel::test
