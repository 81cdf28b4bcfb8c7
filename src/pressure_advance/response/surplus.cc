#include "pressure_advance/response/surplus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {

std::optional<CompletedWindow> CompleteWindow(std::span<const double> parts,
                                              std::span<const double> wholes, double part) {
  TRAMMEL_CHECK(parts.size() == wholes.size(), "{} and {}", parts.size(), wholes.size());
  if (parts.size() < kFewestWhole) return std::nullopt;
  const auto [least, most] = std::minmax_element(parts.begin(), parts.end());
  constexpr double kAlike = 0.25;  // of the parts' range
  const double alike = kAlike * (std::max(*most, part) - std::min(*least, part));
  if (!(alike > 0)) return std::nullopt;
  double n = 0, squares = 0, sx = 0, sy = 0;
  std::vector<double> weights;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double weight = 1 / Square(1 + Square((parts[i] - part) / alike));
    weights.push_back(weight);
    n += weight;
    squares += weight * weight;
    sx += weight * parts[i];
    sy += weight * wholes[i];
  }
  const double mx = sx / n, my = sy / n;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    xx += weights[i] * Square(parts[i] - mx);
    xy += weights[i] * (parts[i] - mx) * (wholes[i] - my);
  }
  if (!(xx > 0)) return std::nullopt;
  CompletedWindow completed;
  completed.per_part = xy / xx;
  completed.value = my + completed.per_part * (part - mx);
  double rest = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    rest += weights[i] * Square(wholes[i] - my - completed.per_part * (parts[i] - mx));
  }
  const double lines = n * n / squares;  // effective number of weighted lines
  const double variance = rest / n * lines / std::max(1.0, lines - 2);
  completed.sigma = std::sqrt(variance * (1 + 1 / lines + n / lines * Square(part - mx) / xx));
  return completed;
}

namespace {

struct Point {
  double position = 0;
  double value = 0;
  double sigma = 0;
};

// Readings of one line, and those of its slow stretches.
struct LinePoints {
  std::vector<Point> all;
  std::vector<std::vector<Point>> slow;  // per reference stretch
  std::vector<double> cut_off;           // positions where the bead is larger than the picture
};

// Level of a line, with the drift along it that all lines share.
struct Reference {
  double level = 0;
  double drift = 0;  // relative, per unit of position
  double centre = 0;
  double scatter_relative = 0;  // per reading
  double weight = 0;            // sum over its readings, each 1 at most
  double sigma_relative = 0;

  [[nodiscard]] double at(double position) const {
    return level * (1 + drift * (position - centre));
  }
};

LinePoints Sort(const LineProfile& profile, Reading reading, const TransitionPlan& plan) {
  LinePoints points;
  points.slow.resize(plan.reference.size());
  for (const ProfileSample& sample : profile.samples) {
    if (sample.cut_off) points.cut_off.push_back(sample.position);
    const Seen& seen = sample.Read(reading);
    if (!seen.seen() || sample.gap) continue;
    points.all.push_back({sample.position, seen.value, seen.sigma});
    for (std::size_t i = 0; i < plan.reference.size(); ++i) {
      if (plan.reference[i].Holds(sample.position)) points.slow[i].push_back(points.all.back());
    }
  }
  return points;
}

double MedianValue(const std::vector<Point>& points) {
  std::vector<double> values;
  for (const Point& point : points) values.push_back(point.value);
  return Median(values);
}

constexpr std::size_t kFewestReadings = 3;
constexpr std::size_t kFewestForDrift = 4;  // per slow stretch of a line

// Returns the relative change of a line's reading from the first slow stretch to the last.
std::optional<double> ChangeAlong(const LinePoints& line) {
  if (line.slow.front().size() < kFewestForDrift || line.slow.back().size() < kFewestForDrift) {
    return std::nullopt;
  }
  const double before = MedianValue(line.slow.front());
  const double after = MedianValue(line.slow.back());
  if (!(before + after > 0)) return std::nullopt;
  return 2 * (after - before) / (after + before);
}

// Returns that change per unit of position, as the median over all settled lines.
double CommonDrift(const std::vector<LineProfile>& profiles, const std::vector<LinePoints>& lines,
                   const TransitionPlan& plan) {
  const Interval& first = plan.reference.front();
  const Interval& last = plan.reference.back();
  const double apart = (last.lo + last.hi - first.lo - first.hi) / 2;
  std::vector<double> drifts;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::optional<double> change = ChangeAlong(lines[i]);
    if (change && plan.settled_s.Holds(profiles[i].pressure_advance_s)) {
      drifts.push_back(*change / apart);
    }
  }
  return drifts.size() >= 3 && apart > 0 ? Median(drifts) : 0;
}

// Returns why a line has no reference.
std::string NoReference(const LinePoints& line, const TransitionPlan& plan) {
  std::size_t count = 0;
  for (const std::vector<Point>& stretch : line.slow) count += stretch.size();
  if (count < kFewestReadings) {
    return fmt::format(
        "only {} readings from {:.3g} to {:.3g} and from {:.3g} to {:.3g} along the line, where it "
        "is "
        "compared with itself (at least {}): scan more of the line, or check where the scan begins",
        count, plan.reference.front().lo, plan.reference.front().hi, plan.reference.back().lo,
        plan.reference.back().hi, kFewestReadings);
  }
  return "its slow stretches are empty, torn or unlike the other lines': nothing to compare with";
}

// Computes the Tukey location of the slow readings, started from the lines' common level: a gap
// that fills most of one line's slow stretch must not become that line's reference.
std::optional<Reference> FitReference(const LinePoints& line, double drift, double centre,
                                      double common_level) {
  std::vector<double> level;
  for (const std::vector<Point>& stretch : line.slow) {
    for (const Point& point : stretch) {
      level.push_back(point.value / (1 + drift * (point.position - centre)));
    }
  }
  if (level.size() < kFewestReadings) return std::nullopt;
  constexpr double kNarrowest = 0.04;  // relative; flow differs by a few per cent between lines
  const double scale = std::max(kNarrowest * common_level, RobustStandardDeviation(level));
  Reference reference{common_level, drift, centre, 0, 0, 0};
  double weights = 0, squares = 0;
  for (int iteration = 0; iteration < 10; ++iteration) {
    double sum = 0;
    weights = squares = 0;
    for (const double value : level) {
      const double ratio = (value - reference.level) / (5 * scale);
      if (std::abs(ratio) >= 1) continue;
      const double weight = (1 - ratio * ratio) * (1 - ratio * ratio);
      sum += weight * value;
      weights += weight;
      squares += weight * (value - reference.level) * (value - reference.level);
    }
    if (weights < 0.25 * static_cast<double>(level.size())) return std::nullopt;
    reference.level = sum / weights;
  }
  reference.scatter_relative = std::sqrt(squares / weights) / reference.level;
  reference.weight = weights;
  return reference;
}

// Estimates the relative error of one line's mean slow reading from the scatter of short blocks'
// means: neighbouring readings share the plate's texture. Pools all lines; 0 if they have too few
// readings.
double LevelNoise(const std::vector<LinePoints>& lines,
                  const std::vector<std::optional<Reference>>& references) {
  constexpr std::size_t kBlock = 4;
  std::vector<double> off;
  double blocks = 0, seen = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!references[i]) continue;
    ++seen;
    for (const std::vector<Point>& stretch : lines[i].slow) {
      for (std::size_t first = 0; first + kBlock <= stretch.size(); first += kBlock) {
        double sum = 0;
        for (std::size_t k = first; k < first + kBlock; ++k) {
          sum += stretch[k].value / references[i]->at(stretch[k].position);
        }
        off.push_back(sum / kBlock - 1);
        ++blocks;
      }
    }
  }
  const double each = seen > 0 ? blocks / seen : 0;
  if (each < 2) return 0;
  // The mean was fitted to the same blocks.
  return RobustStandardDeviation(off) * std::sqrt(each / (each - 1)) / std::sqrt(each);
}

// Estimates each level's uncertainty: at least `noise`. A few readings determine their own scatter
// badly; that of the other lines counts as much as `others` more of them.
void RateLevels(double others, double noise, std::vector<std::optional<Reference>>& references) {
  std::vector<double> variances;
  for (const auto& reference : references) {
    if (reference) variances.push_back(Square(reference->scatter_relative));
  }
  if (variances.empty()) return;
  const double usual = Median(variances);
  for (auto& reference : references) {
    if (!reference) continue;
    const double n = reference->weight;
    const double variance =
        (n * Square(reference->scatter_relative) + others * usual) / (n + others);
    // Neighbouring readings share flow noise: half of them count.
    reference->sigma_relative = std::max(noise, std::sqrt(variance / std::max(1.0, n / 2)));
  }
}

// Shrinks levels from few readings towards the lines' common level: lines differ in flow by a few
// per cent. A line with a clearly larger difference keeps its own.
void PoolLevels(std::vector<std::optional<Reference>>& references) {
  constexpr double kMinSpread = 0.01;  // relative; assumed
  constexpr double kFar = 3;           // standard deviations
  constexpr std::size_t kFewestLines = 4;
  std::vector<double> levels, variances;
  for (const auto& reference : references) {
    if (!reference) continue;
    levels.push_back(reference->level);
    variances.push_back(Square(reference->sigma_relative));
  }
  if (levels.size() < kFewestLines) return;
  const double common = Median(levels);
  const double spread = RobustStandardDeviation(levels) / common;
  const double between = std::max(Square(kMinSpread), Square(spread) - Median(variances));
  for (auto& reference : references) {
    if (!reference) continue;
    const double own = Square(reference->sigma_relative);
    const double away = reference->level / common - 1;
    if (!(std::abs(away) < kFar * std::sqrt(own + between))) continue;
    reference->level = common * (1 + away * between / (own + between));
    reference->sigma_relative = std::sqrt(own * between / (own + between));
  }
}

struct Integral {
  double value = 0;
  double variance = 0;
  double length = 0;
  double unread = 0;   // largest stretch without a reading, over the window's length
  double cut_off = 0;  // bridged across beads larger than the picture
};

// Integrates by trapezoids over the samples inside the window, extended to its edges.
Integral IntegrateDeviation(const LinePoints& line, const Reference& reference,
                            const Interval& span) {
  const std::vector<Point>& points = line.all;
  Integral integral;
  integral.length = span.hi - span.lo;
  double previous = span.lo;
  double held = 0;
  double unread = 0;
  bool first = true;
  const auto add = [&](double to, double deviation) {
    const double area = (to - previous) * deviation;
    integral.value += area;
    const auto cut = std::upper_bound(line.cut_off.begin(), line.cut_off.end(), previous);
    if (cut != line.cut_off.end() && *cut < to) integral.cut_off += std::abs(area);
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!span.Holds(points[i].position)) continue;
    const double level = reference.at(points[i].position);
    const double deviation = points[i].value / level - 1;
    const double step = points[i].position - previous;
    add(points[i].position, first ? deviation : 0.5 * (deviation + held));
    const double next = i + 1 < points.size() ? std::min(points[i + 1].position, span.hi) : span.hi;
    const double reach = 0.5 * (step + next - points[i].position);
    integral.variance += std::pow(reach * points[i].sigma / level, 2);
    unread = std::max(unread, step);
    previous = points[i].position;
    held = deviation;
    first = false;
  }
  add(span.hi, held);
  integral.unread = std::max(unread, span.hi - previous) / integral.length;
  if (first) integral.unread = 1;
  return integral;
}

// All lines with their references.
struct ReadLines {
  const std::vector<LineProfile>& profiles;
  const std::vector<LinePoints>& lines;
  const std::vector<std::optional<Reference>>& references;

  [[nodiscard]] Interval ShownOf(std::size_t line, const Interval& span) const {
    const Interval shown = profiles[line].shown.value_or(span);
    return {std::max(span.lo, shown.lo), std::min(span.hi, shown.hi)};
  }
  [[nodiscard]] bool ShowsAll(std::size_t line, const Interval& span) const {
    const Interval shown = ShownOf(line, span);
    return shown.lo == span.lo && shown.hi == span.hi;
  }
  [[nodiscard]] Integral Integrate(std::size_t line, const Interval& span) const {
    return IntegrateDeviation(lines[line], *references[line], span);
  }
};

// Completes a window cut by the picture, from the lines that show all of it.
void CompleteCut(const ReadLines& read, const Interval& span, double sign, std::size_t line,
                 const Integral& part, Surplus LineSurplus::*transition,
                 std::vector<LineSurplus>& results) {
  const Interval shown = read.ShownOf(line, span);
  std::vector<double> parts, wholes;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i].unusable.empty() || !(results[i].*transition).seen) continue;
    if (!read.ShowsAll(i, span)) continue;
    parts.push_back(read.Integrate(i, shown).value);
    wholes.push_back(sign * (results[i].*transition).value);
  }
  Surplus& surplus = results[line].*transition;
  const auto completed = CompleteWindow(parts, wholes, part.value);
  if (!completed) {
    surplus.seen = false;
    return;
  }
  surplus.value = sign * completed->value;
  surplus.sigma = std::hypot(completed->per_part * surplus.sigma, completed->sigma);
}

// Measures one transition of all usable lines that show it.
void MeasureWindow(const ReadLines& read, const Interval& span, double sign,
                   Surplus LineSurplus::*transition, std::vector<LineSurplus>& results) {
  std::vector<std::pair<std::size_t, Integral>> cut;
  for (std::size_t i = 0; i < results.size(); ++i) {
    LineSurplus& result = results[i];
    Surplus& surplus = result.*transition;
    if (!result.unusable.empty() || !surplus.seen) continue;
    const Interval shown = read.ShownOf(i, span);
    if (!(shown.hi > shown.lo)) {
      surplus.seen = false;
      continue;
    }
    const Integral integral = read.Integrate(i, shown);
    surplus.value = sign * integral.value;
    surplus.sigma =
        std::hypot(std::sqrt(integral.variance),
                   integral.length * read.references[i]->sigma_relative, integral.cut_off);
    if (integral.unread > kMaxUnread) {
      result.unusable = fmt::format(
          "{:.0f} % of the stretch from {:.3g} to {:.3g} could not be read in one piece",
          100 * integral.unread, shown.lo, shown.hi);
    } else if (!read.ShowsAll(i, span)) {
      cut.emplace_back(i, integral);
    }
  }
  for (const auto& [line, part] : cut) {
    CompleteCut(read, span, sign, line, part, transition, results);
  }
}

}  // namespace

std::vector<LineSurplus> MeasureSurplus(const std::vector<LineProfile>& profiles, Reading reading,
                                        const TransitionPlan& plan) {
  std::vector<LinePoints> lines;
  std::vector<double> levels;
  for (const LineProfile& profile : profiles) {
    lines.push_back(profile.unusable.empty() ? Sort(profile, reading, plan)
                                             : LinePoints{{}, {{}, {}}, {}});
    std::vector<Point> slow;
    for (const auto& stretch : lines.back().slow)
      slow.insert(slow.end(), stretch.begin(), stretch.end());
    if (slow.size() >= kFewestReadings) levels.push_back(MedianValue(slow));
  }
  const double drift = CommonDrift(profiles, lines, plan);
  const double centre = (plan.reference.front().lo + plan.reference.back().hi) / 2;
  const double common_level = levels.empty() ? 0 : Median(levels);

  std::vector<std::optional<Reference>> references(profiles.size());
  for (std::size_t i = 0; i < profiles.size() && common_level > 0; ++i) {
    if (!profiles[i].unusable.empty()) continue;
    references[i] = FitReference(lines[i], drift, centre, common_level);
  }
  // A steady middle has enough readings of its own.
  constexpr double kOthers = 4;
  if (plan.steady_middle) {
    RateLevels(0, 0, references);
  } else {
    RateLevels(kOthers, LevelNoise(lines, references), references);
    PoolLevels(references);
  }
  std::vector<LineSurplus> results(profiles.size());
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    LineSurplus& result = results[i];
    result.unusable = profiles[i].unusable;
    if (!result.unusable.empty()) continue;
    result.along = ChangeAlong(lines[i]);
    const std::optional<Reference>& reference = references[i];
    if (!reference || !(reference->at(plan.acceleration.span.lo) > 0) ||
        !(reference->at(plan.deceleration.span.hi) > 0)) {
      result.unusable = NoReference(lines[i], plan);
    }
    result.acceleration.seen = profiles[i].shows_acceleration;
    result.deceleration.seen = profiles[i].shows_deceleration;
  }
  const ReadLines read{profiles, lines, references};
  MeasureWindow(read, plan.acceleration.span, -1, &LineSurplus::acceleration, results);
  MeasureWindow(read, plan.deceleration.span, 1, &LineSurplus::deceleration, results);
  for (LineSurplus& result : results) {
    if (result.unusable.empty() && !result.acceleration.seen && !result.deceleration.seen) {
      result.unusable = "the picture shows too little of this line around its speed changes";
    }
  }
  return results;
}

}  // namespace trammel::pressure_advance
