#include "pressure_advance/procedure/plate_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "base/measured.h"
#include "base/parallel.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "vision/frame_change.h"

namespace trammel::procedure {
namespace {

using pressure_advance::BoundsMm;
using pressure_advance::PatternConfig;
using settings::ScanSettings;

constexpr double kAnywhere_mm = 1e6;

// Computes the nozzle's range in printing and scanning. Errors: those of PlanSweeps but for x and
// y.
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

// Computes the shifts of the patterns that bed, nozzle and camera allow; nothing if none is
// allowed, or the settings' own position is not.
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
  BoundsMm printed;                    // current extent of the patterns
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

// Moves the patterns to where all are reached; absent if there is no such place.
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

// Lays the patterns in the fitting grid of shortest diagonal; nothing if none fits.
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

using machine::CapturedFrame;
using pressure_advance::FrameMotion;
using pressure_advance::FrameObservation;
using pressure_advance::LineMove;
using pressure_advance::SweepObservation;

namespace {

// Computes the position of a point along a leg.
double WithinLeg(const PathLeg& leg, double x_mm, double y_mm) {
  return (x_mm - leg.x_mm) * leg.along_x + (y_mm - leg.y_mm) * leg.along_y;
}

// Returns the leg on which a move begins and along which it runs; null if there is none.
const PathLeg* LegOf(const machine::TrapezoidMove& move, double x_mm, double y_mm,
                     std::span<const PathLeg> legs) {
  constexpr double kStraight = 0.999;  // cosine
  constexpr double kAside_mm = 0.05;   // for rounded coordinates
  for (const PathLeg& leg : legs) {
    if (move.direction[0] * leg.along_x + move.direction[1] * leg.along_y < kStraight) continue;
    const double within_mm = WithinLeg(leg, x_mm, y_mm);
    const double aside_mm = (x_mm - leg.x_mm) * leg.along_y - (y_mm - leg.y_mm) * leg.along_x;
    if (std::abs(aside_mm) <= kAside_mm && within_mm >= -kAside_mm &&
        within_mm <= leg.length_mm + kAside_mm) {
      return &leg;
    }
  }
  return nullptr;
}

// Observes frames `first` to `end`, and looks at the one before them.
Result<void> ObserveChunk(std::span<const CapturedFrame> frames, std::size_t first, std::size_t end,
                          std::span<FrameObservation> observed) {
  vision::FrameSketch sketch;
  vision::FrameSketch before;
  std::vector<float> scratch;
  for (std::size_t i = first == 0 ? 0 : first - 1; i < end; ++i) {
    const CapturedFrame& frame = frames[i];
    const auto picture = TRY(machine::DecodeFrame(frame));
    std::swap(sketch, before);
    vision::SketchFrame(picture.view(), sketch);
    if (i < first) continue;
    FrameObservation& seen = observed[i];
    seen.arrival_s = frame.arrival_s;
    if (frame.captured) seen.captured_s = frame.captured->time_s;
    seen.sequence = frame.sequence;
    if (before.width == sketch.width && before.height == sketch.height) {
      seen.change = vision::FrameChange(before, sketch, scratch);
    }
  }
  return {};
}

}  // namespace

bool IsWhole(std::span<const LineMove> moves, std::span<const Sweep> run) {
  constexpr double kAway_mm = 0.02;  // for rounded coordinates
  constexpr double kCreep_mm_s = 0.01;
  const std::vector<PathLeg> legs = PathOf(run);
  if (legs.empty()) return false;
  double at_mm = legs.front().begin_mm;
  double speed_mm_s = 0;
  for (const LineMove& move : moves) {
    if (std::abs(move.start_mm - at_mm) > kAway_mm) return false;
    speed_mm_s = move.start_speed_mm_s + move.acceleration_mm_s2 * move.duration_s;
    at_mm = move.start_mm + 0.5 * (move.start_speed_mm_s + speed_mm_s) * move.duration_s;
  }
  return !moves.empty() && std::abs(speed_mm_s) < kCreep_mm_s &&
         std::abs(legs.back().begin_mm + legs.back().length_mm - at_mm) <= kAway_mm;
}

std::vector<LineMove> AlongLine(std::span<const machine::TrapezoidMove> moves,
                                std::span<const Sweep> run, const machine::ClockRelation& clock,
                                const std::array<double, 4>& gcode_origin_mm) {
  const std::vector<PathLeg> legs = PathOf(run);
  std::vector<LineMove> along;
  if (legs.empty()) return along;
  for (const machine::TrapezoidMove& move : moves) {
    const double x_mm = move.start_mm[0] - gcode_origin_mm[0];
    const double y_mm = move.start_mm[1] - gcode_origin_mm[1];
    const PathLeg* leg = legs.size() == 1 ? legs.data() : LegOf(move, x_mm, y_mm, legs);
    if (leg == nullptr || !(move.duration_s > 0)) continue;
    const double share = move.direction[0] * leg->along_x + move.direction[1] * leg->along_y;
    if (share == 0) continue;
    along.push_back({clock.HostTimeOf(move.print_time_s), move.duration_s,
                     leg->begin_mm + WithinLeg(*leg, x_mm, y_mm), move.start_velocity_mm_s * share,
                     move.acceleration_mm_s2 * share});
  }
  return along;
}

Result<SweepObservation> Observe(std::span<const CapturedFrame> frames,
                                 std::vector<LineMove> motion) {
  constexpr std::size_t kChunk = 32;
  SweepObservation sweep;
  sweep.motion = std::move(motion);
  sweep.frames.resize(frames.size());
  std::vector<Result<void>> done((frames.size() + kChunk - 1) / kChunk);
  ParallelFor(static_cast<int>(done.size()), [&](int chunk) {
    const std::size_t first = kChunk * static_cast<std::size_t>(chunk);
    const std::size_t end = std::min(first + kChunk, frames.size());
    done[static_cast<std::size_t>(chunk)] = ObserveChunk(frames, first, end, sweep.frames);
  });
  for (const Result<void>& chunk : done) {
    if (!chunk) return tl::unexpected(chunk.error());
  }
  return sweep;
}

std::vector<std::optional<double>> ScoredPositions(const pressure_advance::SweepTiming& timing,
                                                   const SweptStretch& line) {
  constexpr double kSure = 3;  // standard uncertainties from where the head turns
  std::vector<std::optional<double>> positions;
  for (const pressure_advance::FrameTiming& frame : timing.frames) {
    positions.emplace_back();
    const double away_mm = kSure * frame.position_sigma_mm;
    if (frame.motion == FrameMotion::kSteady && frame.position_mm >= line.begin_mm + away_mm &&
        frame.position_mm <= line.end_mm - away_mm) {
      positions.back() = line.PositionOf(frame.position_mm);
    }
  }
  return positions;
}

Result<double> Reddened(const CapturedFrame& before, const CapturedFrame& after) {
  constexpr int kLevels = 30;  // far above a camera's noise, far below a laser's line
  const auto first = TRY(machine::DecodeFrame(before));
  const auto second = TRY(machine::DecodeFrame(after));
  if (first.width != second.width || first.height != second.height) {
    return Fail(fmt::format("the camera changed the size of its pictures from {}x{} to {}x{} px",
                            first.width, first.height, second.width, second.height),
                ErrorKind::kMachine);
  }
  std::size_t redder = 0;
  for (std::size_t i = 2; i < first.bgr.size(); i += 3) {
    redder += second.bgr[i] >= first.bgr[i] + kLevels;
  }
  return static_cast<double>(redder) / (static_cast<double>(first.bgr.size()) / 3);
}

}  // namespace trammel::procedure
