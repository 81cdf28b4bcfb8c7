#include "sim/cell/simulated_tap.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace trammel::sim {
SimulatedTap SimulateTap(const CellTraits& traits, const TapScene& scene, Random& random) {
  TRAMMEL_CHECK(scene.press_mm >= 0, "press_mm = {}", scene.press_mm);
  const TapMotion& motion = scene.motion;
  const double halt_z_mm = scene.press_mm > 0
                               ? scene.surface_z_mm - PlayOf(traits.press) - scene.press_mm
                               : HaltZ(traits, motion, scene.surface_z_mm, random);
  SimulatedTap tap;
  tap.moves = ApproachMoves(motion, scene.start_time_s,
                            scene.surface_z_mm + motion.approach_from_mm, halt_z_mm);
  const double stop_s = tap.moves.back().start_time_s + tap.moves.back().duration_s;
  const std::vector<ZMove> back = PullBackMoves(motion, stop_s, halt_z_mm);
  tap.moves.insert(tap.moves.end(), back.begin(), back.end());
  const double touch_s = stop_s - (scene.surface_z_mm - halt_z_mm) / motion.approach_speed_mm_s;
  const double from_s = touch_s - scene.lead_s;
  const double until_s = back.back().start_time_s + back.back().duration_s + scene.tail_s;
  LoadCell cell(traits, from_s, random.Fork(1));
  SampleCorruptor corruptor(traits, from_s, random.Fork(2));
  (void)random.Bits();  // the forks of the next tap are others
  const NozzleAt nozzle = [&](double time_s) -> NozzleState {
    const ZState z = StateAt(tap.moves, time_s);
    return {z.z_mm, z.velocity_mm_s, scene.surface_z_mm};
  };
  while (cell.next_time_s() < until_s) {
    CellSample sample = cell.Next(nozzle);
    if (!corruptor.Pass(sample)) continue;
    tap.time_s.push_back(sample.time_s);
    tap.force_g.push_back(sample.force_g);
  }
  const std::vector<PressTruth> presses = cell.TakePresses();
  if (!presses.empty()) tap.truth = presses.back();
  tap.latency_s = cell.latency_s();
  return tap;
}

}  // namespace trammel::sim
