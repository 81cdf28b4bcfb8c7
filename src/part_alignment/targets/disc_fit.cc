#include "part_alignment/targets/disc_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "part_alignment/targets/disc_pass.h"
#include "part_alignment/targets/small_cholesky.h"

namespace trammel::part_alignment {
namespace {

constexpr int kMaxIterations = 20;
constexpr double kSettledCut_px = 0.001;  ///< where the set of saturated pixels still changes
constexpr double kSettled = 0.2;          ///< a step's own error, of the centre's sigma
constexpr double kRowsOfFirst = 5;  ///< that many, and twice, cross the disc in the first pass
constexpr double kRoundingNoise = 0.2887;  ///< 1 / sqrt(12)

/// A step, kept within what a start right to a pixel can need.
void Step(const DiscVector& d, DiscModel& m) {
  const double radius = MeanRadius(m);
  const auto within = [](double value, double bound) { return std::clamp(value, -bound, bound); };
  m.column_px += within(d[0], 1.0);
  m.row_px += within(d[1], 1.0);
  m.wxx += within(d[2], 0.2 / radius);
  m.wxy += within(d[3], 0.2 / radius);
  m.wyy += within(d[4], 0.2 / radius);
  m.blur_px = std::clamp(m.blur_px + within(d[5], 0.5), 0.25, 0.6 * radius);
  m.contrast += within(d[6], 100.0);
  m.background += within(d[7], 50.0);
  m.gradient_x += d[8];
  m.gradient_y += d[9];
}

/// Centre and gradient explain the same pixels in part: a gradient that is only noise costs up to a
/// third of the centre's precision. So as much of it as noise could be is taken back, and the
/// centre follows as their covariance says. Its variance then lies between that with a known
/// gradient and that with a free one: a quarter of the difference always stays for the gradient
/// that is there but lost in noise, and all of it where what was taken back was hardly noise.
void ShrinkGradient(const DiscMatrix& covariance, DiscFit& fit) {
  constexpr double kNoiseChi2 = 3;  ///< of two parameters: below it in 78 % of pictures without one
  constexpr double kLeastShare = 0.25;
  constexpr double kCertainChi2 = 6;  ///< noise alone reaches it in 5 % of pictures
  DiscModel& m = fit.model;
  const double a = covariance(8, 8);
  const double b = covariance(8, 9);
  const double c = covariance(9, 9);
  const double det = a * c - b * b;
  double share = kLeastShare;
  std::array<double, 2> by_gradient{};  // variance that the gradient brings, in units of noise²
  if (det > 0) {
    const double px = (c * m.gradient_x - b * m.gradient_y) / det;
    const double py = (a * m.gradient_y - b * m.gradient_x) / det;
    const double chi2 = (px * m.gradient_x + py * m.gradient_y) / (fit.noise * fit.noise);
    const double back = std::min(1.0, kNoiseChi2 / std::max(chi2, 1e-12));
    share = std::clamp(chi2 / kCertainChi2, kLeastShare, 1.0);
    m.column_px -= back * (covariance(0, 8) * px + covariance(0, 9) * py);
    m.row_px -= back * (covariance(1, 8) * px + covariance(1, 9) * py);
    m.gradient_x *= 1 - back;
    m.gradient_y *= 1 - back;
    for (int i = 0; i < 2; ++i) {
      const double x = covariance(i, 8);
      const double y = covariance(i, 9);
      by_gradient[static_cast<std::size_t>(i)] = (c * x * x - 2 * b * x * y + a * y * y) / det;
    }
  }
  const double taken = 1 - share;
  fit.sigma_column_px = fit.noise * std::sqrt(covariance(0, 0) - taken * by_gradient[0]);
  fit.sigma_row_px = fit.noise * std::sqrt(covariance(1, 1) - taken * by_gradient[1]);
}

using DiscFactor = Eigen::LLT<DiscMatrix>;

/// The centre's sigma that the factored normal equations give.
double CentreSigma(const DiscFactor& factor, double mean_square) {
  const DiscMatrix inverse = factor.solve(DiscMatrix::Identity());
  return std::sqrt((inverse(0, 0) + inverse(1, 1)) * mean_square);
}

/// How many times worse the centre is known than by pixels that scatter by themselves: what a
/// lamp's image or a shadow's edge leaves has one sign over a whole sector. 1 where nothing of it
/// shows.
double UnevenLight(const SectorSums& sums, double noise) {
  double chi2 = 0;
  int count = 0;
  const auto add = [&](double sum, double squares) {
    if (squares <= 0) return;
    chi2 += sum * sum / (squares * noise * noise);
    ++count;
  };
  for (const SectorSum& sum : sums) {
    add(sum.edge, sum.edge2);
    add(sum.inside, sum.inside_count);
    add(sum.outside, sum.outside_count);
  }
  const int freedom = std::max(count - kDiscParameters, 1);
  return std::sqrt(std::max(1.0, chi2 / freedom));
}

/// Noise and sigmas.
/// @param factor  of normal.jtj
/// @param step    the last, which `normal` led to.
void Finish(const DiscNormal& normal, const DiscFactor& factor, const DiscVector& step,
            DiscFit& fit) {
  fit.samples = normal.samples;
  fit.saturated = normal.saturated;
  const int spare = normal.samples - normal.saturated - kDiscParameters;
  const double rss = normal.rss - normal.jtr.dot(step);
  fit.noise = std::max(kRoundingNoise, std::sqrt(std::max(rss, 0.0) / spare));
  ShrinkGradient(factor.solve(DiscMatrix::Identity()), fit);
}

}  // namespace

ImageEllipse EllipseOf(const DiscModel& model) {
  const double mean = 0.5 * (model.wxx + model.wyy);
  const double spread = std::hypot(0.5 * (model.wxx - model.wyy), model.wxy);
  // The long axis is where W is small.
  return {model.column_px, model.row_px, 1 / (mean - spread), 1 / (mean + spread),
          0.5 * std::atan2(-2 * model.wxy, model.wyy - model.wxx)};
}

double MeanRadius(const DiscModel& model) {
  return 1 / std::sqrt(std::max(model.wxx * model.wyy - model.wxy * model.wxy, 1e-12));
}

std::optional<DiscFit> FitDisc(const PageView& picture, const DiscModel& start,
                               const RingShade& ring) {
  constexpr int kLeastSamples = 3 * kDiscParameters;
  constexpr double kWorse = 1.05;  ///< the band moves with the edge, so a little more is no loss
  // Some rows make a first step good enough.
  const int first_every = std::clamp(static_cast<int>(MeanRadius(start) / kRowsOfFirst), 1, 6);
  DiscFit fit;
  fit.model = start;
  DiscModel best = start;
  double best_mean = std::numeric_limits<double>::infinity();
  double damping = 1e-4;
  DiscNormal kept;
  int kept_every = 0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const int every = iteration == 0 ? first_every : 1;
    const DiscNormal normal = SumOverPixels(picture, fit.model, ring, every);
    if (normal.samples - normal.saturated < kLeastSamples) return std::nullopt;
    const double mean = normal.rss / (normal.samples - normal.saturated);
    // What few rows left says nothing about all of them.
    if (kept_every != 1 || mean < kWorse * best_mean) {
      best = fit.model;
      best_mean = mean;
      kept = normal;
      kept_every = every;
      damping *= 0.1;
    } else {
      damping = std::max(1e-2, damping * 30);
    }
    DiscMatrix damped = kept.jtj;
    damped.diagonal() *= 1 + damping;
    const auto factor = Factored<kDiscParameters>(damped);
    if (!factor) return std::nullopt;
    const DiscVector step = factor->solve(kept.jtr);
    fit.model = best;
    Step(step, fit.model);
    const DiscModel& m = fit.model;
    if (!(m.wxx > 0 && m.wxx * m.wyy > m.wxy * m.wxy)) return std::nullopt;
    if (std::hypot(m.column_px - start.column_px, m.row_px - start.row_px) >
        0.5 * MeanRadius(start)) {
      return std::nullopt;
    }
    if (kept_every > 1 || iteration == 0) continue;
    // A step's own error is of second order: its share of the blur, and that of the blur's.
    const double moved = std::hypot(m.column_px - best.column_px, m.row_px - best.row_px);
    const double off = moved * (moved + std::abs(m.blur_px - best.blur_px)) / m.blur_px;
    if (off > kSettled * CentreSigma(*factor, best_mean)) continue;
    if (kept.saturated > 0 && moved > kSettledCut_px) continue;
    const auto undamped = Factored<kDiscParameters>(kept.jtj);
    if (!undamped) return std::nullopt;
    const DiscModel settled = fit.model;
    Finish(kept, *undamped, step, fit);
    const double worse = UnevenLight(SumBySectors(picture, settled, ring), fit.noise);
    fit.sigma_column_px *= worse;
    fit.sigma_row_px *= worse;
    return fit;
  }
  return std::nullopt;
}

}  // namespace trammel::part_alignment
