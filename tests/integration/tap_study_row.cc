#include "tap_study_row.h"

#include <cstdlib>

namespace trammel {

std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

TapRow NamedRow(const char* name, Demand demand, const char* cell) {
  TapRow row;
  row.name = name;
  row.demand = demand;
  row.cell = sim::CellByName(cell).value();
  return row;
}

sim::SimulatedTap SimulateRow(TapRow& row, std::uint64_t seed) {
  Random random(seed);
  if (row.draw != nullptr) row.draw(row, random);
  sim::TapScene scene = row.scene;
  scene.surface_z_mm = random.Uniform(-0.05, 0.05);
  scene.start_time_s = random.Uniform(50, 500);
  return sim::SimulateTap(row.cell, scene, random);
}

std::vector<tap::Move> MovesOf(const sim::SimulatedTap& simulated) {
  std::vector<tap::Move> moves;
  for (const sim::ZMove& move : simulated.moves) {
    moves.push_back({move.start_time_s, move.duration_s, move.start_velocity_mm_s,
                     move.acceleration_mm_s2, move.start_z_mm, move.z_direction});
  }
  return moves;
}

}  // namespace trammel
