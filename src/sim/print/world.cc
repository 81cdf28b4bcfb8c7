#include "sim/print/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "sim/print/gcode_interpreter.h"

namespace trammel::sim {
namespace {

// Streams of a world; new parts of it get new numbers, so that old worlds stay what they are.
enum Stream : std::uint64_t { kTruth = 1, kTraits, kPrint, kPhotoEye, kLaserEye = 100 };

// Whether the second move goes straight on from the first at another speed, both with filament.
bool ChangesSpeed(const Move& first, const Move& second) {
  const double ax = first.to.x_mm - first.from.x_mm;
  const double ay = first.to.y_mm - first.from.y_mm;
  const double bx = second.to.x_mm - second.from.x_mm;
  const double by = second.to.y_mm - second.from.y_mm;
  const double lengths = std::hypot(ax, ay) * std::hypot(bx, by);
  return first.e_mm > 0 && second.e_mm > 0 && lengths > 0 && ax * bx + ay * by > 0.999 * lengths &&
         first.feed_mm_s != second.feed_mm_s;
}

}  // namespace

Interval TestedRange(const Plan& plan) {
  TRAMMEL_CHECK(!plan.lines.empty(), "a plan with {} lines", plan.lines.size());
  Interval range{plan.lines[0].pressure_advance_s, plan.lines[0].pressure_advance_s};
  for (const PlannedLine& line : plan.lines) {
    range.lo = std::min(range.lo, line.pressure_advance_s);
    range.hi = std::max(range.hi, line.pressure_advance_s);
  }
  return range;
}

Result<Interval> TestedRange(std::string_view gcode) {
  const Result<Program> program = InterpretGcode(gcode, InterpreterDefaults{});
  if (!program) return tl::unexpected<Error>(program.error());
  Interval range{std::numeric_limits<double>::infinity(), 0};
  for (std::size_t i = 1; i < program->moves.size(); ++i) {
    if (!ChangesSpeed(program->moves[i - 1], program->moves[i])) continue;
    range.lo = std::min(range.lo, program->moves[i].pressure_advance_s);
    range.hi = std::max(range.hi, program->moves[i].pressure_advance_s);
  }
  if (range.lo > range.hi) {
    return Fail("no line changes its speed, so the file tests no pressure advance");
  }
  return range;
}

double TruthOf(std::uint64_t seed, const Interval& tested_s) {
  const double quarter = (tested_s.hi - tested_s.lo) / 4;
  return Random(seed).Fork(kTruth).Uniform(tested_s.lo + quarter, tested_s.hi - quarter);
}

Result<Print> PrintInWorld(std::string_view gcode, std::uint64_t seed,
                           std::optional<double> k_star_s, const Interval& tested_s) {
  const Random world(seed);
  if (!k_star_s) k_star_s = TruthOf(seed, tested_s);
  if (!(*k_star_s >= 0.0001 && *k_star_s <= 10)) {
    return Fail(fmt::format(
        "a virtual printer's true pressure advance of {} s is outside 0.0001 ... 10", *k_star_s));
  }
  Random traits_random = world.Fork(kTraits);
  Random print_random = world.Fork(kPrint);
  return PrintGcode(gcode, DrawTraits(*k_star_s, traits_random), print_random);
}

Random LaserEyeOf(std::uint64_t seed, const Condition& condition) {
  const auto index = static_cast<std::uint64_t>(condition.plate) * 4 +
                     static_cast<std::uint64_t>(condition.filament) * 2 +
                     (condition.ambient ? 1U : 0U);
  return Random(seed).Fork(kLaserEye + index);
}

Random PhotoEyeOf(std::uint64_t seed) { return Random(seed).Fork(kPhotoEye); }

}  // namespace trammel::sim
