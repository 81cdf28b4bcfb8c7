// G-code that the virtual printer prints: interpreted, and its motion planned.
#include <cmath>

#include "fuzz.h"
#include "sim/print/gcode_interpreter.h"
#include "sim/print/planner.h"

TRAMMEL_FUZZ_TARGET(sim_gcode)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto program = sim::InterpretGcode(fuzz::Text(data, size), {});
  if (!fuzz::Good(program)) return 0;
  double end_s = 0;
  for (const sim::TimedMove& timed : sim::PlanMotion(program->moves)) {
    fuzz::Require(std::isfinite(timed.end_s()) && timed.start_s >= end_s - 1e-6,
                  "moves follow each other in time");
    end_s = timed.end_s();
  }
  return 0;
}
