#include "pressure_advance/timing/latency_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/statistics.h"
#include "pressure_advance/timing/sweep_positions.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kGrid_s = 0.001;
constexpr double kCapNats = 8;  ///< maximum cost of a pair: a glitch is no proof
constexpr double kMinStillSigma = 0.03;
constexpr double kMinMovingSigma = 0.08;
constexpr double kStandsBelow = 0.005;  ///< displacement as a share of a steady step
constexpr double kFullAbove = 0.98;

/// Track with its levels, in shares of a steady step.
struct Prepared {
  const ChangeTrack* track = nullptr;
  double step_mm = 0;
  double begin_s = 0;
  double end_s = 0;
  TrackFit levels;
  std::vector<double> share;  ///< per pair: 0 still … 1 moving at full speed
};

void SetLevels(Prepared& p, double still, double moving) {
  p.levels.still = still;
  p.levels.moving = moving;
  p.share.clear();
  const double contrast = std::max(moving - still, 1e-12);
  for (const ChangePair& pair : p.track->pairs) {
    // Clamped: the flash of a defect must not outweigh a hundred pairs.
    p.share.push_back(std::clamp((pair.change - still) / contrast, -0.6, 1.6));
  }
}

Prepared Prepare(const ChangeTrack& track) {
  Prepared p;
  p.track = &track;
  p.begin_s = track.motion.front().start_s;
  p.end_s = MotionEnd_s(track.motion);
  p.step_mm = LargestSpeed_mm_s(track.motion) * track.period_s;
  // Initial levels: the number of moving pairs corresponds to the motion's duration, and they
  // change more than the others.
  const double moving = std::clamp(
      (p.end_s - p.begin_s) / track.period_s / static_cast<double>(track.pairs.size()), 0.05, 0.95);
  std::vector<double> changes;
  for (const ChangePair& pair : track.pairs) changes.push_back(pair.change);
  SetLevels(p, Quantile(changes, 0.5 * (1 - moving)), Quantile(changes, 1 - 0.5 * moving));
  return p;
}

/// Computes the head's displacement between the two frames, relative to a steady step.
double Displacement(const Prepared& p, const ChangePair& pair, double latency_s) {
  const double from_mm = HeadAt(p.track->motion, pair.from_s - latency_s).position_mm;
  const double to_mm = HeadAt(p.track->motion, pair.to_s - latency_s).position_mm;
  return std::abs(to_mm - from_mm) / p.step_mm;
}

/// Prior of the change for a displacement: it saturates at two thirds of a step.
double Expected(double displacement) { return std::min(1.0, 1.5 * displacement); }

/// Computes the cost without scatters: for a first guess.
double RoughCost(const Prepared& p, double latency_s) {
  double cost = 0;
  for (std::size_t i = 0; i < p.share.size(); ++i) {
    const double expected = Expected(Displacement(p, p.track->pairs[i], latency_s));
    cost += std::min(1.0, std::abs(p.share[i] - expected));
  }
  return cost;
}

double Variance(const Prepared& p, const ChangePair& pair, double latency_s, double displacement) {
  const double still = p.levels.still_sigma * p.levels.still_sigma;
  const double moving = p.levels.moving_sigma * p.levels.moving_sigma;
  double variance = still + std::min(1.0, displacement) * (moving - still);
  // Near a beginning or an end an error of the stamps is an error of the displacement.
  const double reach_s = 2 * p.track->stamp_sigma_s;
  const bool near = (displacement > 0 && displacement < kFullAbove) ||
                    std::abs(pair.to_s - latency_s - p.begin_s) < reach_s ||
                    std::abs(pair.from_s - latency_s - p.end_s) < reach_s;
  if (near) {
    const double blur = p.track->stamp_sigma_s / p.track->period_s;
    variance += blur * blur;
  }
  return variance;
}

double Nats(double residual, double variance) {
  return std::min(kCapNats, 0.5 * residual * residual / variance + 0.5 * std::log(variance) +
                                -std::log(kMinStillSigma));
}

double OwnCost(const Prepared& p, double latency_s) {
  double cost = 0;
  for (std::size_t i = 0; i < p.share.size(); ++i) {
    const ChangePair& pair = p.track->pairs[i];
    const double displacement = Displacement(p, pair, latency_s);
    cost += Nats(p.share[i] - Expected(displacement), Variance(p, pair, latency_s, displacement));
  }
  return cost;
}

/// Does the same with the best-fitting nondecreasing curve "displacement -> change" of all tracks
/// (pool adjacent violators), without further assumptions.
double JointCost(std::span<const Prepared> tracks, double latency_s) {
  constexpr std::size_t kBins = 160;
  constexpr double kBinsPerStep = 100;
  struct Bin {
    double weight = 0;
    double sum = 0;
    std::size_t count = 0;  ///< bins pooled
  };
  struct Item {
    double share = 0;
    double variance = 0;
    std::size_t bin = 0;
  };
  std::array<Bin, kBins> bins{};
  std::vector<Item> items;
  for (const Prepared& p : tracks) {
    for (std::size_t i = 0; i < p.share.size(); ++i) {
      const ChangePair& pair = p.track->pairs[i];
      const double displacement = Displacement(p, pair, latency_s);
      const double variance = Variance(p, pair, latency_s, displacement);
      const std::size_t bin =
          displacement < kStandsBelow
              ? 0
              : std::min(kBins - 1, 1 + static_cast<std::size_t>(displacement * kBinsPerStep));
      bins[bin].weight += 1 / variance;
      bins[bin].sum += p.share[i] / variance;
      items.push_back({p.share[i], variance, bin});
    }
  }
  std::vector<Bin> pools;
  for (const Bin& bin : bins) {
    pools.push_back({bin.weight, bin.sum, 1});
    while (pools.size() > 1) {
      const Bin& last = pools.back();
      Bin& before = pools[pools.size() - 2];
      if (last.weight > 0 && before.weight > 0 &&
          before.sum / before.weight <= last.sum / last.weight) {
        break;
      }
      before.weight += last.weight;
      before.sum += last.sum;
      before.count += last.count;
      pools.pop_back();
    }
  }
  std::array<double, kBins> level{};
  std::size_t at = 0;
  for (const Bin& pool : pools) {
    for (std::size_t i = 0; i < pool.count; ++i) {
      level[at++] = pool.weight > 0 ? pool.sum / pool.weight : 0;
    }
  }
  double cost = 0;
  for (const Item& item : items) cost += Nats(item.share - level[item.bin], item.variance);
  return cost;
}

/// Estimates levels and scatters from the pairs that are certainly still or certainly at full
/// speed.
void Sharpen(Prepared& p, double latency_s) {
  std::vector<double> still;
  std::vector<double> moving;
  const double guard_s = p.track->period_s;
  for (const ChangePair& pair : p.track->pairs) {
    const double from_s = pair.from_s - latency_s - guard_s;
    const double to_s = pair.to_s - latency_s + guard_s;
    if (to_s < p.begin_s || from_s > p.end_s) still.push_back(pair.change);
    if (IsSteady(p.track->motion, from_s, to_s, 0.01)) moving.push_back(pair.change);
  }
  if (still.size() < 2 || moving.size() < 2) return;
  SetLevels(p, Median(still), Median(moving));
  const double contrast = std::max(p.levels.moving - p.levels.still, 1e-12);
  p.levels.still_sigma = std::max(kMinStillSigma, RobustStandardDeviation(still) / contrast);
  p.levels.moving_sigma = std::max(kMinMovingSigma, RobustStandardDeviation(moving) / contrast);
}

tl::unexpected<Error> Refuse(std::string reason) {
  return Fail(std::move(reason), ErrorKind::kMeasurement);
}

/// Returns the scatter of the upper half of the moving pairs: a temporary stop of the head does not
/// widen it.
double UpperScatter(const std::vector<double>& share) {
  const double middle = Median(share);
  std::vector<double> above;
  for (const double value : share) {
    if (value >= middle) above.push_back(value - middle);
  }
  constexpr double kNormal = 1.4826;
  return kNormal * Median(above);
}

/// Records the frames in which the picture is static though the head should move. Too many of them
/// are a contradiction.
Result<void> FindFrozen(Prepared& p, std::size_t number, double latency_s) {
  std::vector<double> share;
  std::vector<std::size_t> frame;
  for (std::size_t i = 0; i < p.share.size(); ++i) {
    const ChangePair& pair = p.track->pairs[i];
    const double guard_s = 0.5 * p.track->period_s;
    if (!IsSteady(p.track->motion, pair.from_s - latency_s - guard_s,
                  pair.to_s - latency_s + guard_s, 0.01)) {
      continue;
    }
    share.push_back(p.share[i]);
    frame.push_back(pair.frame);
  }
  constexpr double kFrozenBelow = 0.3;
  constexpr double kSure = 2.5;
  if (share.empty() || Median(share) - kFrozenBelow < kSure * UpperScatter(share)) return {};
  for (std::size_t i = 0; i < share.size(); ++i) {
    if (share[i] < kFrozenBelow) p.levels.frozen.push_back(frame[i]);
  }
  constexpr double kMaxFrozen = 0.15;
  if (static_cast<double>(p.levels.frozen.size()) >
      kMaxFrozen * static_cast<double>(share.size())) {
    return Refuse(fmt::format(
        "sweep {}: the picture stands still in {} of {} frames in which the head should move; did "
        "the head stop, or does the camera repeat frames?",
        number, p.levels.frozen.size(), share.size()));
  }
  return {};
}

/// Checks that the picture distinguishes rest and motion in this track, without contradictions.
Result<void> CheckTrack(Prepared& p, std::size_t number, double latency_s) {
  std::size_t before = 0;
  std::size_t after = 0;
  std::size_t restless = 0;
  std::size_t standing = 0;
  for (const double stamp_s : p.track->stamp_s) {
    before += stamp_s - latency_s < p.begin_s ? 1 : 0;
    after += stamp_s - latency_s > p.end_s ? 1 : 0;
  }
  for (std::size_t i = 0; i < p.share.size(); ++i) {
    const ChangePair& pair = p.track->pairs[i];
    if (pair.to_s - latency_s < p.begin_s || pair.from_s - latency_s > p.end_s) {
      ++standing;
      restless += p.share[i] > 0.6 ? 1 : 0;
    }
  }
  constexpr double kClearlyApart = 1.5;
  const double apart = 1 / std::hypot(p.levels.still_sigma, p.levels.moving_sigma);
  if (!(p.levels.moving > p.levels.still) || apart < kClearlyApart) {
    return Refuse(fmt::format(
        "sweep {}: the picture changes by {:.3g} from frame to frame while the head stands and by "
        "{:.3g} while it moves, which tells nothing; is the laser on and in the picture?",
        number, p.levels.still, p.levels.moving));
  }
  if (std::min(before, after) < kMinStill) {
    return Refuse(fmt::format(
        "sweep {}: {} frames of a standing head before the motion and {} after it; {} on either "
        "side are wanted: record for half a second longer",
        number, before, after, kMinStill));
  }
  constexpr double kMaxRestless = 0.2;
  if (static_cast<double>(restless) > kMaxRestless * static_cast<double>(standing)) {
    return Refuse(
        fmt::format("sweep {}: the picture changes in {} of {} frames in which the head should "
                    "stand; does something else move the head, or is the light unsteady?",
                    number, restless, standing));
  }
  return FindFrozen(p, number, latency_s);
}

double BestOf(double from_s, double to_s, double step_s, const auto& cost,
              double* least = nullptr) {
  double best = from_s;
  double lowest = std::numeric_limits<double>::infinity();
  for (double at = from_s; at <= to_s + 0.5 * step_s; at += step_s) {
    if (const double c = cost(at); c < lowest) {
      lowest = c;
      best = at;
    }
  }
  if (least != nullptr) *least = lowest;
  return best;
}

/// Computes mean and spread over a grid, each latency weighted by its likelihood.
void Weigh(const std::vector<double>& at, const std::vector<double>& cost, LatencyFit& fit) {
  const double lowest = *std::min_element(cost.begin(), cost.end());
  double sum = 0;
  double mean = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double weight = std::exp(lowest - cost[i]);
    sum += weight;
    mean += weight * at[i];
  }
  mean /= sum;
  double variance = kGrid_s * kGrid_s / 12;
  double passed = 0;
  fit.lo95_s = at.front();
  fit.hi95_s = at.back();
  bool below = true;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double weight = std::exp(lowest - cost[i]) / sum;
    variance += weight * (at[i] - mean) * (at[i] - mean);
    passed += weight;
    if (below && passed > 0.025) {
      fit.lo95_s = at[i];
      below = false;
    }
    if (passed <= 0.975) fit.hi95_s = std::min(at[i] + kGrid_s, at.back());
  }
  fit.latency_s = mean;
  fit.sigma_s = std::sqrt(variance);
}

}  // namespace

Result<LatencyFit> FitLatency(std::span<const ChangeTrack> tracks, const LatencySearch& search) {
  std::vector<Prepared> prepared;
  for (const ChangeTrack& track : tracks) prepared.push_back(Prepare(track));
  const double period_s = tracks.front().period_s;
  const auto all = [&](const auto& cost) {
    return [&, cost](double latency_s) {
      double sum = 0;
      for (const Prepared& p : prepared) sum += cost(p, latency_s);
      return sum;
    };
  };
  const double from_s = search.min_s - search.beyond_s;
  const double to_s = search.max_s + search.beyond_s;
  const double rough_s = BestOf(from_s, to_s, period_s / 4, all(RoughCost));
  for (Prepared& p : prepared) Sharpen(p, rough_s);
  for (std::size_t i = 0; i < prepared.size(); ++i) {
    TRY(CheckTrack(prepared[i], i + 1, rough_s));
  }
  double lowest = 0;
  double allowed_lowest = 0;
  const double best_s =
      BestOf(rough_s - 3 * period_s, rough_s + 3 * period_s, period_s / 8, all(OwnCost), &lowest);
  const double allowed_s =
      BestOf(search.min_s, search.max_s, period_s / 8, all(OwnCost), &allowed_lowest);
  constexpr double kContradiction = 10;
  if (allowed_lowest > lowest + kContradiction) {
    const bool early = best_s < search.min_s;
    return Refuse(fmt::format(
        "the picture shows the motion {:.0f} ms {} than the clocks allow: frames would be taken "
        "{:.0f} ms before their stamps, where {:.0f} … {:.0f} ms are possible; the camera's stamps "
        "or the printer's clock are off by that much",
        1e3 * (early ? search.min_s - best_s : best_s - search.max_s), early ? "earlier" : "later",
        1e3 * best_s, 1e3 * search.min_s, 1e3 * search.max_s));
  }
  const double centre_s = allowed_lowest > lowest ? allowed_s : best_s;
  std::vector<double> at;
  std::vector<double> cost;
  const double reach_s = 2 * period_s;
  for (double t = centre_s - reach_s; t <= centre_s + reach_s; t += kGrid_s) {
    if (t < search.min_s || t > search.max_s) continue;
    at.push_back(t);
    // Neighbouring pairs share a frame and its noise, so they contain less information than as many
    // independent ones.
    constexpr double kShared = 0.6;
    cost.push_back(kShared * JointCost(prepared, t));
  }
  if (at.empty()) {
    at.push_back(centre_s);
    cost.push_back(0);
  }
  LatencyFit fit;
  Weigh(at, cost, fit);
  for (Prepared& p : prepared) {
    double own = 0;
    p.levels.own_latency_s = BestOf(
        fit.latency_s - 3 * period_s, fit.latency_s + 3 * period_s, period_s / 8,
        [&](double t) { return OwnCost(p, t); }, &own);
    p.levels.own_gain = OwnCost(p, fit.latency_s) - own;
    fit.tracks.push_back(p.levels);
  }
  return fit;
}

}  // namespace trammel::pressure_advance
