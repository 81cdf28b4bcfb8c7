#include "pressure_advance/procedure/plate_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/measured.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/pattern/pattern_plan.h"

namespace trammel::procedure {
namespace {

using pressure_advance::BoundsMm;
using pressure_advance::PatternConfig;
using settings::ScanSettings;

constexpr double kAnywhere_mm = 1e6;

// Where the nozzle goes, printing and scanning. Errors: those of PlanSweeps but for x and y.
Result<BoundsMm> NozzleBounds(const PatternConfig& config, const ScanSettings& settings,
                              const Reach& reach) {
  const auto layout = LayOut(config);
  BoundsMm bounds = layout.printed;
  Reach wide = reach;
  wide.round = false;
  for (const std::size_t axis : {0U, 1U}) {
    wide.minimum_mm[axis] = -kAnywhere_mm;
    wide.maximum_mm[axis] = kAnywhere_mm;
  }
  const auto sweeps = TRY(PlanSweeps(MakePlan(layout, config, ""), {}, settings, wide));
  for (const Sweep& sweep : sweeps.sweeps) {
    bounds.min_x_mm = std::min({bounds.min_x_mm, sweep.start_x_mm, sweep.end_x_mm});
    bounds.max_x_mm = std::max({bounds.max_x_mm, sweep.start_x_mm, sweep.end_x_mm});
    bounds.min_y_mm = std::min({bounds.min_y_mm, sweep.start_y_mm, sweep.end_y_mm});
    bounds.max_y_mm = std::max({bounds.max_y_mm, sweep.start_y_mm, sweep.end_y_mm});
  }
  return bounds;
}

// By how much patterns may be shifted so that bed, nozzle and camera let them; nothing where they
// do nowhere, or not where the settings put them.
std::optional<Interval> ShiftsInto(const Interval& nozzle_mm, const Interval& reach_mm,
                                   const Interval& printed_mm, const Interval& bed_mm,
                                   bool placed) {
  const Interval shifts{std::max(reach_mm.lo - nozzle_mm.lo, bed_mm.lo - printed_mm.lo),
                        std::min(reach_mm.hi - nozzle_mm.hi, bed_mm.hi - printed_mm.hi)};
  if (shifts.lo > shifts.hi) return std::nullopt;
  if (!placed) return shifts;
  if (shifts.lo > 0 || shifts.hi < 0) return std::nullopt;
  return Interval{0, 0};
}

struct Room {
  BoundsMm printed;                    // where the patterns lie now
  std::optional<Interval> x_mm, y_mm;  // shifts of them
};

Result<Room> RoomFor(const PatternConfig& config, const ScanSettings& settings,
                     const Reach& reach) {
  const auto nozzle = TRY(NozzleBounds(config, settings, reach));
  Room room{OuterBounds(config), {}, {}};
  const BoundsMm& printed = room.printed;
  const double margin_mm = config.bed_margin_mm;
  const auto bed = [margin_mm](double origin_mm, double size_mm) {
    return Interval{origin_mm + margin_mm, origin_mm + size_mm - margin_mm};
  };
  room.x_mm = ShiftsInto(
      {nozzle.min_x_mm, nozzle.max_x_mm}, {reach.minimum_mm[0], reach.maximum_mm[0]},
      {printed.min_x_mm, printed.max_x_mm}, bed(config.bed_origin_x_mm, config.bed_size_x_mm),
      config.position_x_mm.has_value());
  room.y_mm = ShiftsInto(
      {nozzle.min_y_mm, nozzle.max_y_mm}, {reach.minimum_mm[1], reach.maximum_mm[1]},
      {printed.min_y_mm, printed.max_y_mm}, bed(config.bed_origin_y_mm, config.bed_size_y_mm),
      config.position_y_mm.has_value());
  return room;
}

// The same patterns where all is reached; nothing where they are nowhere.
Result<std::optional<PatternConfig>> Moved(PatternConfig config, const ScanSettings& settings,
                                           const Reach& reach) {
  const auto room = TRY(RoomFor(config, settings, reach));
  if (!room.x_mm || !room.y_mm) return std::optional<PatternConfig>();
  config.position_x_mm = room.printed.min_x_mm + std::clamp(0.0, room.x_mm->lo, room.x_mm->hi);
  config.position_y_mm = room.printed.min_y_mm + std::clamp(0.0, room.y_mm->lo, room.y_mm->hi);
  if (FindProblem(config) ||
      !PlanSweeps(MakePlan(LayOut(config), config, ""), {}, settings, reach)) {
    return std::optional<PatternConfig>();
  }
  return std::optional(std::move(config));
}

// In the grid with the shortest diagonal that fits; nothing where none does.
Result<std::optional<PatternConfig>> Laid(const PatternConfig& one, int count,
                                          const ScanSettings& settings, const Reach& reach) {
  std::optional<PatternConfig> best;
  double shortest_mm = std::numeric_limits<double>::infinity();
  for (int columns = 1; columns <= count; ++columns) {
    PatternConfig config = one;
    config.columns = columns;
    config.rows = (count + columns - 1) / columns;
    config.patterns = count;
    const BoundsMm bounds = OuterBounds(config);
    const double diagonal_mm =
        std::hypot(bounds.max_x_mm - bounds.min_x_mm, bounds.max_y_mm - bounds.min_y_mm);
    if (diagonal_mm >= shortest_mm) continue;
    auto moved = TRY(Moved(std::move(config), settings, reach));
    if (!moved) continue;
    best = std::move(moved);
    shortest_mm = diagonal_mm;
  }
  return best;
}

}  // namespace

Result<PatternConfig> PatternsBeside(const PatternConfig& one, int count,
                                     const ScanSettings& settings, const Reach& reach,
                                     const std::string& option) {
  if (one.columns != 1 || one.rows != 1) {
    return Fail(
        fmt::format("the settings lay {} x {} patterns themselves: leave columns and rows of "
                    "[pressure_advance_pattern] out, or print them without {}",
                    one.columns, one.rows, option));
  }
  auto laid = TRY(Laid(one, count, settings, reach));
  if (laid) return std::move(*laid);
  int most = count - 1;
  for (; most > 0; --most) {
    const auto fewer = Laid(one, most, settings, reach);
    if (fewer && *fewer) break;
  }
  const auto size = Geometry(one);
  return Fail(
      fmt::format("{} patterns of {:.0f} x {:.0f} mm do not fit beside one another within the "
                  "reach of nozzle and camera, {}: {}make them smaller ([pressure_advance_pattern] "
                  "line_count, line_spacing, pattern_gap), or leave position_x and position_y out",
                  count, size.width_mm, size.depth_mm,
                  most > 0 ? fmt::format("at most {} do", most) : "nor does one",
                  most > 1 ? fmt::format("ask for so many with {}, or ", option) : ""),
      ErrorKind::kSafety);
}

}  // namespace trammel::procedure
