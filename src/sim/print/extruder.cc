#include "sim/print/extruder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/check.h"

namespace trammel::sim {
namespace {

// Returns taps of the triangular kernel on the step grid, normalised so that no filament is lost.
std::vector<double> KernelTaps(double smooth_time_s) {
  const int half = static_cast<int>(std::ceil(smooth_time_s / 2 / kStepS));
  std::vector<double> taps;
  double sum = 0;
  for (int k = -half; k <= half; ++k) {
    taps.push_back(std::max(0.0, smooth_time_s / 2 - std::abs(k) * kStepS));
    sum += taps.back();
  }
  if (sum <= 0) {
    return {1.0};
  }
  for (double& tap : taps) tap /= sum;
  return taps;
}

// Returns the filament commanded by one move up to a time, pressure advance included. After the
// move the advance is withdrawn; if the next move deposits at the same speed, it is restored.
double CommandedBy(const TimedMove& timed, double time_s) {
  const double ratio = timed.move.e_mm / timed.length_mm;
  const PathState state = StateAt(timed, time_s);
  const bool advanced = timed.deposits() && time_s >= timed.start_s && time_s < timed.end_s();
  const double advance_s = advanced ? timed.move.pressure_advance_s : 0;
  return ratio * (state.distance_mm + advance_s * state.speed_mm_s);
}

void DriveMove(const TimedMove& timed, std::span<const double> taps, std::vector<double>& driven) {
  const auto first = static_cast<std::size_t>((timed.start_s + kLeadS) / kStepS);
  const auto last = static_cast<std::size_t>((timed.end_s() + kLeadS) / kStepS);
  const std::size_t half = taps.size() / 2;
  double before = 0;
  for (std::size_t step = first; step <= last; ++step) {
    const double time_s = static_cast<double>(step + 1) * kStepS - kLeadS;
    const double after = step == last ? timed.move.e_mm : CommandedBy(timed, time_s);
    for (std::size_t k = 0; k < taps.size(); ++k) {
      driven[step - half + k] += (after - before) * taps[k];
    }
    before = after;
  }
}

// Hot end: filament in, filament out.
class HotEnd {
 public:
  HotEnd(Starvation starvation) : starvation_(starvation) {}

  // Pushes filament in during one step; returns the output (>= 0).
  double Push(double filament_mm, const StorageModel& law, bool printing) {
    const bool refills = starvation_ == Starvation::kRefill || !printing;
    const double in_mm_s = filament_mm / kStepS;
    const DrivenFlow out =
        refills && stored_mm_ <= 0 ? DrivenFlow{} : FlowFromStored(law, stored_mm_);
    const double decay = out.slope_per_s * kStepS;
    const double held = decay > 1e-9 ? -std::expm1(-decay) / decay : 1;
    const double change_mm = (in_mm_s - out.flow_mm_s) * kStepS * held;
    const double delivered_mm = filament_mm - change_mm;
    if (refills && delivered_mm < 0) {
      stored_mm_ += filament_mm;
      return 0;
    }
    stored_mm_ += change_mm;
    return std::max(0.0, delivered_mm);
  }
  void Lose(double filament_mm) { stored_mm_ -= filament_mm; }
  [[nodiscard]] double stored_mm() const { return stored_mm_; }

 private:
  Starvation starvation_;
  double stored_mm_ = 0;
};

// Position of the nozzle on its stroke, for rising times.
class StrokeWalker {
 public:
  StrokeWalker(std::span<const TimedMove> plan, const Stroke& stroke)
      : plan_(plan), last_(stroke.last), move_(stroke.first) {}

  double DistanceAt(double time_s) {
    while (move_ < last_ && time_s >= plan_[move_].end_s()) {
      passed_mm_ += plan_[move_].length_mm;
      ++move_;
    }
    return passed_mm_ + StateAt(plan_[move_], time_s).distance_mm;
  }

 private:
  std::span<const TimedMove> plan_;
  std::size_t last_;
  std::size_t move_;
  double passed_mm_ = 0;
};

StrokeDeposit EmptyDeposit(double length_mm, double spacing_mm) {
  const auto cells = static_cast<std::size_t>(std::ceil(length_mm / spacing_mm - 1e-9));
  StrokeDeposit deposit;
  deposit.spacing_mm = length_mm / static_cast<double>(std::max<std::size_t>(1, cells));
  deposit.filament_mm.assign(std::max<std::size_t>(1, cells) + 1, 0.0);
  return deposit;
}

// Spreads filament evenly over a stretch of the stroke.
void Lay(StrokeDeposit& deposit, double from_mm, double to_mm, double filament_mm) {
  const auto last = static_cast<double>(deposit.filament_mm.size() - 1);
  const double a = std::clamp(from_mm / deposit.spacing_mm, 0.0, last);
  const double b = std::clamp(to_mm / deposit.spacing_mm, a, last);
  const auto first_node = static_cast<std::size_t>(a + 0.5);
  const auto last_node = static_cast<std::size_t>(b + 0.5);
  if (first_node == last_node) {
    deposit.filament_mm[first_node] += filament_mm;
    return;
  }
  for (std::size_t node = first_node; node <= last_node; ++node) {
    const double lo = std::max(a, static_cast<double>(node) - 0.5);
    const double hi = std::min(b, static_cast<double>(node) + 0.5);
    deposit.filament_mm[node] += filament_mm * std::max(0.0, hi - lo) / (b - a);
  }
}

double Slipped(double filament_mm, const ExtruderOptions& options) {
  constexpr double kMaxSlip = 0.5;
  if (filament_mm <= 0) {
    return 0;
  }
  const double ratio = filament_mm / kStepS / options.slip_reference_mm_s;
  return filament_mm * std::min(kMaxSlip, options.slip * ratio * ratio);
}

}  // namespace

std::vector<double> DrivenFilament(std::span<const TimedMove> plan) {
  const double end_s = plan.empty() ? 0 : plan.back().end_s();
  std::vector<double> driven(static_cast<std::size_t>((end_s + 2 * kLeadS) / kStepS) + 2, 0.0);
  double taps_for_s = -1;
  std::vector<double> taps;
  for (const TimedMove& timed : plan) {
    if (timed.move.e_mm == 0) {
      continue;
    }
    const double smooth_s = timed.move.pressure_advance_s > 0 ? timed.move.smooth_time_s : 0;
    TRAMMEL_CHECK(smooth_s >= 0 && smooth_s <= 0.2, "smooth_s = {}", smooth_s);
    if (smooth_s != taps_for_s) {
      taps = KernelTaps(smooth_s);
      taps_for_s = smooth_s;
    }
    DriveMove(timed, taps, driven);
  }
  return driven;
}

std::vector<Stroke> FindStrokes(std::span<const TimedMove> plan) {
  constexpr double kForever = std::numeric_limits<double>::infinity();
  std::vector<Stroke> strokes;
  double arrives_s = -kForever;
  bool primed = false;
  bool open = false;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const TimedMove& timed = plan[i];
    if (timed.deposits()) {
      if (!open) {
        strokes.push_back({i, i, 0, arrives_s, timed.start_s, 0, kForever, primed});
      }
      Stroke& stroke = strokes.back();
      stroke.last = i;
      stroke.length_mm += timed.length_mm;
      stroke.end_s = timed.end_s();
      open = true;
      primed = false;
      continue;
    }
    open = false;
    if (timed.travels()) {
      if (!strokes.empty() && strokes.back().leaves_s == kForever) {
        strokes.back().leaves_s = timed.start_s;
      }
      arrives_s = timed.end_s();
    } else if (timed.move.e_mm > 0) {
      primed = true;
    }
  }
  return strokes;
}

Extrusion Extrude(std::span<const TimedMove> plan, std::span<const Stroke> strokes,
                  std::span<const double> driven, std::span<const StrokeFlow> flows,
                  const ExtruderOptions& options, double spacing_mm) {
  TRAMMEL_CHECK(flows.size() == strokes.size() && !strokes.empty() && spacing_mm > 0,
                "flows = {}, strokes = {}, spacing = {}", flows.size(), strokes.size(), spacing_mm);
  Extrusion result;
  for (const Stroke& stroke : strokes) {
    result.strokes.push_back(EmptyDeposit(stroke.length_mm, spacing_mm));
  }
  HotEnd hot_end(options.starvation);
  std::size_t k = 0;  // the stroke under way or next
  StrokeWalker walker(plan, strokes[0]);
  double reached_mm = 0;
  bool started = false;
  for (std::size_t step = 0; step < driven.size(); ++step) {
    const double time_s = (static_cast<double>(step) + 0.5) * kStepS - kLeadS;
    while (k + 1 < strokes.size() && time_s >= strokes[k].end_s &&
           (time_s >= strokes[k].leaves_s || time_s >= strokes[k + 1].start_s)) {
      ++k;
      walker = StrokeWalker(plan, strokes[k]);
      reached_mm = 0;
      started = false;
    }
    const bool printing = time_s >= strokes[k].start_s && time_s < strokes[k].end_s;
    if (printing && !started) {
      started = true;
      hot_end.Lose(strokes[k].primed ? flows[k].start_loss_mm : 0);
    }
    const bool slips = printing || options.slips_standing;
    const double slipped_mm = slips ? Slipped(driven[step], options) : 0;
    result.slipped_mm += slipped_mm;
    double out_mm = hot_end.Push(driven[step] - slipped_mm, flows[k].law, printing);
    if (time_s < strokes[k].arrives_s || time_s >= strokes[k].leaves_s) {
      result.oozed_mm += out_mm;
      continue;
    }
    const double wander =
        options.drift *
        std::sin(2 * std::numbers::pi * time_s / options.drift_period_s + options.drift_phase_rad);
    out_mm *= flows[k].factor * (1 + wander);
    const double to_mm = walker.DistanceAt(time_s + 0.5 * kStepS);
    Lay(result.strokes[k], reached_mm, to_mm, out_mm);
    reached_mm = to_mm;
  }
  result.stored_mm = hot_end.stored_mm();
  return result;
}

}  // namespace trammel::sim
