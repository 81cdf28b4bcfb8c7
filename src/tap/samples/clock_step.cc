#include "tap/samples/clock_step.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

constexpr float kOff = 0.15F;             // deviation from the grid, in periods
constexpr std::size_t kMaxIrregular = 3;  // distances: more are no steps, but a clock that scatters
constexpr std::size_t kMinBeside = 4;     // samples on either side of a step
constexpr std::size_t kMaxBeside = 12;

// Computes the distance in periods, beyond whole periods.
float OffGrid(float distance, float period_s) {
  const float periods = distance / period_s;
  return periods - std::max(1.0F, std::nearbyint(periods));
}

// Computes the mean distance in time from the grid through `from`, over the adjacent samples on one
// side; NaN if there are too few up to the next irregular distance.
double MeanOff(std::span<const float> time_s, std::size_t from, int way, double period_s) {
  double sum = 0;
  std::size_t count = 1;
  std::size_t at = from;
  const std::size_t last = way > 0 ? time_s.size() - 1 : 0;
  while (at != last && count < kMaxBeside) {
    const std::size_t next = way > 0 ? at + 1 : at - 1;
    const float distance = std::abs(time_s[next] - time_s[at]);
    at = next;
    if (distance == 0) {
      continue;  // a time that repeats
    }
    if (std::abs(OffGrid(distance, static_cast<float>(period_s))) > kOff) {
      break;
    }
    const double off_s = time_s[at] - time_s[from];
    sum += off_s - period_s * std::nearbyint(off_s / period_s);
    ++count;
  }
  return count < kMinBeside ? std::nan("") : sum / static_cast<double>(count);
}

}  // namespace

ClockSteps TakeOutClockSteps(std::span<float> time_s, double period_s) {
  ClockSteps steps;
  const auto period = static_cast<float>(period_s);
  if (!(period > 0)) {
    return steps;
  }
  const float least = (1 - kOff) * period;
  const float most = (1 + kOff) * period;
  if (CountPairs(time_s, [=](float a, float b) { return (b - a < least) | (b - a > most); }) == 0) {
    return steps;
  }
  std::array<std::size_t, kMaxIrregular> irregular{};
  std::size_t count = 0;
  for (std::size_t i = 1; i < time_s.size(); ++i) {
    const float distance = time_s[i] - time_s[i - 1];
    if (distance == 0 || std::abs(OffGrid(distance, period)) <= kOff) {
      continue;
    }
    if (count == irregular.size()) {
      return steps;
    }
    irregular[count++] = i;
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = irregular[k];
    const double gap_s = time_s[at] - time_s[at - 1];
    const double step_s =
        gap_s - period_s + MeanOff(time_s, at, 1, period_s) - MeanOff(time_s, at - 1, -1, period_s);
    // A sample next to the gap may itself be late: the next one is on the grid, then.
    if (!(std::abs(OffGrid(static_cast<float>(step_s) + period, period)) > kOff)) {
      continue;
    }
    (step_s > 0 ? steps.forward_s : steps.backward_s) += std::abs(step_s);
    for (std::size_t i = at; i < time_s.size(); ++i) {
      time_s[i] -= static_cast<float>(step_s);
    }
  }
  return steps;
}

}  // namespace trammel::tap
