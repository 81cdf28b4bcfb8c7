#include "machine/moonraker/client/print_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/statistics.h"

namespace trammel::machine {
namespace {

constexpr double kWindow_s = 120;  // host time that samples are kept for
constexpr std::size_t kMaxSamples = 1000;
// Maximum drift of two crystals against each other, with time slewing. If no line within it
// agrees, ten times as much is allowed, then any rate.
constexpr double kDrift = 1.5e-4;
// Jitter of estimated_print_time itself (0.12 ms observed). Where no line agrees, more is allowed
// before another rate is: up to 10 ms of a server that is kept from its processor.
constexpr double kSlack_s = 3e-4;
constexpr double kUnknown_s = 1000;   // ± where the samples leave one side open
constexpr double kRoughest_s = 0.01;  // error of a reading that still is one
constexpr double kSlowest = 0.05;     // rate for a server with another clock
constexpr double kFastest = 200;
constexpr std::size_t kUpdates = 100;
constexpr std::size_t kUpdatesForPeriod = 12;
constexpr double kOtherRate = 0.1;   // more than jitter makes of a rate of 1
constexpr int kNarrowestSteps = 60;  // ternary search: narrows the window to the last bit

/// Line of the set: b = offset + rate · a, both relative to the newest sample.
struct Line {
  double offset_s = 0;
  double rate = 0;
};
using Polygon = std::vector<Line>;

/// Sample of one clock: b was read between a_from and a_to.
struct Reading {
  std::optional<double> a_from_s;
  double a_to_s = 0;
  double b_s = 0;
};

/// Returns the part of a convex polygon where sign · (offset + rate · a − b) <= 0.
Polygon Clip(const Polygon& polygon, double a_s, double b_s, double sign) {
  Polygon kept;
  const auto surplus = [&](const Line& line) {
    return sign * (line.offset_s + line.rate * a_s - b_s);
  };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Line& here = polygon[i];
    const Line& next = polygon[(i + 1) % polygon.size()];
    const double surplus_here = surplus(here);
    const double surplus_next = surplus(next);
    if (surplus_here <= 0) kept.push_back(here);
    if ((surplus_here < 0 && surplus_next > 0) || (surplus_here > 0 && surplus_next < 0)) {
      const double part = surplus_here / (surplus_here - surplus_next);
      kept.push_back({here.offset_s + part * (next.offset_s - here.offset_s),
                      here.rate + part * (next.rate - here.rate)});
    }
  }
  return kept;
}

/// Returns all lines with a rate in [slowest, fastest] that agree with the readings; empty if none
/// does.
Polygon Agreeing(const std::vector<Reading>& readings, double slowest, double fastest,
                 double slack_s) {
  const double a0_s = readings.back().a_to_s;
  const double b0_s = readings.back().b_s;
  Polygon polygon = {
      {-kUnknown_s, slowest}, {kUnknown_s, slowest}, {kUnknown_s, fastest}, {-kUnknown_s, fastest}};
  for (auto reading = readings.rbegin(); reading != readings.rend() && !polygon.empty();
       ++reading) {
    const double b_s = reading->b_s - b0_s;
    polygon = Clip(polygon, reading->a_to_s - a0_s, b_s - slack_s, -1);
    if (reading->a_from_s) polygon = Clip(polygon, *reading->a_from_s - a0_s, b_s + slack_s, 1);
  }
  return polygon;
}

struct Extent {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();

  void Add(double value) {
    lo = std::min(lo, value);
    hi = std::max(hi, value);
  }
  [[nodiscard]] double Middle() const { return 0.5 * (lo + hi); }
  [[nodiscard]] double Half() const { return 0.5 * (hi - lo); }
};

/// Computes the extent of the set's lines at a.
Extent At(const Polygon& polygon, double a_s) {
  Extent extent;
  for (const Line& line : polygon) extent.Add(line.offset_s + line.rate * a_s);
  return extent;
}

ClockLine Middle(const Polygon& polygon, const std::vector<Reading>& readings) {
  Extent rates;
  for (const Line& line : polygon) rates.Add(line.rate);
  // The width over a is convex: find its minimum among the readings.
  double lo_s = readings.front().a_to_s - readings.back().a_to_s;
  double hi_s = 0;
  for (int step = 0; step < kNarrowestSteps; ++step) {
    const double left_s = lo_s + (hi_s - lo_s) / 3;
    const double right_s = hi_s - (hi_s - lo_s) / 3;
    if (At(polygon, left_s).Half() < At(polygon, right_s).Half()) {
      hi_s = right_s;
    } else {
      lo_s = left_s;
    }
  }
  const double a_s = 0.5 * (lo_s + hi_s);
  const Extent here = At(polygon, a_s);
  ClockLine line;
  line.a0_s = readings.back().a_to_s + a_s;
  line.b0_s = readings.back().b_s + here.Middle();
  line.rate = rates.Middle();
  line.half_width_s = here.Half();
  line.half_width_rate = rates.Half();
  return line;
}

/// Returns the lines that agree with imprecise readings: a busy server reports a print time older
/// than its message. If lines agree only beyond half of the usual slack, the error is one-sided:
/// the true line may need all the slack that the best one shares between both sides, plus the delay
/// of the fastest message. Four times the best line's slack ensures that the set contains the true
/// one.
Polygon AgreeingRoughly(const std::vector<Reading>& readings, double slowest, double fastest) {
  if (!Agreeing(readings, slowest, fastest, 0.5 * kSlack_s).empty()) {
    return Agreeing(readings, slowest, fastest, kSlack_s);
  }
  for (double min_s = kSlack_s; min_s <= kRoughest_s; min_s *= 2) {
    if (!Agreeing(readings, slowest, fastest, min_s).empty()) {
      return Agreeing(readings, slowest, fastest, 4 * min_s);
    }
  }
  return {};
}

/// REQUIRES at least one reading. Discards readings, oldest first, until some line agrees.
ClockLine Fit(std::vector<Reading> readings) {
  for (;;) {
    for (const double off : {kDrift, 10 * kDrift}) {
      const Polygon polygon = AgreeingRoughly(readings, 1 - off, 1 + off);
      if (!polygon.empty()) return Middle(polygon, readings);
    }
    const Polygon polygon = Agreeing(readings, kSlowest, kFastest, kSlack_s);
    if (!polygon.empty()) return Middle(polygon, readings);
    readings.erase(readings.begin(),
                   readings.begin() + static_cast<std::ptrdiff_t>((readings.size() + 3) / 4));
  }
}

}  // namespace

void PrintClock::Add(const ClockSample& sample) {
  if (!std::isfinite(sample.received_s) || !std::isfinite(sample.eventtime_s) ||
      !std::isfinite(sample.sent_s.value_or(0)) ||
      !std::isfinite(sample.estimated_print_time_s.value_or(0))) {
    return;
  }
  samples_.push_back(sample);
  while (samples_.size() > kMaxSamples ||
         samples_.front().received_s < sample.received_s - kWindow_s) {
    samples_.pop_front();
  }
}

std::optional<double> PrintClock::NextUpdate() const {
  std::vector<const ClockSample*> updates;  // the newest first
  for (auto it = samples_.rbegin(); it != samples_.rend() && updates.size() < kUpdates; ++it) {
    if (!it->sent_s) updates.push_back(&*it);
  }
  if (updates.size() < kUpdatesForPeriod) return std::nullopt;
  std::vector<double> periods_s;
  for (std::size_t i = 1; i < kUpdatesForPeriod; ++i) {
    periods_s.push_back(updates[i - 1]->eventtime_s - updates[i]->eventtime_s);
  }
  const double next_s = updates.front()->eventtime_s + Median(periods_s);
  const auto speed = [&updates](std::size_t back) {
    return (updates.front()->eventtime_s - updates[back]->eventtime_s) /
           std::max(1e-3, updates.front()->received_s - updates[back]->received_s);
  };
  // The error of a measured rate grows with the time back.
  double rate = 1;
  std::size_t used = updates.size();
  if (std::abs(speed(updates.size() - 1) - 1) > kOtherRate) {
    used = kUpdatesForPeriod;
    rate = std::clamp(speed(used - 1), kSlowest, kFastest);
  }
  double latest_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < used; ++i) {
    latest_s =
        std::min(latest_s, updates[i]->received_s + (next_s - updates[i]->eventtime_s) / rate);
  }
  return latest_s;
}

std::optional<ClockRelation> PrintClock::Relation() const {
  std::vector<Reading> print;
  for (const ClockSample& sample : samples_) {
    if (sample.estimated_print_time_s) {
      print.push_back({sample.sent_s, sample.received_s, *sample.estimated_print_time_s});
    }
  }
  if (print.empty()) return std::nullopt;
  ClockRelation relation;
  relation.samples = static_cast<int>(print.size());
  relation.print_from_host = Fit(std::move(print));
  return relation;
}

}  // namespace trammel::machine
