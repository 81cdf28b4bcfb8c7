#include "sim/spindle/spindle_board.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/check.h"

namespace trammel::sim {
namespace {

constexpr std::uint64_t kSheet = 11;
constexpr std::uint64_t kMachine = 12;
constexpr std::uint64_t kApproaches = 13;
constexpr std::uint64_t kTouches = 14;
constexpr std::uint64_t kCentres = 15;

Triple Bent(const SpindleMachine& machine, const Triple& s) {
  return {
      s[0] * (1 + machine.scale[0]) + machine.square_xy_rad * s[1] + machine.square_xz_rad * s[2],
      s[1] * (1 + machine.scale[1]) + machine.square_yz_rad * s[2], s[2] * (1 + machine.scale[2])};
}

Triple Noise(double sigma, Random& random) {
  Triple drawn;
  for (double& value : drawn) value = random.Normal(0, sigma);
  return drawn;
}

std::vector<std::array<double, 2>> PlacesOf(const BoardSheet& sheet) {
  if (!sheet.places_mm.empty()) return sheet.places_mm;
  std::vector<std::array<double, 2>> places_mm;
  for (int row = 0; row < sheet.rows; ++row) {
    for (int column = 0; column < sheet.columns; ++column) {
      places_mm.push_back({sheet.pitch_mm * column - (sheet.columns - 1) * sheet.pitch_mm / 2,
                           (sheet.rows - 1) * sheet.pitch_mm / 2 - row * sheet.pitch_mm});
    }
  }
  return places_mm;
}

void DrawSheet(const BoardSetup& setup, Random random, BoardWorld& world) {
  const BoardSheet& sheet = setup.sheet;
  const double stretch_x = 1 + random.Uniform(-sheet.print_scale, sheet.print_scale);
  const double stretch_y = 1 + random.Uniform(-sheet.print_scale, sheet.print_scale);
  const double along_rad = random.Uniform(0, std::numbers::pi);
  const double side = random.Uniform() < 0.5 ? -1 : 1;
  const double yaw_rad = random.Uniform(-std::numbers::pi, std::numbers::pi);
  const double lean_x = random.Uniform(-sheet.lean_rad, sheet.lean_rad);
  const double lean_y = random.Uniform(-sheet.lean_rad, sheet.lean_rad);
  world.machine_from_sheet.turn = TurnX(lean_x) * TurnY(lean_y) * TurnZ(yaw_rad);
  world.machine_from_sheet.origin_mm =
      sheet.middle_mm + Triple{random.Uniform(-sheet.off_mm, sheet.off_mm),
                               random.Uniform(-sheet.off_mm, sheet.off_mm), 0};
  const auto places_mm = PlacesOf(sheet);
  double half_mm = 0;
  for (const auto& place : places_mm) half_mm = std::max(half_mm, std::hypot(place[0], place[1]));
  for (const auto& place : places_mm) {
    const double x = stretch_x * place[0];
    const double y = stretch_y * place[1];
    const double across = (x * std::cos(along_rad) + y * std::sin(along_rad)) / half_mm;
    const double slope = -2 * side * sheet.bend_mm * across / half_mm;
    Triple at = {x, y, side * sheet.bend_mm * (0.5 - across * across)};
    at[0] += random.Normal(0, sheet.print_error_mm);
    at[1] += random.Normal(0, sheet.print_error_mm);
    world.marks_mm.push_back(world.machine_from_sheet.Out(at));
    const Triple normal = UnitOf({-slope * std::cos(along_rad), -slope * std::sin(along_rad), 1});
    world.normals.push_back(world.machine_from_sheet.turn * normal);
  }
}

void DrawApproaches(const BoardSetup& setup, Random random, BoardWorld& world) {
  double index_rad = 0;
  for (std::size_t i = 0; i < setup.stops.size(); ++i) {
    if (i == 0 || setup.stops[i].c_rad != setup.stops[i - 1].c_rad) {
      index_rad = random.Normal(0, setup.machine.index_rad);
    }
    world.index_rad.push_back(index_rad);
    Triple actual = ActualFor(world, setup.stops[i].stated_mm, random);
    const auto steps = static_cast<double>(std::max<std::size_t>(1, setup.stops.size() - 1));
    const double part = static_cast<double>(i) / steps;
    actual[2] -= setup.machine.warms_by_mm * part;
    world.actual_mm.push_back(actual);
  }
}

// Draws touches; the tool's tip is on the spindle's axis, below the gauge line by its actual
// length.
void DrawTouches(const BoardSetup& setup, Random random, BoardWorld& world) {
  const double length_mm = setup.tool_length_mm + random.Normal(0, setup.machine.tool_length_mm);
  for (const int mark : setup.touched) {
    const Triple at = world.marks_mm.at(static_cast<std::size_t>(mark - 1));
    const Triple from_tip = world.lean * Triple{0, 0, length_mm};
    const Triple spindle = at + from_tip + Noise(setup.machine.touch_mm, random);
    world.touches.push_back(
        {mark, StatedFor(world.machine, spindle + Noise(setup.machine.repeatability_mm, random))});
  }
}

}  // namespace

Triple ActualFor(const BoardWorld& world, const Triple& stated_mm, Random& random) {
  return Bent(world.machine, stated_mm) + Noise(world.setup.machine.repeatability_mm, random);
}

Triple StatedFor(const SpindleMachine& machine, const Triple& actual_mm) {
  Triple stated;
  stated[2] = actual_mm[2] / (1 + machine.scale[2]);
  stated[1] = (actual_mm[1] - machine.square_yz_rad * stated[2]) / (1 + machine.scale[1]);
  stated[0] =
      (actual_mm[0] - machine.square_xy_rad * stated[1] - machine.square_xz_rad * stated[2]) /
      (1 + machine.scale[0]);
  return stated;
}

std::vector<SpindleStation> BoardStations(const BoardSetup& setup, int per_turn, int heights,
                                          double reach_mm, double low_mm, double high_mm,
                                          const std::vector<double>& c_rad) {
  // Low-discrepancy sequence of the plane (Roberts 2018): powers of the root of x^3 = x + 1.
  constexpr double kFirst = 0.7548776662466927;
  constexpr double kSecond = 0.5698402909980532;
  std::vector<SpindleStation> stops;
  for (const double c : c_rad) {
    for (int k = 0; k < per_turn; ++k) {
      const double u = std::fmod(0.5 + kFirst * (k + 1), 1.0);
      const double v = std::fmod(0.5 + kSecond * (k + 1), 1.0);
      const double part = heights > 1 ? static_cast<double>(k % heights) / (heights - 1) : 0;
      const double height_mm = low_mm + (high_mm - low_mm) * part;
      const Triple& middle = setup.sheet.middle_mm;
      stops.push_back({{middle[0] + reach_mm * (2 * u - 1), middle[1] + reach_mm * (2 * v - 1),
                        middle[2] + height_mm - setup.lens.offset_mm[2]},
                       c});
    }
  }
  return stops;
}

BoardWorld DrawBoardWorld(const BoardSetup& setup, std::uint64_t seed) {
  const Random of_seed(seed);
  BoardWorld world;
  world.setup = setup;
  DrawSheet(setup, of_seed.Fork(kSheet), world);
  Random machine = of_seed.Fork(kMachine);
  world.machine.scale = Noise(setup.machine.scale, machine);
  const Triple square = Noise(setup.machine.square_rad, machine);
  world.machine.square_xy_rad = square[0];
  world.machine.square_xz_rad = square[1];
  world.machine.square_yz_rad = square[2];
  const Triple lean = Noise(setup.machine.lean_rad, machine);
  world.lean = TurnX(lean[0]) * TurnY(lean[1]);
  DrawApproaches(setup, of_seed.Fork(kApproaches), world);
  DrawTouches(setup, of_seed.Fork(kTouches), world);
  world.noise = of_seed.Fork(kCentres);
  return world;
}

SpindleLens LensAt(const BoardWorld& world, std::size_t stop) {
  const BoardMishap& mishap = world.setup.mishap;
  SpindleLens lens = world.setup.lens;
  const bool later = mishap.lens_moves_after > 0 && stop >= mishap.lens_moves_after;
  if (later || (mishap.every_other && stop % 2 == 1)) lens.focal_length_mm *= mishap.focal_factor;
  return lens;
}

Triple MarkAt(const BoardWorld& world, std::size_t stop, std::size_t mark) {
  const BoardMishap& mishap = world.setup.mishap;
  const Triple at = world.marks_mm.at(mark);
  if (mishap.board_moves_after == 0 || stop < mishap.board_moves_after) return at;
  const auto marks = static_cast<double>(world.marks_mm.size());
  if (static_cast<double>(mark) >= mishap.board_share * marks) return at;
  const Triple& middle = world.machine_from_sheet.origin_mm;
  return middle + TurnZ(mishap.board_by_rad) * (at - middle) + mishap.board_by_mm;
}

Place MachineFromCamera(const BoardWorld& world, std::size_t stop) {
  const BoardMishap& mishap = world.setup.mishap;
  const double c_rad = world.setup.stops.at(stop).c_rad + world.index_rad.at(stop);
  const Place machine_from_taper = {world.actual_mm.at(stop), world.lean * TurnZ(c_rad)};
  Place taper_from_camera = {world.setup.lens.offset_mm, TurnOf(world.setup.lens.angles_rad)};
  if (mishap.camera_moves_after > 0 && stop >= mishap.camera_moves_after) {
    taper_from_camera.origin_mm = taper_from_camera.origin_mm + mishap.camera_by_mm;
    taper_from_camera.turn = TurnOf(mishap.camera_by_rad) * taper_from_camera.turn;
  }
  return machine_from_taper * taper_from_camera;
}

std::vector<SpindleObservation> Look(const BoardWorld& world, std::size_t stop, double margin_px,
                                     Random& random) {
  std::vector<SpindleObservation> seen;
  const SpindleLens lens = LensAt(world, stop);
  const Place machine_from_camera = MachineFromCamera(world, stop);
  for (std::size_t mark = 0; mark < world.marks_mm.size(); ++mark) {
    const double column_noise = random.Normal(0, world.setup.sigma_px);
    const double row_noise = random.Normal(0, world.setup.sigma_px);
    const auto pixel = SeenAt(lens, machine_from_camera.In(MarkAt(world, stop, mark)));
    if (!pixel || !InPicture(lens, *pixel, margin_px)) continue;
    seen.push_back({mark, *pixel, {(*pixel)[0] + column_noise, (*pixel)[1] + row_noise}});
  }
  return seen;
}

SpindlePicture BoardPictureAt(const BoardWorld& world, std::size_t stop,
                              const std::vector<RingPattern>& patterns,
                              const SpindlePicture& like) {
  TRAMMEL_CHECK(patterns.size() == world.marks_mm.size(), "{} marks, {} patterns",
                world.marks_mm.size(), patterns.size());
  SpindlePicture picture = like;
  picture.lens = LensAt(world, stop);
  picture.targets.clear();
  const Place camera_from_machine = Back(MachineFromCamera(world, stop));
  const Turn& sheet = world.machine_from_sheet.turn;
  const Triple right = {sheet[0][0], sheet[1][0], sheet[2][0]};
  for (std::size_t mark = 0; mark < world.marks_mm.size(); ++mark) {
    const Triple& z = world.normals[mark];
    const Triple x = UnitOf(right - Dot(right, z) * z);
    const Place machine_from_target = {MarkAt(world, stop, mark), Back(Turn{x, Cross(z, x), z})};
    PlacedTarget placed;
    placed.camera_from_target = camera_from_machine * machine_from_target;
    placed.pattern = patterns[mark];
    picture.targets.push_back(std::move(placed));
  }
  return picture;
}

Place TaperFromCameraAsHeld(const BoardWorld& world) {
  const double c_rad = world.setup.stops.front().c_rad;
  const Turn held = TurnZ(-c_rad) * world.lean * TurnZ(c_rad + world.index_rad.front());
  const Place taper_from_camera = {world.setup.lens.offset_mm, TurnOf(world.setup.lens.angles_rad)};
  return Place{{0, 0, 0}, held} * taper_from_camera;
}

}  // namespace trammel::sim
