#include "sim/spindle/spindle_scene.h"

#include "base/check.h"

namespace trammel::sim {
namespace {

constexpr double kHalfBase_mm = 50;

// Corners in the order T1 … T4, counter-clockwise for the camera.
std::vector<SpindleTarget> Corners(const Triple& right_mm, const Triple& up_mm,
                                   const Triple& facing) {
  const Triple low_left = (-0.5) * right_mm - 0.5 * up_mm;
  const Triple places[] = {low_left, low_left + right_mm, low_left + right_mm + up_mm,
                           low_left + up_mm};
  std::vector<SpindleTarget> targets;
  for (const Triple& place : places) {
    SpindleTarget target;
    target.id = static_cast<int>(targets.size()) + 1;
    target.ideal_mm = place;
    target.facing = facing;
    targets.push_back(target);
  }
  return targets;
}

}  // namespace

std::vector<std::array<Lever, 2>> JoggedLevers() {
  constexpr Lever kMiddles_mm[] = {{4, 10}, {14, 26}, {14, 42}, {-4, 42}};
  std::vector<std::array<Lever, 2>> levers;
  for (const Lever& middle : kMiddles_mm) {
    levers.push_back(
        {Lever{middle[0] - kHalfBase_mm, middle[1]}, Lever{middle[0] + kHalfBase_mm, middle[1]}});
  }
  return levers;
}

std::vector<SpindleStop> StopsFor(const SpindleSetup& setup, double distance_mm,
                                  const std::vector<std::array<Lever, 2>>& levers) {
  TRAMMEL_CHECK(levers.size() == setup.part.targets.size(), "{} levers for {} targets",
                levers.size(), setup.part.targets.size());
  const Place meant = {setup.part.origin_mm, TurnOf(setup.part.angles_rad)};
  const Turn spindle = SpindleTurn(setup.machine, 0);
  std::vector<SpindleStop> stops;
  for (std::size_t i = 0; i < levers.size(); ++i) {
    const Triple target = meant.Out(setup.part.targets[i].ideal_mm);
    for (const Lever& lever : levers[i]) {
      const Triple ahead = {lever[0], lever[1], setup.lens.offset_mm[2] - distance_mm};
      stops.push_back({target - spindle * ahead, 0});
    }
  }
  return stops;
}

SpindleSetup LaboratoryScene(double distance_mm) {
  SpindleSetup setup;
  setup.part.origin_mm = {1400, 1000, 250};
  setup.part.targets = Corners({1500, 0, 0}, {0, 1000, 0}, {0, 0, 1});
  setup.stops = StopsFor(setup, distance_mm, JoggedLevers());
  return setup;
}

SpindleSetup IndustryScene(double distance_mm) {
  SpindleSetup setup;
  setup.machine.along_y = true;
  setup.machine.travel_high_mm = {12000, 3000, 5000};
  setup.part.origin_mm = {6000, 2400, 2200};
  setup.part.targets = Corners({10000, 0, 0}, {0, 0, 3000}, {0, -1, 0});
  setup.stops = StopsFor(setup, distance_mm, JoggedLevers());
  return setup;
}

}  // namespace trammel::sim
