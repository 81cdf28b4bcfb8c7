#include "pressure_advance/timing/camera_ticks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::size_t kStates = 16;    ///< ticks considered per frame: delays up to 16 periods
constexpr double kEarly_s = 0.002;     ///< apparent earliness of a frame, 1 sigma
constexpr double kMinScale_s = 0.002;  ///< scale of delays
constexpr double kLineQuantile = 0.1;
constexpr double kDropCost = 5;  ///< nats: one frame in 150 is lost

using Row = std::array<double, kStates>;

/// Dynamic program: frame i may belong to tick top[i] - state.
struct Trellis {
  std::vector<long> top;
  std::vector<Row> cost;
};

Trellis Unfold(std::span<const double> arrival_s, double origin_s, double period_s,
               double scale_s) {
  Trellis trellis;
  for (const double arrival : arrival_s) {
    constexpr double kEarlyShare = 0.3;
    const double ticks = (arrival - origin_s) / period_s;
    trellis.top.push_back(static_cast<long>(std::floor(ticks + kEarlyShare)));
    Row row{};
    for (std::size_t s = 0; s < kStates; ++s) {
      const double delay =
          (ticks - static_cast<double>(trellis.top.back() - static_cast<long>(s))) * period_s;
      row[s] = delay >= 0 ? delay / scale_s : 0.5 * (delay / kEarly_s) * (delay / kEarly_s);
    }
    trellis.cost.push_back(row);
  }
  return trellis;
}

/// Returns the minimum cost from the first frame to each state of each frame, the state included.
std::vector<Row> Forward(const Trellis& trellis) {
  std::vector<Row> total(trellis.cost.size());
  total[0] = trellis.cost[0];
  for (std::size_t i = 1; i < total.size(); ++i) {
    // States run from late ticks to early ones; a predecessor has an earlier tick. From early to
    // late, the minimum over predecessors so far only grows by a loss per tick.
    const long before_top = trellis.top[i - 1];
    double best = kInfinite;                                  // for the tick below the current one
    long next = before_top - static_cast<long>(kStates) + 1;  // earliest tick not yet offered
    const long first = trellis.top[i] - static_cast<long>(kStates) + 1;
    for (long tick = std::min(next + 1, first); tick <= trellis.top[i]; ++tick) {
      best += kDropCost;
      if (next < tick && next <= before_top) {
        best = std::min(best, total[i - 1][static_cast<std::size_t>(before_top - next)]);
        ++next;
      }
      if (tick >= first) {
        const auto s = static_cast<std::size_t>(trellis.top[i] - tick);
        total[i][s] = best + trellis.cost[i][s];
      }
    }
  }
  return total;
}

/// Returns the minimum cost from each state of each frame to the last one, the state excluded.
std::vector<Row> Backward(const Trellis& trellis) {
  std::vector<Row> total(trellis.cost.size(), Row{});
  for (std::size_t i = total.size() - 1; i-- > 0;) {
    const long after_top = trellis.top[i + 1];
    const long after_first = after_top - static_cast<long>(kStates) + 1;
    double best = kInfinite;  // for the tick above the current one
    long next = after_top;    // latest tick not yet offered
    for (long tick = std::max(after_top, trellis.top[i] + 1) - 1;
         tick > trellis.top[i] - static_cast<long>(kStates); --tick) {
      best += kDropCost;
      if (next > tick && next >= after_first) {
        const auto s = static_cast<std::size_t>(after_top - next);
        best = std::min(best, total[i + 1][s] + trellis.cost[i + 1][s]);
        --next;
      }
      if (tick <= trellis.top[i]) total[i][static_cast<std::size_t>(trellis.top[i] - tick)] = best;
    }
  }
  return total;
}

/// Assigns the ticks of minimum cost, which it returns.
double Assign(const Trellis& trellis, std::vector<long>& tick, std::vector<bool>& certain) {
  const std::vector<Row> forward = Forward(trellis);
  const std::vector<Row> backward = Backward(trellis);
  const std::size_t count = trellis.top.size();
  tick.assign(count, 0);
  certain.assign(count, false);
  double cost = kInfinite;
  for (std::size_t i = 0; i < count; ++i) {
    double best = kInfinite;
    double second = kInfinite;
    std::size_t state = 0;
    for (std::size_t s = 0; s < kStates; ++s) {
      const double through = forward[i][s] + backward[i][s];
      if (through < best) {
        second = best;
        best = through;
        state = s;
      } else {
        second = std::min(second, through);
      }
    }
    tick[i] = trellis.top[i] - static_cast<long>(state);
    constexpr double kCertain = 13;  // nats to the next best alternative
    certain[i] = second - best > kCertain;
    cost = best;
  }
  // Equally cheap paths may cross; the ticks must still rise.
  for (std::size_t i = 1; i < count; ++i) tick[i] = std::max(tick[i], tick[i - 1] + 1);
  return cost;
}

struct Line {
  double origin_s = 0;
  double period_s = 0;
};

/// Fits the line with a tenth of the arrivals below it (iteratively reweighted least squares on the
/// pinball loss). With a fixed period only the origin is fitted.
Line QuantileLine(std::span<const double> arrival_s, const std::vector<long>& tick, Line line,
                  bool fixed_period) {
  std::vector<double> left(arrival_s.size());
  if (!fixed_period) {
    const double middle = 0.5 * static_cast<double>(tick.front() + tick.back());
    for (int iteration = 0; iteration < 25; ++iteration) {
      double sw = 0, sx = 0, sxx = 0, sy = 0, sxy = 0;
      const double base = line.origin_s + line.period_s * middle;
      for (std::size_t i = 0; i < tick.size(); ++i) {
        constexpr double kSoft_s = 3e-4;
        const double x = static_cast<double>(tick[i]) - middle;
        const double residual = arrival_s[i] - base - line.period_s * x;
        const double w = (residual >= 0 ? kLineQuantile : 1 - kLineQuantile) /
                         std::max(std::abs(residual), kSoft_s);
        sw += w;
        sx += w * x;
        sxx += w * x * x;
        sy += w * residual;
        sxy += w * x * residual;
      }
      const double determinant = sw * sxx - sx * sx;
      if (!(determinant > 0)) break;
      const double slope = (sw * sxy - sx * sy) / determinant;
      line.period_s += slope;
      line.origin_s = base + (sy - slope * sx) / sw - line.period_s * middle;
    }
  }
  for (std::size_t i = 0; i < tick.size(); ++i) {
    left[i] = arrival_s[i] - line.period_s * static_cast<double>(tick[i]);
  }
  line.origin_s = Quantile(left, kLineQuantile);
  return line;
}

void Describe(std::span<const double> arrival_s, const Line& line, TickFit& fit) {
  fit.origin_s = line.origin_s;
  fit.period_s = line.period_s;
  fit.delay_s.clear();
  for (std::size_t i = 0; i < arrival_s.size(); ++i) {
    fit.delay_s.push_back(arrival_s[i] - fit.At(fit.tick[i]));
  }
  const double least = Quantile(fit.delay_s, 0.01);
  fit.typical_delay_s = Median(fit.delay_s) - least;
  // Standard deviation of a sample quantile: sqrt(q (1 - q) / n) over the density there;
  // neighbouring delays are correlated, so that about half of the frames count.
  const double count = 0.5 * static_cast<double>(arrival_s.size());
  const double inverse_density =
      (Quantile(fit.delay_s, 0.2) - Quantile(fit.delay_s, 0.02)) / (0.2 - 0.02);
  constexpr double kMinSigma_s = 2e-4;
  fit.origin_sigma_s = std::max(
      kMinSigma_s, inverse_density * std::sqrt(kLineQuantile * (1 - kLineQuantile) / count));
  const double span = static_cast<double>(fit.tick.back() - fit.tick.front() + 1);
  fit.period_sigma_s = fit.origin_sigma_s * std::sqrt(12.0) / span;
  const std::size_t window = std::max<std::size_t>(16, arrival_s.size() / 5);
  fit.unevenness_s = 0;
  for (std::size_t begin = 0; begin + window <= arrival_s.size(); begin += window / 2) {
    const auto at = fit.delay_s.begin() + static_cast<std::ptrdiff_t>(begin);
    const double lowest = *std::min_element(at, at + static_cast<std::ptrdiff_t>(window));
    fit.unevenness_s = std::max(fit.unevenness_s, lowest - least);
  }
  fit.lost = static_cast<std::size_t>(fit.tick.back() - fit.tick.front() + 1) - arrival_s.size();
}

/// Alternates ticks and line from a first guess; returns the cost, which ranks guesses.
double Refine(std::span<const double> arrival_s, Line line, bool fixed_period, TickFit& fit) {
  double scale_s = std::max(kMinScale_s, 0.5 * line.period_s);
  double cost = kInfinite;
  double early_s = 0;  // earliest deliveries relative to the line
  for (int round = 0; round < 4; ++round) {
    const Trellis trellis = Unfold(arrival_s, line.origin_s + early_s, line.period_s, scale_s);
    cost = Assign(trellis, fit.tick, fit.certain);
    line = QuantileLine(arrival_s, fit.tick, line, fixed_period);
    Describe(arrival_s, line, fit);
    early_s = Quantile(fit.delay_s, 0.01);
    scale_s = std::max(kMinScale_s, Mean(fit.delay_s) - early_s);
    cost += static_cast<double>(arrival_s.size()) * std::log(scale_s);
  }
  return cost;
}

/// Returns the line below all arrivals that is nearest to them if no frame was lost: the edge of
/// the lower convex hull over the middle frame.
Line HullLine(std::span<const double> arrival_s) {
  std::vector<std::size_t> hull;
  const auto slope = [&](std::size_t a, std::size_t b) {
    return (arrival_s[b] - arrival_s[a]) / static_cast<double>(b - a);
  };
  for (std::size_t i = 0; i < arrival_s.size(); ++i) {
    while (hull.size() >= 2 && slope(hull[hull.size() - 2], hull.back()) >= slope(hull.back(), i)) {
      hull.pop_back();
    }
    hull.push_back(i);
  }
  std::size_t edge = 1;
  while (edge + 1 < hull.size() && hull[edge] < arrival_s.size() / 2) ++edge;
  Line line;
  line.period_s = slope(hull[edge - 1], hull[edge]);
  line.origin_s = arrival_s[hull[edge]] - line.period_s * static_cast<double>(hull[edge]);
  return line;
}

std::vector<double> Periods(std::span<const double> arrival_s, double nominal_period_s) {
  const double mean =
      (arrival_s.back() - arrival_s.front()) / static_cast<double>(arrival_s.size() - 1);
  std::vector<double> periods;
  // Half and double the rate, and the usual steps between: 25, 24, 20, 15, 10 for 30 frames/s.
  for (const double multiple : {0.5, 1.0, 1.2, 1.25, 1.5, 2.0, 3.0, 4.0}) {
    constexpr double kMaxLost = 0.3;
    const double period = multiple * nominal_period_s;
    if (period > mean * 1.03 || period < mean / (1 + kMaxLost) / 1.03) continue;
    for (const double off : {-0.004, 0.0, 0.004}) periods.push_back(period * (1 + off));
  }
  return periods;
}

/// Returns the period near `period_s` at which the times best match whole ticks.
double CoherentPeriod(const std::vector<double>& time_s, double period_s) {
  constexpr double kReach = 1.5e-3;  // error of the sweeps' own fits; an alias is 4e-3 away
  constexpr double kStep = 1e-5;
  double best = period_s;
  double most = -1;
  for (double off = -kReach; off <= kReach; off += kStep) {
    const double candidate = period_s * (1 + off);
    double real = 0;
    double imaginary = 0;
    for (const double t : time_s) {
      const double phase = 2 * std::numbers::pi * (t - time_s.front()) / candidate;
      real += std::cos(phase);
      imaginary += std::sin(phase);
    }
    if (const double sum = std::hypot(real, imaginary); sum > most) {
      most = sum;
      best = candidate;
    }
  }
  return best;
}

/// Numbers the ticks of all sweeps consecutively, from fits with a common period; false if a
/// sweep's ticks do not continue those before it.
bool Chain(std::vector<TickFit>& fits, Line& line) {
  std::vector<double> time_s;
  for (const TickFit& fit : fits) {
    time_s.push_back(fit.At((fit.tick.front() + fit.tick.back()) / 2));
  }
  line.period_s = CoherentPeriod(time_s, fits.front().period_s);
  std::vector<double> phase;
  for (const double t : time_s) {
    const double ticks = (t - time_s.front()) / line.period_s;
    phase.push_back(ticks - std::round(ticks));
  }
  line.origin_s = time_s.front() + Median(phase) * line.period_s;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const double ticks = (time_s[i] - line.origin_s) / line.period_s;
    constexpr double kContinues = 0.25;
    if (std::abs(ticks - std::round(ticks)) > kContinues) return false;
    const long shift = std::lround(ticks) - (fits[i].tick.front() + fits[i].tick.back()) / 2;
    for (long& tick : fits[i].tick) tick += shift;
  }
  return true;
}

/// Fits one line through all sweeps; their ticks are reassigned along it.
bool FitOneLine(std::span<const std::vector<double>> arrivals, std::vector<TickFit>& fits) {
  Line line;
  if (!Chain(fits, line)) return false;
  std::vector<double> all_arrivals;
  for (const auto& arrival_s : arrivals) {
    all_arrivals.insert(all_arrivals.end(), arrival_s.begin(), arrival_s.end());
  }
  TickFit all;
  for (int round = 0; round < 2; ++round) {
    all.tick.clear();
    for (const TickFit& fit : fits)
      all.tick.insert(all.tick.end(), fit.tick.begin(), fit.tick.end());
    line = QuantileLine(all_arrivals, all.tick, line, false);
    Describe(all_arrivals, line, all);
    const double early_s = Quantile(all.delay_s, 0.01);
    const double scale_s = std::max(kMinScale_s, Mean(all.delay_s) - early_s);
    for (std::size_t i = 0; i < fits.size(); ++i) {
      const Trellis trellis = Unfold(arrivals[i], line.origin_s + early_s, line.period_s, scale_s);
      Assign(trellis, fits[i].tick, fits[i].certain);
    }
  }
  for (std::size_t i = 0; i < fits.size(); ++i) {
    TickFit own = fits[i];
    Describe(arrivals[i], line, own);
    // A sweep whose earliest frames deviate does not continue the others' ticks.
    constexpr double kSure = 5;
    const double away_s = Quantile(own.delay_s, kLineQuantile);
    if (std::abs(away_s) > kSure * own.origin_sigma_s + 0.002) return false;
    own.origin_sigma_s = all.origin_sigma_s;
    own.period_sigma_s = all.period_sigma_s;
    fits[i] = std::move(own);
  }
  return true;
}

}  // namespace

TickFit FitKnownTicks(std::span<const double> arrival_s, std::vector<long> tick) {
  TRAMMEL_CHECK(arrival_s.size() >= 10 && tick.size() == arrival_s.size(), "{} frames, {} ticks",
                arrival_s.size(), tick.size());
  Line line;
  line.period_s =
      (arrival_s.back() - arrival_s.front()) / static_cast<double>(tick.back() - tick.front());
  line.origin_s = arrival_s.front() - line.period_s * static_cast<double>(tick.front());
  TickFit fit;
  fit.tick = std::move(tick);
  fit.certain.assign(fit.tick.size(), true);
  Describe(arrival_s, QuantileLine(arrival_s, fit.tick, line, false), fit);
  return fit;
}

TickFit FitTicks(std::span<const double> arrival_s, double nominal_period_s, double period_s) {
  TRAMMEL_CHECK(arrival_s.size() >= 10 && nominal_period_s > 0, "{} frames, {} s", arrival_s.size(),
                nominal_period_s);
  TickFit best;
  double best_cost = kInfinite;
  const auto attempt = [&](const Line& line, bool fixed) {
    TickFit fit;
    const double cost = Refine(arrival_s, line, fixed, fit);
    if (cost < best_cost) {
      best_cost = cost;
      best = std::move(fit);
    }
  };
  const auto attempt_phases = [&](double period, bool fixed) {
    constexpr int kPhases = 4;
    for (int phase = 0; phase < kPhases; ++phase) {
      attempt({arrival_s.front() - period * phase / kPhases, period}, fixed);
    }
  };
  if (period_s > 0) {
    attempt_phases(period_s, true);
    return best;
  }
  const Line hull = HullLine(arrival_s);
  if (hull.period_s > 0) attempt(hull, false);
  constexpr double kEven = 0.25;
  if (best_cost < kInfinite && best.lost == 0 && best.unevenness_s < kEven * best.period_s) {
    return best;
  }
  for (const double period : Periods(arrival_s, nominal_period_s)) attempt_phases(period, false);
  return best;
}

std::vector<TickFit> FitSessionTicks(std::span<const std::vector<double>> arrivals,
                                     double nominal_period_s) {
  std::vector<TickFit> fits;
  std::vector<double> periods;
  for (const auto& arrival_s : arrivals) {
    fits.push_back(FitTicks(arrival_s, nominal_period_s));
    periods.push_back(fits.back().period_s);
  }
  if (arrivals.size() < 2) return fits;
  const double period_s = Median(periods);
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    fits[i] = FitTicks(arrivals[i], nominal_period_s, period_s);
    if (fits[i].tick.empty()) return fits;
  }
  std::vector<TickFit> chained = fits;
  if (FitOneLine(arrivals, chained)) return chained;
  return fits;
}

}  // namespace trammel::pressure_advance
