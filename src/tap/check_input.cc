#include "tap/check_input.h"

#include <algorithm>
#include <cmath>

#include "tap/finding.h"

namespace trammel::tap {
namespace {

// Unknowns of the simplest model of a break: where it is, two of the baseline, one of the press;
// one sample more tells something of the noise.
constexpr std::size_t kLeastSamples = 5;
// Of the pull-back's cruise that may lie before or after the samples.
constexpr double kMostOutside = 0.5;
constexpr double kMostForce_g = 1e12;  // counts of a 32-bit converter, not yet scaled, lie below
constexpr double kMostTime_s = 1e9;

Finding CheckSamples(const TapView& tap) {
  const std::size_t n = tap.time_s.size();
  std::size_t not_finite = 0;
  std::size_t unsorted = 0;
  // Without branches, so that the processor compares several samples in one instruction.
  for (std::size_t i = 0; i < n; ++i) {
    // Written so that NaN counts.
    const bool time_is_sound = std::abs(tap.time_s[i]) <= kMostTime_s;
    const bool force_is_sound = std::abs(tap.force_g[i]) <= kMostForce_g;
    not_finite += (time_is_sound & force_is_sound) ? 0 : 1;
  }
  for (std::size_t i = 1; i < n; ++i) {
    unsorted += tap.time_s[i] < tap.time_s[i - 1] ? 1 : 0;
  }
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
