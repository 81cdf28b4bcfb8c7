#include "sim/print/world.h"

#include <fmt/format.h>

#include "base/measured.h"

namespace trammel::sim {
namespace {

// Streams of a world; new parts of it get new numbers, so that old worlds stay what they are.
enum Stream : std::uint64_t { kTruth = 1, kTraits, kPrint, kPhotoEye, kLaserEye = 100 };

constexpr Interval kTruthS{0.015, 0.045};  // the middle half of what a pattern tests by default

}  // namespace

double TruthOf(std::uint64_t seed) {
  return Random(seed).Fork(kTruth).Uniform(kTruthS.lo, kTruthS.hi);
}

Result<Print> PrintInWorld(std::string_view gcode, std::uint64_t seed,
                           std::optional<double> k_star_s) {
  const Random world(seed);
  if (!k_star_s) k_star_s = TruthOf(seed);
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
