#include "pressure_advance/photo/photo_segments.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

double UsualWidth(const LineProfile& profile) {
  std::vector<double> widths;
  for (const ProfileSample& sample : profile.samples) {
    if (sample.width.seen()) widths.push_back(sample.width.value);
  }
  return widths.size() < profile.samples.size() / 4 + 1 ? 0 : Median(widths);
}

struct Extreme {
  double position = 0;
  double size = 0;
};

// Returns the maximum of sign * slope within reach of a place; its position is the lobe's centre of
// gravity above half of its peak. Positions in line lengths.
Extreme LargestNear(const WidthTrend& trend, const ShownPart& part, double place, double reach,
                    double sign) {
  Extreme extreme{place, 0};
  std::size_t top = trend.slope.size();
  for (std::size_t i = 0; i < trend.slope.size(); ++i) {
    if (std::abs(part.InLine(trend.position[i]) - place) > reach) continue;
    if (sign * trend.slope[i] > extreme.size) {
      extreme.size = sign * trend.slope[i];
      top = i;
    }
  }
  if (top == trend.slope.size()) return extreme;
  std::size_t a = top, b = top;
  while (a > 0 && sign * trend.slope[a - 1] > extreme.size / 2) --a;
  while (b + 1 < trend.slope.size() && sign * trend.slope[b + 1] > extreme.size / 2) ++b;
  double weights = 0, moment = 0;
  for (std::size_t i = a; i <= b; ++i) {
    const double weight = sign * trend.slope[i] - extreme.size / 2;
    weights += weight;
    moment += weight * trend.position[i];
  }
  extreme.position = part.InLine(weights > 0 ? moment / weights : trend.position[top]);
  return extreme;
}

struct Hypothesis {
  bool reversed = false;
  bool upside_down = false;
  Extreme acceleration, deceleration;
  ShownPart shown;
  double misfit = 0;  // of both places from the plan, in line lengths

  [[nodiscard]] double score() const { return acceleration.size + deceleration.size; }
};

constexpr double kReach = 0.08;  // line lengths: what frames hide, and how far a bulge is carried

// Returns a reading with the best-fitting part of the lines: among those with nearly the maximum
// score, the one that moves both positions nearest to the plan.
Hypothesis BestPart(const WidthTrend& trend, double slow_before, double slow_after, bool reversed,
                    bool upside_down, std::span<const ShownPart> parts) {
  const double sign = upside_down ? -1 : 1;
  const double rise = reversed ? 1 - slow_before : slow_before;
  const double fall = reversed ? slow_after : 1 - slow_after;
  std::vector<Hypothesis> fits;
  double best_score = 0;
  for (const ShownPart& part : parts) {
    Hypothesis h{reversed, upside_down, {}, {}, part, 0};
    h.acceleration = LargestNear(trend, part, rise, kReach, sign);
    h.deceleration = LargestNear(trend, part, fall, kReach, -sign);
    h.misfit = std::abs(h.acceleration.position - rise) + std::abs(h.deceleration.position - fall);
    best_score = std::max(best_score, h.score());
    fits.push_back(h);
  }
  constexpr double kNearly = 0.98;
  const Hypothesis* best = nullptr;
  for (const Hypothesis& h : fits) {
    if (h.score() < kNearly * best_score) continue;
    if (best == nullptr || h.misfit < best->misfit) best = &h;
  }
  return *best;
}

}  // namespace

WidthTrend MeasureWidthTrend(const std::vector<LineProfile>& profiles) {
  WidthTrend trend;
  std::vector<double> usual;
  std::vector<double> values;
  for (const LineProfile& profile : profiles) {
    TRAMMEL_CHECK(profile.samples.size() == profiles.front().samples.size(), "{} and {} samples",
                  profile.samples.size(), profiles.front().samples.size());
    usual.push_back(profile.unusable.empty() ? UsualWidth(profile) : 0);
    if (usual.back() > 0) values.push_back(profile.pressure_advance_s);
  }
  constexpr std::size_t kFewestLines = 4;
  if (values.size() < kFewestLines) return trend;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double range = *most - *least;
  if (!(range > 0)) return trend;
  // At places that few lines show the slope would be mostly noise.
  constexpr double kMinShown = 0.4;
  const double fewest =
      std::max(static_cast<double>(kFewestLines), kMinShown * static_cast<double>(values.size()));
  std::vector<double> raw, errors;
  for (std::size_t i = 0; i < profiles.front().samples.size(); ++i) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
    for (std::size_t line = 0; line < profiles.size(); ++line) {
      const ProfileSample& sample = profiles[line].samples[i];
      if (!(usual[line] > 0) || !sample.width.seen()) continue;
      const double x = profiles[line].pressure_advance_s / range;
      const double y = std::clamp(sample.width.value / usual[line], 0.0, 2.0);
      n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y;
    }
    const double spread = n * sxx - sx * sx;
    raw.push_back(n >= fewest && spread > 0 ? (n * sxy - sx * sy) / spread : 0);
    if (n >= fewest && spread > 0) {
      const double rest = (syy - sy * sy / n) - raw.back() * (sxy - sx * sy / n);
      errors.push_back(std::sqrt(std::max(0.0, rest) / (n - 2) * n / spread));
    }
    trend.position.push_back(profiles.front().samples[i].position);
  }
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const std::size_t half = std::max<std::size_t>(1, raw.size() / 100);
    const std::size_t a = i < half ? 0 : i - half, b = std::min(raw.size(), i + half + 1);
    double sum = 0;
    for (std::size_t k = a; k < b; ++k) sum += raw[k];
    trend.slope.push_back(sum / static_cast<double>(b - a));
  }
  // Maximum of the lines' scatter and of the trend's variation in its quieter half: light and plate
  // are no noise, but no response to PA either.
  if (errors.empty()) return {};
  constexpr double kFloor = 0.01;
  std::vector<double> sizes;
  for (const double slope : trend.slope) sizes.push_back(std::abs(slope));
  trend.scatter = std::max({kFloor, Median(errors), Quantile(sizes, 0.4)});
  return trend;
}

TrendReading ReadTrend(const WidthTrend& trend, double slow_before, double slow_after,
                       std::optional<bool> reversed, std::span<const ShownPart> parts) {
  TRAMMEL_CHECK(!parts.empty(), "no part of the lines can be shown");
  TrendReading reading;
  if (trend.slope.empty()) return reading;
  std::vector<Hypothesis> hypotheses;
  for (const bool from_end : {false, true}) {
    if (reversed && *reversed != from_end) continue;
    for (const bool upside_down : {false, true}) {
      hypotheses.push_back(BestPart(trend, slow_before, slow_after, from_end, upside_down, parts));
    }
  }
  // A plan with two equal ends looks the same reversed, with the order reversed; the order is then
  // assumed, also for ends that differ by less than a bulge's displacement.
  const bool ends_alike = std::abs(slow_before - slow_after) < kReach;
  reading.order_compared = !ends_alike || reversed;
  if (!reading.order_compared) {
    std::erase_if(hypotheses, [](const Hypothesis& h) { return h.upside_down; });
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score() > b.score(); });
  const Hypothesis& best = hypotheses.front();
  reading.reversed = best.reversed;
  reading.upside_down = best.upside_down;
  reading.shown = best.shown;
  reading.significance = best.score() / trend.scatter;
  reading.lead = (best.score() - hypotheses[1].score()) / trend.scatter;
  const double weaker = std::min(best.acceleration.size, best.deceleration.size) / trend.scatter;
  constexpr double kMinSignificance = 6;
  if (weaker >= kMinSignificance) {
    const auto from_start = [&](double p) { return best.reversed ? 1 - p : p; };
    constexpr double kLobe = 0.02;  // a bead's footprint and the smoothing of the trend
    reading.segments = FoundSegments{from_start(best.acceleration.position),
                                     from_start(best.deceleration.position), kLobe, weaker};
  }
  return reading;
}

std::vector<ShownPart> PossibleParts(bool first_end_seen, bool last_end_seen) {
  constexpr double kMaxHidden = 0.4, kStep = 0.01;
  std::vector<ShownPart> parts;
  const double max_first = first_end_seen ? 0 : kMaxHidden;
  const double max_last = last_end_seen ? 0 : kMaxHidden;
  for (double first = 0; first <= max_first; first += kStep) {
    for (double last = 0; last <= max_last; last += kStep) parts.push_back({first, 1 - last});
  }
  return parts;
}

}  // namespace trammel::pressure_advance
