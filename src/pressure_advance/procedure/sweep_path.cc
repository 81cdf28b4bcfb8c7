#include "pressure_advance/procedure/sweep_path.h"

#include <cmath>

#include "base/check.h"

namespace trammel::procedure {

std::vector<PathLeg> PathOf(std::span<const Sweep> run) {
  TRAMMEL_CHECK(!run.empty(), "a run of {} lines", run.size());
  std::vector<PathLeg> legs;
  double way_mm = run.front().PositionOf(run.front().start_x_mm, run.front().start_y_mm);
  const auto add = [&](double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm,
                       const Sweep* sweep) {
    const double length_mm = std::hypot(to_x_mm - from_x_mm, to_y_mm - from_y_mm);
    if (length_mm == 0) return;
    legs.push_back({from_x_mm, from_y_mm, (to_x_mm - from_x_mm) / length_mm,
                    (to_y_mm - from_y_mm) / length_mm, way_mm, length_mm, sweep});
    way_mm += length_mm;
  };
  const Sweep* before = nullptr;
  for (const Sweep& sweep : run) {
    if (before != nullptr) {
      add(before->end_x_mm, before->end_y_mm, sweep.start_x_mm, sweep.start_y_mm, nullptr);
    }
    add(sweep.start_x_mm, sweep.start_y_mm, sweep.end_x_mm, sweep.end_y_mm, &sweep);
    before = &sweep;
  }
  return legs;
}

std::vector<SweptStretch> StretchesOf(std::span<const Sweep> run) {
  std::vector<SweptStretch> stretches;
  for (const PathLeg& leg : PathOf(run)) {
    if (leg.sweep == nullptr) continue;
    const double along = leg.along_x * leg.sweep->along_x + leg.along_y * leg.sweep->along_y;
    const double direction = along < 0 ? -1 : 1;
    const double position_mm = leg.sweep->PositionOf(leg.x_mm, leg.y_mm);
    stretches.push_back({leg.begin_mm, leg.begin_mm + leg.length_mm,
                         leg.begin_mm - direction * position_mm, direction});
  }
  return stretches;
}

}  // namespace trammel::procedure
