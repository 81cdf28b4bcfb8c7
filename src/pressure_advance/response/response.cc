#include "pressure_advance/response/response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"
#include "pressure_advance/response/answer.h"
#include "pressure_advance/response/combine_transitions.h"
#include "pressure_advance/response/storage_fit.h"
#include "pressure_advance/response/surplus.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {
namespace {

struct Prepared {
  TransitionPlan plan;
  std::vector<std::size_t> line;  // index of each usable line
  Transitions transitions;
  double unevenness = 0;         // change along the line, from the lowest value to the highest
  double unit_mm = 1;            // one unit of the profiles' positions; 1 where no length is known
  bool slope_has_scale = false;  // area over a known length: the slope is then near 1
};

// Returns by how much the change along the settled lines grows from the lowest value to the
// highest.
double UnevennessOf(const std::vector<LineProfile>& profiles,
                    const std::vector<LineSurplus>& measured, const Interval& settled_s) {
  std::vector<double> pa_s, along;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const double pa = profiles[i].pressure_advance_s;
    if (!measured[i].along || !settled_s.Holds(pa)) continue;
    pa_s.push_back(pa);
    along.push_back(*measured[i].along);
  }
  if (pa_s.empty()) return 0;
  const Interval range = RangeOf(pa_s);
  return MedianSlope(pa_s, along) * (range.hi - range.lo);
}

// Computes the surplus of all lines in seconds: divided by the speed change. If the line's length
// is unknown, the scale is arbitrary until the slope is known.
Prepared Prepare(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                 Reading reading, const TransitionPlan& plan, std::vector<LineResult>& lines) {
  Prepared prepared;
  prepared.plan = plan;
  const bool in_mm = profiles.front().position_unit == PositionUnit::kMillimetre;
  prepared.slope_has_scale = reading == Reading::kArea && (in_mm || motion.length_mm);
  prepared.unit_mm = in_mm ? 1.0 : motion.length_mm.value_or(1.0);
  const std::vector<LineSurplus> measured_lines = MeasureSurplus(profiles, reading, plan);
  prepared.unevenness = UnevennessOf(profiles, measured_lines, plan.settled_s);
  Transitions& transitions = prepared.transitions;
  const double rise_s = prepared.unit_mm / plan.acceleration.speed_change_mm_s;
  std::vector<LineSurplus> early_lines;
  if (plan.early.hi > plan.early.lo) {
    TransitionPlan early = plan;
    early.acceleration.span = plan.early;
    early_lines = MeasureSurplus(profiles, reading, early);
    transitions.early.emplace();
  }
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const LineSurplus& surplus = measured_lines[i];
    lines[i].reason = surplus.unusable;
    lines[i].used = surplus.unusable.empty();
    if (!lines[i].used) continue;
    prepared.line.push_back(i);
    const auto add = [&](TransitionSeries& series, const Surplus& measured, double per_unit_s) {
      series.pa_s.push_back(profiles[i].pressure_advance_s);
      series.surplus_s.push_back(measured.seen ? measured.value * per_unit_s : 0);
      series.sigma_s.push_back(measured.seen ? measured.sigma * per_unit_s
                                             : std::numeric_limits<double>::infinity());
    };
    add(transitions.acceleration, surplus.acceleration, rise_s);
    add(transitions.deceleration, surplus.deceleration,
        prepared.unit_mm / std::abs(plan.deceleration.speed_change_mm_s));
    if (transitions.early) add(*transitions.early, early_lines[i].acceleration, rise_s);
  }
  // Slip grows with the square of the flow, which rises along a ramp in proportion to the distance.
  const auto slip_surplus_s = [&](const TransitionWindow& window, double fast_length) {
    const double slipping = std::max(0.0, fast_length - window.ramp_length / 2);
    return slipping * prepared.unit_mm / std::abs(window.speed_change_mm_s);
  };
  const TransitionWindow& rise = plan.acceleration;
  transitions.acceleration.slip_surplus_s = slip_surplus_s(rise, rise.fast_length);
  transitions.deceleration.slip_surplus_s =
      slip_surplus_s(plan.deceleration, plan.deceleration.fast_length);
  if (transitions.early) {
    transitions.early->slip_surplus_s =
        slip_surplus_s(rise, std::max(0.0, plan.early.hi - rise.boundary));
    if (motion.acceleration_mm_s2 && prepared.slope_has_scale) {
      transitions.ramp_s = rise.speed_change_mm_s / *motion.acceleration_mm_s2;
      transitions.drain_s = std::max(0.0, rise.fast_length - rise.ramp_length) * prepared.unit_mm /
                            motion.segments[1].speed_mm_s;
      transitions.slow_drain_s = (plan.deceleration.span.hi - plan.deceleration.boundary) *
                                 prepared.unit_mm / motion.segments[2].speed_mm_s;
    }
  }
  return prepared;
}

// If the fast segment has a steady middle, both windows are as wide as possible; only the stretch
// that responds to PA is used. On a short line the whole window responds.
TransitionPlan NarrowWindows(const std::vector<LineProfile>& profiles, Reading reading,
                             const TransitionPlan& wide, std::optional<double> margin) {
  if (!wide.steady_middle && !margin) return wide;
  constexpr double kBesideMiddle = 0.15;
  TransitionPlan plan = wide;
  const auto narrow = [&](TransitionWindow& window, bool rising) {
    const auto stretch = RespondingStretch(profiles, reading, window.span, rising,
                                           wide.steady_middle ? kBesideMiddle : *margin);
    if (!stretch) return;
    const double fast_lo = rising ? std::max(window.boundary, stretch->lo) : stretch->lo;
    const double fast_hi = rising ? stretch->hi : std::min(window.boundary, stretch->hi);
    window.span = *stretch;
    window.fast_length = std::max(0.0, fast_hi - fast_lo);
  };
  // The acceleration's lag passes at the fast speed, over much of the fast segment.
  if (wide.steady_middle) narrow(plan.acceleration, true);
  narrow(plan.deceleration, false);
  return plan;
}

// Prepares the lines anew, for a level along them that is seen on settled lines only: the lag tells
// which these are. With a scale the parts that the windows cut off are corrected otherwise.
Prepared PrepareSettled(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                        Reading reading, TransitionPlan plan, const ResponseOptions& options,
                        std::vector<LineResult>& lines) {
  constexpr int kRounds = 3;
  for (int round = 0;; ++round) {
    Prepared prepared = Prepare(profiles, motion, reading, plan, lines);
    if (round == kRounds || !motion.length_mm || prepared.slope_has_scale) return prepared;
    const auto crossings = FitTransitions(prepared.transitions, options);
    if (!crossings) return prepared;
    // Slip moves the acceleration's crossing up, an uneven reference the deceleration's.
    const auto [least_s, most_s] =
        std::minmax(crossings->acceleration.zero, crossings->deceleration.zero);
    if (!(most_s > 0)) return prepared;
    const std::vector<double>& pa_s = prepared.transitions.acceleration.pa_s;
    const Interval settled_s = SettledLines(least_s > 0 ? least_s : most_s, pa_s, plan,
                                            prepared.unit_mm, motion.segments[2].speed_mm_s);
    const auto same = [&](double pa) { return settled_s.Holds(pa) == plan.settled_s.Holds(pa); };
    if (std::ranges::all_of(pa_s, same)) return prepared;
    plan.settled_s = settled_s;
  }
}

void Describe(const Prepared& prepared, const TransitionSeries& series,
              const signal::ZeroCrossing& fit, double shift_s, const TransitionWindow& window,
              std::size_t lines, TransitionResult& result) {
  result.window_begin = window.span.lo;
  result.window_end = window.span.hi;
  result.surplus_s.assign(lines, 0);
  result.sigma_s.assign(lines, 0);
  result.fitted_s.assign(lines, 0);
  // Without a length the scale is free: the slope becomes 1, so that the surplus equals the error
  // in PA.
  const double unit = prepared.slope_has_scale || fit.slope == 0 ? 1 : 1 / std::abs(fit.slope);
  constexpr double kIgnored = 0.05;
  // Shifts points and curve to cross zero at the transition's value.
  const double put_in_s = fit.slope * shift_s;
  for (std::size_t k = 0; k < series.pa_s.size(); ++k) {
    const std::size_t i = prepared.line[k];
    const double fitted_s = signal::ResponseAt(fit, series.pa_s[k]);
    // A line without the transition is on the curve, unused.
    const double surplus_s = std::isfinite(series.sigma_s[k]) ? series.surplus_s[k] : fitted_s;
    result.surplus_s[i] = (surplus_s + put_in_s) * unit;
    result.fitted_s[i] = (fitted_s + put_in_s) * unit;
    if (fit.weight[k] > kIgnored) {
      result.sigma_s[i] = std::hypot(series.sigma_s[k], fit.residual_scale) * unit;
    }
  }
}

// Mirrors the scatter: lines with more than the model's get less. Their uncertainty is the same, as
// a gap may hide the same amount.
TransitionSeries Mirrored(const TransitionSeries& seen, const TransitionSeries& laid) {
  TransitionSeries mirrored = seen;
  for (std::size_t k = 0; k < seen.surplus_s.size(); ++k) {
    mirrored.surplus_s[k] = 2 * laid.surplus_s[k] - seen.surplus_s[k];
  }
  return mirrored;
}

Transitions Mirrored(const Transitions& seen, const Transitions& laid) {
  Transitions mirrored = seen;
  mirrored.acceleration = Mirrored(seen.acceleration, laid.acceleration);
  mirrored.deceleration = Mirrored(seen.deceleration, laid.deceleration);
  if (seen.early) mirrored.early = Mirrored(*seen.early, *laid.early);
  return mirrored;
}

// Refuses a lag of which the fast segment shows the beginning only. REQUIRES a known length.
// Virtual prints of other tools' lines, tested up to 0.5 s and 1 s: of 178 answers up to 0.6 of the
// fast segment's duration 4 lay beyond two standard uncertainties, of 124 from there to 1 26 did.
RangedAnswer RefuseALongLag(const LineMotion& motion, RangedAnswer answer) {
  constexpr double kMost = 0.6;
  constexpr double kProposed = 0.5;
  if (!answer.pressure_advance.good()) return answer;
  const Segment& fast = motion.segments[1];
  const double fast_mm = fast.fraction * *motion.length_mm;
  const double fast_s = fast_mm / fast.speed_mm_s;
  const double lag_s = answer.pressure_advance.quantity().value;
  if (lag_s <= kMost * fast_s) return answer;
  return {Measured::CannotTell(fmt::format(
              "pressure advance is some {:.2g} s, too much for lines whose fast {:.3g} mm last "
              "{:.2g} s at {:.3g} mm/s: print them with a fast speed of at most {:.2g} mm/s",
              lag_s, fast_mm, fast_s, fast.speed_mm_s, kProposed * fast_mm / lag_s)),
          std::nullopt};
}

// Refuses lines whose slow ends differ the more the higher their value: these have nothing to do
// with pressure advance, and a glare or a shadow that covers some lines' ends moves both crossings
// alike. One virtual photo in a glare had -0.43 and an answer 13 ms too high; 11 others had 0.16 at
// most, a real one 0.18.
RangedAnswer RefuseUnevenEnds(double unevenness, RangedAnswer answer) {
  constexpr double kMost = 0.3;
  if (!answer.pressure_advance.good() || std::abs(unevenness) <= kMost) return answer;
  return {
      Measured::CannotTell(fmt::format(
          "the lines' slow ends grow {} by {:.0f} % from the lowest value to the highest, beside "
          "their slow beginnings: a glare or a shadow lies over them. Photograph them in even "
          "light",
          unevenness < 0 ? "thinner" : "wider", 100 * std::abs(unevenness))),
      std::nullopt};
}

// Fits the profiles' shapes for information beyond their crossings: only if lines are short, whole
// and to scale.
std::optional<WeighedStorage> LearnStorage(const std::vector<LineProfile>& profiles,
                                           const LineMotion& motion, const Prepared& prepared,
                                           const TransitionCrossings& seen,
                                           const ResponseOptions& options,
                                           CombinedTransitions& combined) {
  if (!options.law || !combined.whole || !(prepared.transitions.ramp_s > 0) ||
      profiles.front().position_unit != PositionUnit::kMillimetre) {
    return std::nullopt;
  }
  const std::vector<Interval>& reference = prepared.plan.reference;
  const Interval span_mm{reference.front().lo, reference.back().hi};
  const std::optional<StorageFit> law =
      FitStorage(profiles, motion, combined.whole->value_s, span_mm, *options.law);
  if (!law) return std::nullopt;
  std::vector<LineResult> lines(profiles.size());
  const Prepared laid =
      Prepare(LayLines(*law, profiles, motion), motion, Reading::kArea, prepared.plan, lines);
  if (laid.line != prepared.line) return std::nullopt;
  const Transitions twin = Mirrored(prepared.transitions, laid.transitions);
  // The seen lines' significance was checked before.
  ResponseOptions any = options;
  any.min_significance = 0;
  any.max_beyond = std::numeric_limits<double>::infinity();
  const std::optional<TransitionCrossings> crossings = FitTransitions(twin, any);
  if (!crossings) return std::nullopt;
  const CombinedTransitions of_twin =
      CombineTransitions(twin, *crossings, prepared.slope_has_scale, any);
  if (!of_twin.whole) return std::nullopt;
  // The storage model explains the half-lines' residuals.
  const double known = Square(TrustIn(*law, *options.law));
  const auto narrow = [known](double variance, BudgetedValue& value) {
    double& lines = value.budget.lines;
    lines = std::min(lines, std::lerp(lines, variance, known));
  };
  const PairVariances about = LessSlip(
      ScatterAbout(laid.transitions, prepared.transitions, seen, combined.pair), combined.slip);
  combined.freedom += 1;  // no bend is fitted
  narrow(about.acceleration, *combined.first);
  narrow(about.deceleration, *combined.second);
  WeighedStorage learnt = WeighWithStorage(*law, of_twin, *options.law, combined);
  learnt.learnt_from_mm = span_mm;
  return learnt;
}

}  // namespace

Analysis FitResponse(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                     const ResponseOptions& options) {
  Analysis fit;
  fit.motion = motion;
  fit.lines.resize(profiles.size());
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    fit.lines[i].pattern = profiles[i].pattern;
    fit.lines[i].pressure_advance_s = profiles[i].pressure_advance_s;
    fit.lines[i].reason = profiles[i].unusable;
  }
  const auto refuse = [&fit](const std::string& reason) {
    fit.response.pressure_advance = Measured::Refused(reason);
    fit.response.acceleration.pressure_advance = Measured::Refused(reason);
    fit.response.deceleration.pressure_advance = Measured::Refused(reason);
    return fit;
  };
  const std::optional<Reading> reading = ChooseReading(profiles);
  if (!reading) {
    std::string why = profiles.empty() ? "there are none" : profiles.front().unusable;
    return refuse(fmt::format("no line could be measured: {}", why));
  }
  double longest = 0;
  for (const LineProfile& profile : profiles)
    longest = std::max(longest, profile.pressure_advance_s);
  const Result<TransitionPlan> plan =
      PlanTransitions(motion, profiles.front().position_unit, longest, options.transitions);
  if (!plan) return refuse(plan.error().message);

  Prepared prepared = PrepareSettled(
      profiles, motion, *reading,
      NarrowWindows(profiles, *reading, *plan, options.transitions.margin_of_response), options,
      fit.lines);
  const auto different = [](const TransitionSeries& series) {
    const std::vector<double> seen = series.SeenPa_s();
    return std::set<double>(seen.begin(), seen.end());
  };
  const std::set<double> values = std::min(
      different(prepared.transitions.acceleration), different(prepared.transitions.deceleration),
      [](const auto& a, const auto& b) { return a.size() < b.size(); });
  if (static_cast<int>(values.size()) < options.fewest_lines) {
    std::string why = std::all_of(fit.lines.begin(), fit.lines.end(),
                                  [](const LineResult& line) { return line.used; })
                          ? "; the picture ends beside a speed change of the others"
                          : "";
    for (const LineResult& line : fit.lines) {
      if (!line.used && why.empty()) {
        why = fmt::format("; the line at {:.4g} s: {}", line.pressure_advance_s, line.reason);
      }
    }
    return refuse(fmt::format(
        "{} of {} lines can be used with different pressure advance, at least {} are needed{}",
        values.size(), profiles.size(), options.fewest_lines, why));
  }
  const Transitions& transitions = prepared.transitions;
  const std::optional<TransitionCrossings> crossings = FitTransitions(transitions, options);
  TRAMMEL_CHECK(crossings.has_value(), "{} lines", prepared.line.size());
  CombinedTransitions combined =
      CombineTransitions(transitions, *crossings, prepared.slope_has_scale, options);
  if (!prepared.slope_has_scale && motion.length_mm) {
    combined.both =
        RefuseUnevenEnds(prepared.unevenness, RefuseALongLag(motion, std::move(combined.both)));
  }
  fit.response.law = LearnStorage(profiles, motion, prepared, *crossings, options, combined);
  Describe(prepared, transitions.acceleration, crossings->acceleration,
           combined.acceleration_shift_s, prepared.plan.acceleration, profiles.size(),
           fit.response.acceleration);
  Describe(prepared, transitions.deceleration, crossings->deceleration,
           combined.deceleration_shift_s, prepared.plan.deceleration, profiles.size(),
           fit.response.deceleration);
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    if (fit.lines[i].used && fit.response.acceleration.sigma_s[i] == 0 &&
        fit.response.deceleration.sigma_s[i] == 0) {
      fit.lines[i].used = false;
      fit.lines[i].reason = "does not follow the other lines";
    }
  }
  fit.response.acceleration.pressure_advance = combined.acceleration;
  fit.response.deceleration.pressure_advance = combined.deceleration;
  static_cast<RangedAnswer&>(fit.response) = combined.both;
  fit.notices = std::move(combined.notices);
  return fit;
}

namespace {

// Groups the lines by pattern, in the order of the patterns.
std::vector<std::vector<LineProfile>> ByPattern(const std::vector<LineProfile>& profiles) {
  std::map<int, std::vector<LineProfile>> patterns;
  for (const LineProfile& profile : profiles) patterns[profile.pattern].push_back(profile);
  std::vector<std::vector<LineProfile>> sorted;
  for (auto& [index, lines] : patterns) sorted.push_back(std::move(lines));
  return sorted;
}

// Shifts a transition's points and curve so that they cross zero at its present value.
void MoveZero(const std::vector<LineProfile>& profiles, double by_s, TransitionResult& result) {
  const auto by_value = [&](std::size_t a, std::size_t b) {
    return profiles[a].pressure_advance_s < profiles[b].pressure_advance_s;
  };
  std::vector<std::size_t> lines(profiles.size());
  std::iota(lines.begin(), lines.end(), 0U);
  const auto [least, most] = std::ranges::minmax_element(lines, by_value);
  const double range_s = profiles[*most].pressure_advance_s - profiles[*least].pressure_advance_s;
  const double slope = (result.fitted_s[*least] - result.fitted_s[*most]) / range_s;
  for (double& surplus_s : result.surplus_s) surplus_s += slope * by_s;
  for (double& fitted_s : result.fitted_s) fitted_s += slope * by_s;
}

// Combines each transition's value like the answer: both from the single patterns.
void CombineTransition(const std::vector<LineProfile>& profiles,
                       const std::vector<ResponseResult>& alone,
                       TransitionResult ResponseResult::*transition, const Interval& tested_s,
                       double widest, ResponseResult& joint) {
  TransitionResult& result = joint.*transition;
  if (!result.pressure_advance.good()) return;
  std::vector<Measured> pattern_s;
  for (const ResponseResult& one : alone) pattern_s.push_back((one.*transition).pressure_advance);
  Measured combined =
      CombineRepeats(result.pressure_advance.quantity(), std::move(pattern_s), tested_s, widest)
          .first.pressure_advance;
  if (combined.good()) {
    MoveZero(profiles, combined.quantity().value - result.pressure_advance.quantity().value,
             result);
  }
  result.pressure_advance = std::move(combined);
}

// Computes each pattern's result on a plate of several, and their effect on the answer.
void CompareRepeats(const std::vector<LineProfile>& profiles, const ResponseOptions& options,
                    Analysis& analysis) {
  const auto patterns = ByPattern(profiles);
  if (patterns.size() < 2) return;
  std::vector<ResponseResult> alone;
  std::vector<Measured> pattern_s;
  for (const auto& lines : patterns) {
    alone.push_back(FitResponse(lines, analysis.motion, options).response);
    pattern_s.push_back(alone.back().pressure_advance);
  }
  ResponseResult& joint = analysis.response;
  if (!joint.pressure_advance.good()) {
    analysis.repeats.emplace().pattern_s = std::move(pattern_s);
    return;
  }
  std::vector<double> values_s;
  for (const LineProfile& profile : profiles) values_s.push_back(profile.pressure_advance_s);
  const Interval tested_s = RangeOf(values_s);
  const double widest = options.widest_interval;
  auto [answer, repeats] =
      CombineRepeats(joint.pressure_advance.quantity(), std::move(pattern_s), tested_s, widest);
  static_cast<RangedAnswer&>(joint) = std::move(answer);
  for (const auto transition : {&ResponseResult::acceleration, &ResponseResult::deceleration}) {
    CombineTransition(profiles, alone, transition, tested_s, widest, joint);
  }
  analysis.repeats = std::move(repeats);
  if (std::string notice = NoticeOfRepeats(*analysis.repeats); !notice.empty()) {
    analysis.notices.push_back(std::move(notice));
  }
}

}  // namespace

Analysis Analyse(std::vector<LineProfile> profiles, const LineMotion& motion,
                 DeviationResult deviation, const ResponseOptions& options) {
  Analysis analysis = FitResponse(profiles, motion, options);
  CompareRepeats(profiles, options, analysis);
  static_cast<RangedAnswer&>(analysis) = static_cast<const RangedAnswer&>(analysis.response);
  analysis.profiles = std::move(profiles);
  analysis.deviation = std::move(deviation);
  return analysis;
}

}  // namespace trammel::pressure_advance
