#include "tap/samples/check_input.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

// Unknowns of the simplest model of a break: where it is, two of the baseline, one of the press;
// one sample more tells something of the noise.
constexpr std::size_t kLeastSamples = 5;
// Of the pull-back's cruise that may lie before or after the samples.
constexpr double kMostOutside = 0.5;
constexpr double kMostForce_g = 1e12;  // counts of a 32-bit converter, not yet scaled, lie below
constexpr double kMostTime_s = 1e9;

// Samples of which something does not hold. Counted in numbers as wide as the samples and without
// branches, so that the processor compares several in one instruction.
template <class Holds>
std::size_t CountUnless(std::size_t first, std::size_t end, const Holds& holds) {
  constexpr std::size_t kRuns = 4;
  std::array<double, kRuns> counts{};
  std::size_t i = first;
  for (; i + kRuns <= end; i += kRuns) {
    for (std::size_t k = 0; k < kRuns; ++k) {
      counts[k] += holds(i + k) ? 0.0 : 1.0;
    }
  }
  for (; i < end; ++i) {
    counts[0] += holds(i) ? 0.0 : 1.0;
  }
  return static_cast<std::size_t>(counts[0] + counts[1] + counts[2] + counts[3]);
}

Finding CheckSamples(const TapView& tap) {
  const double* const time_s = tap.time_s.data();
  const double* const force_g = tap.force_g.data();
  const std::size_t n = tap.time_s.size();
  // Written so that NaN counts.
  const std::size_t not_finite = CountUnless(0, n, [=](std::size_t i) {
    return (std::abs(time_s[i]) <= kMostTime_s) & (std::abs(force_g[i]) <= kMostForce_g);
  });
  const std::size_t unsorted =
      CountUnless(1, n, [=](std::size_t i) { return !(time_s[i] < time_s[i - 1]); });
  if (not_finite > 0) {
    return {FindingCode::kNotFinite, static_cast<double>(not_finite), 0};
  }
  if (unsorted > 0) {
    return {FindingCode::kUnsortedTimes, static_cast<double>(unsorted), 0};
  }
  return {};
}

}  // namespace

Finding CheckInput(const TapView& tap, TapMotion& motion) {
  const std::size_t n = std::min(tap.time_s.size(), tap.force_g.size());
  if (n < kLeastSamples || tap.time_s.size() != tap.force_g.size()) {
    return {FindingCode::kNoSamples, static_cast<double>(n), kLeastSamples};
  }
  if (n > kMostSamples) {
    return {FindingCode::kTooManySamples, static_cast<double>(n), kMostSamples};
  }
  if (const Finding found = CheckSamples(tap); found.code != FindingCode::kNone) {
    return found;
  }
  if (tap.moves.size() > kMostMoves) {
    return {FindingCode::kAbsurdMoves, static_cast<double>(tap.moves.size()), kMostMoves};
  }
  if (const Finding found = FindMotion(tap.moves, motion); found.code != FindingCode::kNone) {
    return found;
  }
  const double cruise_s = motion.cruise_end_s - motion.cruise_start_s;
  const double covered_s = std::min(tap.time_s.back(), motion.cruise_end_s) -
                           std::max(tap.time_s.front(), motion.cruise_start_s);
  const double outside_s = cruise_s - std::max(0.0, covered_s);
  if (outside_s > kMostOutside * cruise_s) {
    return {FindingCode::kMovesOutside, outside_s, kMostOutside * cruise_s};
  }
  return {};
}

}  // namespace trammel::tap
