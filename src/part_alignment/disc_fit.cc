#include "part_alignment/disc_fit.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "part_alignment/target_layout.h"

namespace trammel::part_alignment {
namespace {

constexpr int kParameters = 10;
constexpr int kMaxIterations = 20;
constexpr double kSettledCut_px = 0.001;  ///< where the set of saturated pixels still changes
constexpr double kSettled_px = 0.01;      ///< a step's own error is of second order: 1e-4 px
constexpr double kSaturated = 254.5;      ///< 8-bit white holds anything from here on
constexpr double kBlack = 0.5;
constexpr double kRoundingNoise = 0.2887;  ///< 1 / sqrt(12)
constexpr double kReach = 3.5;             ///< the edge is over, in blurs
constexpr double kMargin_px = 1.5;         ///< flat pixels beyond it, on either side
constexpr double kOuterLimit = 1.8;        ///< radii: short of the ring
constexpr double kLeastOuterLimit = 1.4;

using Vector = std::array<double, kParameters>;
using Matrix = std::array<Vector, kParameters>;

double Density(double t) { return 0.3989422804014327 * std::exp(-0.5 * t * t); }

/// The normal distribution's integral from its density, to 7.5e-8 (Abramowitz & Stegun 26.2.17).
double Phi(double t, double density) {
  const double k = 1 / (1 + 0.2316419 * std::abs(t));
  const double tail =
      density * k *
      (0.319381530 + k * (-0.356563782 + k * (1.781477937 + k * (-1.821255978 + k * 1.330274429))));
  return t > 0 ? 1 - tail : tail;
}

/// The system J^T J x = J^T r, lower triangle.
struct Normal {
  Matrix jtj{};
  Vector jtr{};
  double rss = 0;
  int samples = 0;
  int saturated = 0;
};

/// In place: jtj becomes its Cholesky factor. False where it is not positive definite.
bool Factor(Matrix& a) {
  for (int i = 0; i < kParameters; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (int k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      if (i == j) {
        if (!(sum > 1e-12 * a[i][i]) || !std::isfinite(sum)) return false;
        a[i][i] = std::sqrt(sum);
      } else {
        a[i][j] = sum / a[j][j];
      }
    }
  }
  return true;
}

Vector Solve(const Matrix& factor, Vector b) {
  for (int i = 0; i < kParameters; ++i) {
    for (int k = 0; k < i; ++k) b[i] -= factor[i][k] * b[k];
    b[i] /= factor[i][i];
  }
  for (int i = kParameters - 1; i >= 0; --i) {
    for (int k = i + 1; k < kParameters; ++k) b[i] -= factor[k][i] * b[k];
    b[i] /= factor[i][i];
  }
  return b;
}

/// The ring's cover, softened along the ring as the blur does.
class SoftRing {
 public:
  SoftRing(const RingShade& ring, double blur_rad) {
    constexpr double kStep = 2 * std::numbers::pi / RingShade::kAngles;
    present_ = std::any_of(ring.cover.begin(), ring.cover.end(), [](float c) { return c > 0; });
    if (!present_) return;
    const int reach = std::min(static_cast<int>(std::ceil(3 * blur_rad / kStep)), 40);
    std::array<double, 41> weight{};
    double total = 0;
    for (int i = 0; i <= reach; ++i) {
      weight[i] = Density(i * kStep / blur_rad);
      total += i == 0 ? weight[i] : 2 * weight[i];
    }
    for (int k = 0; k < RingShade::kAngles; ++k) {
      double sum = 0;
      for (int i = -reach; i <= reach; ++i) {
        sum += weight[std::abs(i)] * ring.cover[(k + i) & (RingShade::kAngles - 1)];
      }
      cover_[k] = sum / total;
    }
  }
  [[nodiscard]] bool present() const { return present_; }
  [[nodiscard]] double At(double angle_rad) const {
    const double place = angle_rad * (RingShade::kAngles / (2 * std::numbers::pi));
    const double below = std::floor(place);
    const int i = static_cast<int>(below) & (RingShade::kAngles - 1);
    const double share = place - below;
    return cover_[i] * (1 - share) + cover_[(i + 1) & (RingShade::kAngles - 1)] * share;
  }

 private:
  bool present_ = false;
  std::array<double, RingShade::kAngles> cover_{};
};

/// Four floats at a time: SSE and its kin. Sums in float are right to some 1e-5, and a step's error
/// is that much of a step.
typedef float Four __attribute__((vector_size(16)));
struct Derivatives {
  alignas(16) float value[12];  ///< the residual follows the parameters
  [[nodiscard]] Four four(int i) const {
    Four values;
    std::memcpy(&values, value + 4 * i, sizeof(values));
    return values;
  }
};

/// What one pass over the pixels needs of the model.
class Pass {
 public:
  Pass(const PageView& picture, const DiscModel& model, const RingShade& ring)
      : picture_(picture),
        m_(model),
        radius_px_(MeanRadius(model)),
        ring_(ring, model.blur_px / (kRingInner * radius_px_)) {
    band_px_ = kReach * m_.blur_px + kMargin_px;
  }

  /// @param every  looks at one row in so many.
  Normal Run(int every) {
    // Half sides of the box about |W d| <= outer: from the inverse of W.
    const double outer = std::min(OuterLimit(), 1 + band_px_ / radius_px_ * 1.5);
    const double det = m_.wxx * m_.wyy - m_.wxy * m_.wxy;
    const double half_x = outer * std::hypot(m_.wyy, m_.wxy) / det;
    const double half_y = outer * std::hypot(m_.wxx, m_.wxy) / det;
    const int x0 = std::max(0, static_cast<int>(std::ceil(m_.column_px - half_x)));
    const int x1 = std::min(picture_.width - 1, static_cast<int>(m_.column_px + half_x));
    const int y0 = std::max(0, static_cast<int>(std::ceil(m_.row_px - half_y)));
    const int y1 = std::min(picture_.height - 1, static_cast<int>(m_.row_px + half_y));
    const double inner = std::max(0.0, 1 - band_px_ / radius_px_ * 1.5);
    for (int y = y0; y <= y1; y += every) {
      const std::uint8_t* row = picture_.row(y);
      const double dy = y - m_.row_px;
      for (int x = x0; x <= x1; ++x) {
        const double dx = x - m_.column_px;
        const double u = m_.wxx * dx + m_.wxy * dy;
        const double v = m_.wxy * dx + m_.wyy * dy;
        const double q2 = u * u + v * v;
        if (q2 > outer * outer || q2 < inner * inner) continue;
        Add(row[x], dx, dy, u, v, std::sqrt(q2));
      }
    }
    return Total();
  }

 private:
  /// Short of where the ring's blurred edge would have to be known well, in radii.
  [[nodiscard]] double OuterLimit() const {
    return std::clamp(kRingInner - 2 * m_.blur_px / radius_px_, kLeastOuterLimit, kOuterLimit);
  }

  void Add(double grey, double dx, double dy, double u, double v, double q) {
    // Distance from the edge to first order: (|W d| - 1) / |its gradient|.
    const double safe = std::max(q, 0.05);
    const double nx = (m_.wxx * u + m_.wxy * v) / safe;
    const double ny = (m_.wxy * u + m_.wyy * v) / safe;
    const double steep = std::max(std::sqrt(nx * nx + ny * ny), 1e-9);
    const double distance = (q - 1) / steep;
    if (std::abs(distance) > band_px_) return;
    const double t = -distance / m_.blur_px;
    const bool flat = std::abs(t) > kReach;
    const double normal_density = flat ? 0 : Density(t);
    double cover = flat ? (t > 0 ? 1.0 : 0.0) : Phi(t, normal_density);
    if (ring_.present()) {
      const double to_ring = (q - kRingInner) / steep / m_.blur_px;
      if (to_ring > -3) cover += Phi(to_ring, Density(to_ring)) * ring_.At(std::atan2(v, u));
    }
    const double gain = 1 + m_.gradient_x * dx + m_.gradient_y * dy;
    const double shade = m_.background + m_.contrast * cover;
    const double value = gain * shade;
    ++counts_.samples;
    // What the sensor cut off tells only that it was beyond.
    if (grey >= kSaturated || grey <= kBlack) {
      ++counts_.saturated;
      if ((grey >= kSaturated && value >= grey) || (grey <= kBlack && value <= grey)) return;
    }
    // d value / d(-distance)
    const double density = gain * m_.contrast * normal_density / m_.blur_px;
    const double by_shape = -density / (steep * safe);
    const auto f = [](double x) { return static_cast<float>(x); };
    Derivatives j{};
    j.value[0] = f(density * nx / steep - shade * m_.gradient_x);
    j.value[1] = f(density * ny / steep - shade * m_.gradient_y);
    j.value[2] = f(by_shape * u * dx);
    j.value[3] = f(by_shape * (u * dy + v * dx));
    j.value[4] = f(by_shape * v * dy);
    j.value[5] = f(-density * t);
    j.value[6] = f(gain * cover);
    j.value[7] = f(gain);
    j.value[8] = f(shade * dx);
    j.value[9] = f(shade * dy);
    Accumulate(j, grey - value, flat);
  }

  void Accumulate(Derivatives& j, double residual, bool flat) {
    rss_ += residual * residual;
    j.value[kParameters] = static_cast<float>(residual);
    const Four j0 = j.four(0);
    const Four j1 = j.four(1);
    const Four j2 = j.four(2);
    if (!flat) {
      for (int a = 0; a < 6; ++a) {
        const float ja = j.value[a];
        sums_[a][0] += ja * j0;
        sums_[a][1] += ja * j1;
        sums_[a][2] += ja * j2;
      }
    }
    for (int a = 6; a < kParameters; ++a) {
      const float ja = j.value[a];
      sums_[a][1] += ja * j1;
      sums_[a][2] += ja * j2;
    }
  }

  /// The lower triangle from the rows' right parts.
  [[nodiscard]] Normal Total() const {
    Normal normal = counts_;
    normal.rss = rss_;
    for (int a = 0; a < kParameters; ++a) {
      normal.jtr[a] = sums_[a][kParameters / 4][kParameters % 4];
      for (int b = a; b < kParameters; ++b) normal.jtj[b][a] = sums_[a][b / 4][b % 4];
    }
    return normal;
  }

  const PageView& picture_;
  const DiscModel& m_;
  double radius_px_;
  SoftRing ring_;
  double band_px_ = 0;
  Normal counts_;
  double rss_ = 0;
  Four sums_[kParameters][3] = {};
};

/// A step, kept within what a start right to a pixel can need.
void Step(const Vector& d, DiscModel& m) {
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
/// gradient and that with a free one; a quarter of the difference stays for the gradient that is
/// there but lost in noise.
void ShrinkGradient(const std::array<Vector, kParameters>& covariance, DiscFit& fit) {
  constexpr double kNoiseChi2 = 3;  ///< of two parameters: below it in 78 % of pictures without one
  constexpr double kLeastShare = 0.25;
  DiscModel& m = fit.model;
  const double a = covariance[8][8];
  const double b = covariance[8][9];
  const double c = covariance[9][9];
  const double det = a * c - b * b;
  double back = 0;
  std::array<double, 2> by_gradient{};  // variance that the gradient brings, in units of noise²
  if (det > 0) {
    const double px = (c * m.gradient_x - b * m.gradient_y) / det;
    const double py = (a * m.gradient_y - b * m.gradient_x) / det;
    const double chi2 = (px * m.gradient_x + py * m.gradient_y) / (fit.noise * fit.noise);
    back = std::min(1.0, kNoiseChi2 / std::max(chi2, 1e-12));
    m.column_px -= back * (covariance[0][8] * px + covariance[0][9] * py);
    m.row_px -= back * (covariance[1][8] * px + covariance[1][9] * py);
    m.gradient_x *= 1 - back;
    m.gradient_y *= 1 - back;
    for (std::size_t i = 0; i < 2; ++i) {
      const double x = covariance[i][8];
      const double y = covariance[i][9];
      by_gradient[i] = (c * x * x - 2 * b * x * y + a * y * y) / det;
    }
  }
  const double taken = 1 - std::max(kLeastShare, (1 - back) * (1 - back));
  fit.sigma_column_px = fit.noise * std::sqrt(covariance[0][0] - taken * by_gradient[0]);
  fit.sigma_row_px = fit.noise * std::sqrt(covariance[1][1] - taken * by_gradient[1]);
}

/// Noise and sigmas. REQUIRES normal.jtj factored.
void Finish(const Normal& normal, DiscFit& fit) {
  fit.samples = normal.samples;
  fit.saturated = normal.saturated;
  const int spare = normal.samples - normal.saturated - kParameters;
  fit.noise = std::max(kRoundingNoise, std::sqrt(normal.rss / spare));
  std::array<Vector, kParameters> covariance{};
  for (const int i : {0, 1, 8, 9}) {
    Vector unit{};
    unit[i] = 1;
    covariance[i] = Solve(normal.jtj, unit);
  }
  ShrinkGradient(covariance, fit);
}

}  // namespace

double MeanRadius(const DiscModel& model) {
  return 1 / std::sqrt(std::max(model.wxx * model.wyy - model.wxy * model.wxy, 1e-12));
}

std::optional<DiscFit> FitDisc(const PageView& picture, const DiscModel& start,
                               const RingShade& ring) {
  constexpr int kLeastSamples = 3 * kParameters;
  constexpr double kLarge_px = 10;  ///< from here on half of the rows make a first step good enough
  constexpr double kWorse = 1.05;   ///< the band moves with the edge, so a little more is no loss
  DiscFit fit;
  fit.model = start;
  DiscModel best = start;
  double best_mean = std::numeric_limits<double>::infinity();
  double damping = 1e-4;
  Normal kept;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const int every = iteration == 0 && MeanRadius(start) > kLarge_px ? 2 : 1;
    const Normal normal = Pass(picture, fit.model, ring).Run(every);
    if (normal.samples - normal.saturated < kLeastSamples) return std::nullopt;
    const double mean = normal.rss / (normal.samples - normal.saturated);
    if (mean < kWorse * best_mean) {
      best = fit.model;
      best_mean = mean;
      kept = normal;
      damping *= 0.1;
    } else {
      damping = std::max(1e-2, damping * 30);
    }
    Matrix damped = kept.jtj;
    for (int i = 0; i < kParameters; ++i) damped[i][i] *= 1 + damping;
    if (!Factor(damped)) return std::nullopt;
    fit.model = best;
    Step(Solve(damped, kept.jtr), fit.model);
    const DiscModel& m = fit.model;
    if (!(m.wxx > 0 && m.wxx * m.wyy > m.wxy * m.wxy)) return std::nullopt;
    if (std::hypot(m.column_px - start.column_px, m.row_px - start.row_px) >
        0.5 * MeanRadius(start)) {
      return std::nullopt;
    }
    const double moved = std::hypot(m.column_px - best.column_px, m.row_px - best.row_px);
    if (moved > (kept.saturated > 0 ? kSettledCut_px : kSettled_px) || iteration == 0) continue;
    if (!Factor(kept.jtj)) return std::nullopt;
    Finish(kept, fit);
    return fit;
  }
  return std::nullopt;
}

}  // namespace trammel::part_alignment
