#include "pressure_advance/response/head_motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace trammel::pressure_advance {

HeadMotion::HeadMotion(const LineMotion& motion)
    : slow_mm_s_(motion.segments[0].speed_mm_s), fast_mm_s_(motion.segments[1].speed_mm_s) {
  const double length_mm = *motion.length_mm;
  const double a = *motion.acceleration_mm_s2;
  const double last_mm_s = motion.segments[2].speed_mm_s;
  const double fast_mm = motion.segments[1].fraction * length_mm;
  // A short fast stretch ends before its speed is reached.
  const double peak_mm_s = std::min(
      fast_mm_s_, std::sqrt(a * fast_mm + (slow_mm_s_ * slow_mm_s_ + last_mm_s * last_mm_s) / 2));
  const double rise_s = (peak_mm_s - slow_mm_s_) / a;
  const double fall_s = (peak_mm_s - last_mm_s) / a;
  const double ramps_mm =
      rise_s * (peak_mm_s + slow_mm_s_) / 2 + fall_s * (peak_mm_s + last_mm_s) / 2;
  const double even_s = std::max(0.0, fast_mm - ramps_mm) / peak_mm_s;
  // Time 0 is the first change of speed; before it the head moves evenly.
  phases_.push_back({0, {0, 0, motion.segments[0].fraction * length_mm / 2, slow_mm_s_ / 6, 0}});
  Continue(0, slow_mm_s_, a);
  Continue(rise_s, peak_mm_s, 0);
  Continue(rise_s + even_s, peak_mm_s, -a);
  const double fallen_s = rise_s + even_s + fall_s;
  Continue(fallen_s, last_mm_s, 0);
  constexpr double kBeyond_mm = 1;
  DivideTime(fallen_s + (motion.segments[2].fraction * length_mm + kBeyond_mm) / last_mm_s);
}

HeadMotion::Way HeadMotion::At(double time_s) const {
  auto phase = phases_.end() - 1;
  while (phase != phases_.begin() && time_s < phase->begin_s) --phase;
  const double t = time_s - phase->begin_s;
  const auto& c = phase->twice_integrated;
  return {c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * c[4]))),
          c[1] + t * (2 * c[2] + t * (3 * c[3] + t * 4 * c[4])),
          2 * c[2] + t * (6 * c[3] + t * 12 * c[4]), 6 * c[3] + t * 24 * c[4]};
}

void HeadMotion::Continue(double from_s, double speed_mm_s, double acceleration_mm_s2) {
  const Way way = At(from_s);
  phases_.push_back({from_s,
                     {way.twice_integrated, way.integrated, way.mm / 2, speed_mm_s / 6,
                      acceleration_mm_s2 / 24}});
}

void HeadMotion::DivideTime(double end_s) {
  constexpr double kBefore_s = 0.15;  // of the first change, which averaging sees ahead
  constexpr double kShortest_s = 0.002;
  // Cells are short from kAhead_s before a change of speed until kAfter_s behind it; then they grow
  // with the time that has passed.
  constexpr double kAhead_s = 0.06, kAfter_s = 0.03, kGrowth = 0.05;
  for (double t = -kBefore_s; t < end_s;) {
    times_s_.push_back(t);
    double cell_s = end_s - t;
    for (const Phase& phase : phases_) {
      const double ahead_s = phase.begin_s - kAhead_s - t;
      const double behind_s = t - phase.begin_s - kAfter_s;
      cell_s = std::min(cell_s, std::max(kShortest_s, ahead_s > 0 ? ahead_s : kGrowth * behind_s));
    }
    t += cell_s;
  }
  times_s_.push_back(end_s);
  for (const double t : times_s_) positions_mm_.push_back(At(t).mm);
}

HeadMotion::Drive HeadMotion::Averaged(double width_s) const {
  constexpr double kNoWidth_s = 1e-6;
  Drive drive;
  const double half_s = width_s / 2;
  for (const double t : times_s_) {
    const Way here = At(t);
    if (width_s < kNoWidth_s) {
      drive.position_mm.push_back(here.mm);
      drive.speed_mm_s.push_back(here.mm_s);
      continue;
    }
    const Way before = At(t - half_s), after = At(t + half_s);
    drive.position_mm.push_back(
        (before.twice_integrated - 2 * here.twice_integrated + after.twice_integrated) /
        (half_s * half_s));
    drive.speed_mm_s.push_back((before.integrated - 2 * here.integrated + after.integrated) /
                               (half_s * half_s));
  }
  return drive;
}

}  // namespace trammel::pressure_advance
