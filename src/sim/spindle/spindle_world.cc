#include "sim/spindle/spindle_world.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "base/check.h"

namespace trammel::sim {

namespace {

constexpr std::uint64_t kPart = 1;
constexpr std::uint64_t kOutOfMachine = 2;
constexpr std::uint64_t kClampings = 100'000;  // then one generator per clamping
constexpr std::uint64_t kHold = 1;
constexpr std::uint64_t kApproach = 2;
constexpr std::uint64_t kObservations = 3;
constexpr std::uint64_t kPictures = 4;
constexpr double kReference_c = 20;

Random ClampingOf(const SpindleName& name) {
  return Random(name.seed).Fork(kClampings + name.clamping);
}

Triple Within(double half_width, Random& random) {
  Triple drawn;
  for (double& value : drawn) value = random.Uniform(-half_width, half_width);
  return drawn;
}

// The order of the draws defines the world of a seed.
Triple Scattered(double sigma, Random& random) {
  Triple drawn;
  for (double& value : drawn) value = random.Normal(0, sigma);
  return drawn;
}

Triple ActualOf(const SpindleMachine& machine, const Triple& stated_mm, Random& random) {
  const Triple& s = stated_mm;
  const Triple bent = {
      s[0] * (1 + machine.scale[0]) + machine.square_xy_rad * s[1] + machine.square_xz_rad * s[2],
      s[1] * (1 + machine.scale[1]) + machine.square_yz_rad * s[2], s[2] * (1 + machine.scale[2])};
  return bent + Scattered(machine.repeatability_mm, random);
}

SpindleClamping Clamp(const ClampingSpread& spread, Random random) {
  SpindleClamping clamping;
  clamping.angle_rad = random.Uniform(-spread.angle_rad, spread.angle_rad);
  for (double& value : clamping.eccentricity_mm) value = random.Normal(0, spread.eccentricity_mm);
  for (double& value : clamping.tilt_rad) value = random.Normal(0, spread.tilt_rad);
  return clamping;
}

}  // namespace

Result<void> Validate(const SpindleSetup& setup) {
  for (std::size_t i = 0; i < setup.stops.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = setup.stops[i].stated_mm[axis];
      const double lo = setup.machine.travel_low_mm[axis];
      const double hi = setup.machine.travel_high_mm[axis];
      if (at >= lo && at <= hi) continue;
      return Fail(fmt::format("stop {} has {} {} mm: the machine travels {} … {}", i + 1,
                              "XYZ"[axis], at, lo, hi));
    }
  }
  return {};
}

SpindleWorld DrawSpindleWorld(const SpindleSetup& setup, const SpindleName& name) {
  SpindleWorld world;
  world.setup = setup;
  const SpindlePart& part = setup.part;
  Random lies = Random(name.seed).Fork(kPart);
  world.machine_from_part.origin_mm = part.origin_mm + Within(part.misplaced_mm, lies);
  world.part_angles_rad = part.angles_rad + Within(part.misplaced_rad, lies);
  world.machine_from_part.turn = TurnOf(world.part_angles_rad);

  Random measured = Random(name.seed).Fork(kOutOfMachine);
  const double warm = 1 + part.expansion_per_k * (part.temperature_c - kReference_c);
  for (const SpindleTarget& target : part.targets) {
    // The stated ideal position is true plus error; so the true one is stated minus error.
    const Triple error =
        part.out_of_machine_scale * target.ideal_mm + Scattered(part.out_of_machine_mm, measured);
    world.targets_mm.push_back(warm * (target.ideal_mm - error));
  }
  world.clamping = Clamp(setup.spread, ClampingOf(name).Fork(kHold));
  Random approach = ClampingOf(name).Fork(kApproach);
  for (const SpindleStation& stop : setup.stops) {
    world.actual_mm.push_back(ActualOf(setup.machine, stop.stated_mm, approach));
  }
  return world;
}

Turn SpindleTurn(const SpindleMachine& machine, double c_rad) {
  return machine.along_y ? TurnX(std::numbers::pi / 2) * TurnZ(c_rad) : TurnZ(c_rad);
}

Place MachineFromCamera(const SpindleWorld& world, std::size_t stop) {
  const SpindleClamping& held = world.clamping;
  const Place machine_from_spindle = {
      world.actual_mm.at(stop), SpindleTurn(world.setup.machine, world.setup.stops.at(stop).c_rad)};
  const Place spindle_from_taper = {
      {held.eccentricity_mm[0], held.eccentricity_mm[1], 0},
      TurnZ(-held.angle_rad) * TurnX(held.tilt_rad[0]) * TurnY(held.tilt_rad[1])};
  const Place taper_from_camera = {world.setup.lens.offset_mm, TurnOf(world.setup.lens.angles_rad)};
  return machine_from_spindle * spindle_from_taper * taper_from_camera;
}

std::vector<SpindleObservation> Look(const SpindleWorld& world, std::size_t stop, double margin_px,
                                     Random& random) {
  std::vector<SpindleObservation> seen;
  const Place machine_from_camera = MachineFromCamera(world, stop);
  for (std::size_t i = 0; i < world.targets_mm.size(); ++i) {
    const double column_noise = random.Normal(0, world.setup.sigma_px);
    const double row_noise = random.Normal(0, world.setup.sigma_px);
    const Triple at = world.machine_from_part.Out(world.targets_mm[i]);
    const Triple facing = world.machine_from_part.turn * world.setup.part.targets[i].facing;
    if (!(Dot(facing, machine_from_camera.origin_mm - at) > 0)) continue;
    const auto pixel = SeenAt(world.setup.lens, machine_from_camera.In(at));
    if (!pixel || !InPicture(world.setup.lens, *pixel, margin_px)) continue;
    seen.push_back({i, *pixel, {(*pixel)[0] + column_noise, (*pixel)[1] + row_noise}});
  }
  return seen;
}

Random ObservationNoiseOf(const SpindleName& name) { return ClampingOf(name).Fork(kObservations); }

Random PicturesOf(const SpindleName& name) { return ClampingOf(name).Fork(kPictures); }

namespace {

constexpr double kHalfBase_mm = 50;

// Returns the corners in the order T1 … T4, counter-clockwise for the camera.
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

std::vector<SpindleStation> StationsFor(const SpindleSetup& setup, double distance_mm,
                                        const std::vector<std::array<Lever, 2>>& levers) {
  TRAMMEL_CHECK(levers.size() == setup.part.targets.size(), "{} levers for {} targets",
                levers.size(), setup.part.targets.size());
  const Place meant = {setup.part.origin_mm, TurnOf(setup.part.angles_rad)};
  const Turn spindle = SpindleTurn(setup.machine, 0);
  std::vector<SpindleStation> stops;
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
  setup.stops = StationsFor(setup, distance_mm, JoggedLevers());
  return setup;
}

SpindleSetup IndustryScene(double distance_mm) {
  SpindleSetup setup;
  setup.machine.along_y = true;
  setup.machine.travel_high_mm = {12000, 3000, 5000};
  setup.part.origin_mm = {6000, 2400, 2200};
  setup.part.targets = Corners({10000, 0, 0}, {0, 0, 3000}, {0, -1, 0});
  setup.stops = StationsFor(setup, distance_mm, JoggedLevers());
  return setup;
}

}  // namespace trammel::sim
