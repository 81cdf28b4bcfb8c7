#include "pressure_advance/commands/machine_time.h"

#include <fmt/format.h>

#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/pattern/pattern_plan.h"

namespace trammel::app {

using pressure_advance::PatternConfig;

procedure::Reach BedOf(const PatternConfig& pattern) {
  constexpr double kHigh_mm = 1000;
  return {{pattern.bed_origin_x_mm, pattern.bed_origin_y_mm, 0},
          {pattern.bed_origin_x_mm + pattern.bed_size_x_mm,
           pattern.bed_origin_y_mm + pattern.bed_size_y_mm, kHigh_mm},
          pattern.bed_shape == settings::BedShape::kEllipse};
}

MachineTime MachineTimeOf(const PatternConfig& pattern, const settings::ScanSettings& settings) {
  const procedure::Reach bed = BedOf(pattern);
  const PatternConfig printed = procedure::ParkedForScan(pattern, settings, bed);
  const auto layout = LayOut(printed);
  MachineTime time;
  time.print = Summarise(layout, printed).time;
  if (const auto sweeps = procedure::PlanSweeps(MakePlan(layout, printed, ""), {}, settings, bed)) {
    time.scan = TimeOf(*sweeps, printed, printed.acceleration_mm_s2, ParkPoint(printed));
  }
  return time;
}

std::string Describe(const pressure_advance::PatternTime& time) {
  return fmt::format("{:.1f} s: lines {:.1f}, frame {:.1f}, between them {:.1f}, to and fro {:.1f}",
                     time.total_s(), time.lines_s, time.frame_s, time.between_s, time.to_and_fro_s);
}

std::string Describe(const procedure::ScanTime& time) {
  return fmt::format("{:.1f} s: sweeps {:.1f}, turns {:.1f}, standing {:.1f}, travels {:.1f}",
                     time.total_s(), time.sweeping_s, time.turning_s, time.standing_s,
                     time.travelling_s);
}

}  // namespace trammel::app
