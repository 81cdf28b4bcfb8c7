#include "tap/contact/press_stretch.h"

#include <algorithm>

#include "tap/contact/break_search.h"

namespace trammel::tap {

bool SelectCruise(const CleanTap& clean, const TapMotion& motion, double latency_s,
                  Workspace& workspace, PressStretch& stretch) {
  const std::span<const float> times = clean.samples.time_s;
  const double start_s = motion.cruise_start_s + latency_s - clean.origin_s;
  const double end_s = motion.cruise_end_s + latency_s - clean.origin_s;
  const auto first = std::lower_bound(times.begin(), times.end(), start_s);
  const auto last = std::upper_bound(first, times.end(), end_s);
  const auto n = static_cast<std::size_t>(last - first);
  for (std::span<double>* array : stretch.Arrays()) {
    *array = workspace.Take<double>(n);
  }
  if (n < kMinInCruise || stretch.scratch.empty() || !(*(last - 1) > *first)) {
    return false;
  }
  const double first_s = *first;
  const double duration_s = *(last - 1) - first_s;
  stretch.z0_mm = motion.CruiseZ(first_s + clean.origin_s - latency_s);
  stretch.span_mm = motion.pull_back_speed_mm_s * duration_s;
  const std::span<const float> force =
      clean.samples.force_g.subspan(static_cast<std::size_t>(first - times.begin()), n);
  // Sign of the press by the fall of the force: its first quarter against its last.
  double fall = 0;
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    sum += force[i];
    fall += i < n / 4 ? force[i] - force[n - 1 - i] : 0;
  }
  const double mean = sum / static_cast<double>(n);
  stretch.sign = fall < 0 ? -1 : 1;
  stretch.mean_g = clean.origin_g + mean;
  for (std::size_t i = 0; i < n; ++i) {
    const double time_s = *(first + static_cast<std::ptrdiff_t>(i));
    stretch.time_s[i] = time_s;
    stretch.y[i] = (time_s - first_s) / duration_s;
    stretch.force[i] = stretch.sign * (force[i] - mean);
  }
  return true;
}

void TrimStart(std::size_t count, PressStretch& stretch) {
  for (std::span<double>* array : stretch.Arrays()) {
    *array = array->subspan(count);
  }
  const double start = stretch.y[0];
  for (double& y : stretch.y) {
    y = (y - start) / (1 - start);
  }
  stretch.z0_mm += start * stretch.span_mm;
  stretch.span_mm *= 1 - start;
}

void CropBaseline(PressStretch& stretch, Workspace& workspace) {
  constexpr double kPresses = 6;  // including the press itself
  constexpr std::size_t kMin = 60;
  constexpr double kWorthwhile = 0.8;
  while (stretch.y.size() > 2 * kMin) {
    const Workspace::Scope scope(workspace);
    const PressProfile profile(stretch.Samples(), workspace);
    const Scan scan = profile.Ready() ? ScanSamples(profile, workspace) : Scan{};
    if (scan.size() < 2) {
      return;
    }
    const auto best = std::min_element(scan.begin(), scan.end(),
                                       [](const PressProfile::At& a, const PressProfile::At& b) {
                                         return SumSquares(a, 0) < SumSquares(b, 0);
                                       });
    const double break_at_most = best->t + scan[1].t - scan[0].t;
    const std::size_t count = std::max(kMin, profile.Below(kPresses * break_at_most));
    if (static_cast<double>(count) > kWorthwhile * static_cast<double>(stretch.y.size())) {
      return;
    }
    for (std::span<double>* array : stretch.Arrays()) {
      *array = array->first(count);
    }
    const double end = stretch.y.back();
    for (double& y : stretch.y) {
      y /= end;
    }
    stretch.span_mm *= end;
  }
}

}  // namespace trammel::tap
