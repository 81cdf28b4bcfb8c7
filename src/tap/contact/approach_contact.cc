#include "tap/contact/approach_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tap/contact/press_profile.h"
#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

// Height above the halt that is used, in presses (from the halt up to the break).
constexpr double kPresses = 4;
constexpr std::size_t kMinPressed = 3;  // samples between collision and halt
constexpr std::size_t kMinFree = 5;
// Permitted difference of both contacts: backlash and stretch of a Z drive, and four samples'
// distance at the approach's speed. Recorded healthy taps are below 8 um.
constexpr double kUsual_mm = 0.02;
constexpr double kSamplesApart = 4;

}  // namespace

void CheckApproach(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                   Workspace& workspace, TapAnalysis& result) {
  const double press_mm = result.contact_mm.value - motion.halt_z_mm;
  if (!motion.has_approach || result.verdict != Verdict::kGood || !(press_mm > 0)) {
    return;
  }
  const double end_s = motion.approach_end_s + options.latency_s - clean.origin_s;
  const double from_s = end_s - kPresses * press_mm / motion.approach_speed_mm_s;
  const std::span<const float> times = clean.samples.time_s;
  const auto first = std::lower_bound(times.begin(), times.end(), from_s);
  const auto last = std::lower_bound(first, times.end(), end_s);
  const auto n = static_cast<std::size_t>(last - first);
  const Workspace::Scope scope(workspace);
  const std::span<double> y = workspace.Take<double>(n);
  const std::span<double> force = workspace.Take<double>(n);
  if (n < kMinPressed + kMinFree || force.empty() || !(*(last - 1) > *first)) {
    return;
  }
  // Backwards in time, so that height rises.
  const auto offset = static_cast<std::size_t>(first - times.begin());
  const double duration_s = *(last - 1) - *first;
  const double sign = result.force.press_g[0] < 0 ? -1 : 1;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t from = offset + n - 1 - i;
    y[i] = (*(last - 1) - times[from]) / duration_s;
    force[i] = sign * (clean.samples.force_g[from] + clean.origin_g - result.force.baseline_g);
  }
  const PressProfile profile({y, force, {}}, workspace);
  if (!profile.Ready()) {
    return;
  }
  PressProfile::At best{};
  best.sum_squares[0] = std::numeric_limits<double>::infinity();
  constexpr std::size_t kMaxTried = 20;  // break points; the check needs no more
  const std::size_t step = 1 + n / kMaxTried;
  for (std::size_t below = kMinPressed; below + kMinFree < n; below += step) {
    const PressProfile::At tried = profile.Evaluate(y[below], below);
    if (tried.start_slope[0] > 0 && tried.sum_squares[0] < best.sum_squares[0]) best = tried;
  }
  if (!std::isfinite(best.sum_squares[0])) {
    return;
  }
  const double deepest_s = *(last - 1) + clean.origin_s - options.latency_s;
  const double z_mm =
      motion.halt_z_mm +
      motion.approach_speed_mm_s * (motion.approach_end_s - deepest_s + best.t * duration_s);
  const double spacing_mm = motion.approach_speed_mm_s * duration_s / static_cast<double>(n - 1);
  const double usual_mm = std::max(kUsual_mm, kSamplesApart * spacing_mm);
  if (std::abs(z_mm - result.contact_mm.value) > usual_mm) {
    result.Notice({FindingCode::kApproachDiffers, z_mm - result.contact_mm.value, usual_mm});
  }
}

}  // namespace trammel::tap
