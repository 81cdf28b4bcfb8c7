#include "pressure_advance/procedure/placed_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/check.h"
#include "base/parallel.h"

namespace trammel::procedure {

using machine::CapturedFrame;
using pressure_advance::FrameMotion;
using pressure_advance::FrameObservation;
using pressure_advance::LineMove;
using pressure_advance::SweepObservation;

namespace {

// How far along a leg a point lies.
double WithinLeg(const PathLeg& leg, double x_mm, double y_mm) {
  return (x_mm - leg.x_mm) * leg.along_x + (y_mm - leg.y_mm) * leg.along_y;
}

// The leg that a move begins on and runs along; null where there is none.
const PathLeg* LegOf(const machine::TrapezoidMove& move, double x_mm, double y_mm,
                     std::span<const PathLeg> legs) {
  constexpr double kStraight = 0.999;  // cosine
  constexpr double kAside_mm = 0.05;   // of rounded coordinates
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

/// Observes frames `first` to `end`, and looks at the one before them.
Result<void> ObserveChunk(std::span<const CapturedFrame> frames, std::size_t first, std::size_t end,
                          std::span<FrameObservation> observed) {
  FrameObserver observer;
  for (std::size_t i = first == 0 ? 0 : first - 1; i < end; ++i) {
    auto seen = TRY(observer.Next(frames[i]));
    if (i >= first) observed[i] = seen;
  }
  return {};
}

}  // namespace

Result<FrameObservation> FrameObserver::Next(const CapturedFrame& frame) {
  const vision::FrameChangeOptions options;
  const auto picture = TRY(machine::DecodeFrame(frame));
  std::swap(sketch_, before_);
  vision::SketchFrame(picture.view(), options, sketch_);
  FrameObservation seen;
  seen.arrival_s = frame.arrival_s;
  if (frame.captured) seen.captured_s = frame.captured->time_s;
  seen.sequence = frame.sequence;
  if (before_.width == sketch_.width && before_.height == sketch_.height) {
    seen.change = vision::FrameChange(before_, sketch_, options, scratch_);
  }
  return seen;
}

bool IsWhole(std::span<const LineMove> moves, std::span<const Sweep> run) {
  constexpr double kAway_mm = 0.02;  // of rounded coordinates
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
                                 std::vector<LineMove> motion,
                                 std::vector<FrameObservation> begun) {
  constexpr std::size_t kChunk = 32;
  TRAMMEL_CHECK(begun.size() <= frames.size(), "{} of {} frames", begun.size(), frames.size());
  SweepObservation sweep;
  sweep.motion = std::move(motion);
  sweep.frames = std::move(begun);
  const std::size_t done_before = sweep.frames.size();
  sweep.frames.resize(frames.size());
  std::vector<Result<void>> done((frames.size() - done_before + kChunk - 1) / kChunk);
  ParallelFor(static_cast<int>(done.size()), [&](int chunk) {
    const std::size_t first = done_before + kChunk * static_cast<std::size_t>(chunk);
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
