#include "part_alignment/targets/disc_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "base/page.h"
#include "part_alignment/targets/target.h"

namespace trammel::part_alignment {
namespace {

template <int kSize>
using SmallMatrix = Eigen::Matrix<double, kSize, kSize>;
template <int kSize>
using SmallVector = Eigen::Matrix<double, kSize, 1>;

/// Factors a matrix by its lower triangle. Absent if it is not positive definite.
template <int kSize>
[[nodiscard]] std::optional<Eigen::LLT<SmallMatrix<kSize>>> Factored(
    const SmallMatrix<kSize>& matrix) {
  constexpr double kSingular = 1e-12;  // pivot over its original value
  if (!matrix.template triangularView<Eigen::Lower>().toDenseMatrix().allFinite()) {
    return std::nullopt;
  }
  std::optional<Eigen::LLT<SmallMatrix<kSize>>> factor(matrix);
  if (factor->info() != Eigen::Success) return std::nullopt;
  const auto pivots = factor->matrixLLT().diagonal().array().square();
  if (!(pivots > kSingular * matrix.diagonal().array()).all()) return std::nullopt;
  return factor;
}

/// Number of parameters of DiscModel, in its order: c, W, blur, contrast, background, gradient.
constexpr int kDiscParameters = 10;
using DiscVector = SmallVector<kDiscParameters>;
using DiscMatrix = SmallMatrix<kDiscParameters>;
using DiscFactor = Eigen::LLT<DiscMatrix>;

/// Lower triangle of the system J^T J x = J^T r; sums of floats, right to some 1e-5.
struct DiscNormal {
  DiscMatrix jtj = DiscMatrix::Zero();
  DiscVector jtr = DiscVector::Zero();
  double rss = 0;
  int samples = 0;
  int saturated = 0;
};

/// Sums of residuals about an eighth of the edge, in three patterns that uneven light causes.
struct SectorSum {
  double edge = 0;  ///< residual times what the edge's shift by 1 px would change
  double edge2 = 0;
  double inside = 0;
  double outside = 0;
  int inside_count = 0;
  int outside_count = 0;
};
using SectorSums = std::array<SectorSum, 8>;

constexpr float kSaturated = 254.5F;  ///< 8-bit white holds anything from here on
constexpr float kBlack = 0.5F;
constexpr double kReach = 3.5;       ///< the edge is over, in blurs
constexpr double kMargin_px = 1.5;   ///< flat pixels beyond it, on either side
constexpr double kOuterLimit = 1.8;  ///< radii: short of the ring
constexpr double kMinOuterLimit = 1.4;
constexpr double kRingReach = 3;  ///< blurs before the ring from where on it is part of the model

/// Number of pixels processed together: Eigen vectorises them as the processor allows.
constexpr int kTogether = 64;
using Floats = Eigen::Array<float, kTogether, 1>;
using Flags = Eigen::Array<bool, kTogether, 1>;

/// The normal distribution's integral from its density, to 2e-7 (Abramowitz & Stegun 26.2.17).
Floats NormalIntegral(const Floats& t, const Floats& density) {
  const Floats k = (1 + 0.2316419F * t.abs()).inverse();
  const Floats tail =
      density * k *
      (0.31938153F +
       k * (-0.356563782F + k * (1.781477937F + k * (-1.821255978F + k * 1.330274429F))));
  return (t > 0).select(1 - tail, tail);
}
Floats NormalDensity(const Floats& t) { return 0.39894228F * (-0.5F * t * t).exp(); }

/// Coverage of the ring, softened along the ring as by the blur.
class SoftRing {
 public:
  SoftRing(const RingShade& ring, double blur_rad) {
    constexpr double kStep = 2 * std::numbers::pi / RingShade::kAngles;
    constexpr int kMaxReach = 40;
    const int reach = std::min(static_cast<int>(std::ceil(3 * blur_rad / kStep)), kMaxReach);
    std::array<float, RingShade::kAngles + 2 * kMaxReach> around;
    for (int i = 0; i < RingShade::kAngles + 2 * reach; ++i) {
      around[i] = ring.cover[(i - reach) & (RingShade::kAngles - 1)];
    }
    float total = 0;
    for (int i = -reach; i <= reach; ++i) {
      const double t = i * kStep / blur_rad;
      const auto weight = static_cast<float>(std::exp(-0.5 * t * t));
      total += weight;
      for (int k = 0; k < RingShade::kAngles; ++k) cover_[k] += weight * around[k + i + reach];
    }
    for (float& cover : cover_) cover /= total;
  }
  [[nodiscard]] float At(float angle_rad) const {
    // Offset by a turn, so that conversion rounds down.
    const float place =
        angle_rad * static_cast<float>(RingShade::kAngles / (2 * std::numbers::pi)) +
        RingShade::kAngles;
    const int below = static_cast<int>(place);
    const int i = below & (RingShade::kAngles - 1);
    const float share = place - static_cast<float>(below);
    return cover_[i] * (1 - share) + cover_[(i + 1) & (RingShade::kAngles - 1)] * share;
  }

 private:
  std::array<float, RingShade::kAngles> cover_{};
};

/// State of one pass over the pixels of a model.
class Pass {
 public:
  Pass(const PageView& picture, const DiscModel& model, const RingShade& ring)
      : picture_(picture), m_(model) {
    const double radius_px = MeanRadius(model);
    const double band_px = kReach * m_.blur_px + kMargin_px;
    band_px_ = static_cast<float>(band_px);
    // Ends before the ring's blurred edge, which would have to be known well.
    const double limit =
        std::clamp(kRingInner - 2 * m_.blur_px / radius_px, kMinOuterLimit, kOuterLimit);
    outer_ = std::min(limit, 1 + band_px / radius_px * 1.5);
    inner_ = std::max(0.0, 1 - band_px / radius_px * 1.5);
    const double steepest = 0.5 * (m_.wxx + m_.wyy) + std::hypot(0.5 * (m_.wxx - m_.wyy), m_.wxy);
    if (kRingInner - outer_ < kRingReach * m_.blur_px * steepest &&
        std::any_of(ring.cover.begin(), ring.cover.end(), [](float c) { return c > 0; })) {
      ring_.emplace(ring, m_.blur_px / (kRingInner * radius_px));
    }
  }

  /// Computes sector sums instead of the normal equations.
  void RunBySectors(SectorSums& sums) {
    constexpr int kEveryRow = 1;  // fewer would show uneven light less than the centre feels it
    sectors_ = &sums;
    (void)Run(kEveryRow);
  }

  DiscNormal Run(int every) {
    // |W d| <= R along a row: a dx² + 2 b dx dy + c dy² <= R².
    const double a = m_.wxx * m_.wxx + m_.wxy * m_.wxy;
    const double b = m_.wxy * (m_.wxx + m_.wyy);
    const double det = m_.wxx * m_.wyy - m_.wxy * m_.wxy;
    const double half_y = outer_ * std::sqrt(a) / det;
    const int y0 = Within(std::ceil(m_.row_px - half_y), picture_.height);
    const int y1 = Within(std::floor(m_.row_px + half_y) + 1, picture_.height);
    for (int y = y0; y < y1; y += every) {
      const double dy = y - m_.row_px;
      const double middle = m_.column_px - b / a * dy;
      const double lost = det * det * dy * dy / (a * a);
      const double half = std::sqrt(std::max(0.0, outer_ * outer_ / a - lost));
      const double hole = std::sqrt(std::max(0.0, inner_ * inner_ / a - lost));
      const int x0 = Within(std::ceil(middle - half), picture_.width);
      const int x1 = Within(std::floor(middle + half) + 1, picture_.width);
      const int hole0 = std::max(x0, Within(std::floor(middle - hole) + 1, picture_.width));
      const int hole1 = std::min(x1, Within(std::ceil(middle + hole), picture_.width));
      if (hole1 - hole0 > 4) {
        AddSpan(y, x0, hole0);
        AddSpan(y, hole1, x1);
      } else {
        AddSpan(y, x0, x1);
      }
    }
    if (count_ > 0) AddPixels();
    normal_.jtj = sums_.topLeftCorner<kDiscParameters, kDiscParameters>();
    normal_.jtr = sums_.row(kDiscParameters).head<kDiscParameters>().transpose();
    normal_.rss = sums_(kDiscParameters, kDiscParameters);
    return normal_;
  }

 private:
  static int Within(double place, int end) {
    return static_cast<int>(std::clamp(place, 0.0, static_cast<double>(end)));
  }

  /// Adds columns x0 … x1 - 1.
  void AddSpan(int y, int x0, int x1) {
    const std::uint8_t* row = picture_.row(y);
    const auto dy = static_cast<float>(y - m_.row_px);
    for (int x = x0; x < x1; ++x) {
      grey_[count_] = row[x];
      dx_[count_] = static_cast<float>(x - m_.column_px);
      dy_[count_] = dy;
      if (++count_ == kTogether) AddPixels();
    }
  }

  /// Adds the collected pixels to the sums, and restarts the collection.
  void AddPixels() {
    const auto wxx = static_cast<float>(m_.wxx);
    const auto wxy = static_cast<float>(m_.wxy);
    const auto wyy = static_cast<float>(m_.wyy);
    const auto per_blur = static_cast<float>(1 / m_.blur_px);
    const auto contrast = static_cast<float>(m_.contrast);
    const auto gradient_x = static_cast<float>(m_.gradient_x);
    const auto gradient_y = static_cast<float>(m_.gradient_y);
    // The last block may have fewer pixels: the others are placed far outside.
    constexpr float kNowhere_px = 1e6F;
    dx_.tail(kTogether - count_).setConstant(kNowhere_px);
    dy_.tail(kTogether - count_).setConstant(kNowhere_px);
    grey_.tail(kTogether - count_).setZero();
    count_ = 0;
    const Floats u = wxx * dx_ + wxy * dy_;
    const Floats v = wxy * dx_ + wyy * dy_;
    const Floats q = (u * u + v * v).sqrt();
    // Distance from the edge to first order: (|W d| - 1) / |its gradient W² d / |W d||.
    const Floats px = wxx * u + wxy * v;
    const Floats py = wxy * u + wyy * v;
    const Floats by_steep = (px * px + py * py).sqrt().max(1e-12F).inverse();
    const Floats distance = (q - 1) * q * by_steep;
    // At the middle itself, the first order has no information.
    const Flags wanted = q <= static_cast<float>(outer_) && q >= static_cast<float>(inner_) &&
                         q > 1e-4F && distance.abs() <= band_px_;
    if (!wanted.any()) return;
    const Floats t = -distance * per_blur;
    const Flags near = wanted && t.abs() <= static_cast<float>(kReach);
    const Floats bounded = t.max(-kFlat).min(kFlat);
    const Floats density = near.select(NormalDensity(bounded), 0.0F);
    Floats cover = NormalIntegral(bounded, density);
    if (ring_) {
      const Floats blurs = (q - static_cast<float>(kRingInner)) * q * by_steep * per_blur;
      AddRing(u, v, blurs, wanted, cover);
    }
    const Floats gain = 1 + gradient_x * dx_ + gradient_y * dy_;
    const Floats shade = static_cast<float>(m_.background) + contrast * cover;
    const Floats value = gain * shade;
    // A saturated pixel only bounds the value.
    const Flags white = wanted && grey_ >= kSaturated;
    const Flags black = wanted && grey_ <= kBlack;
    normal_.samples += static_cast<int>(wanted.count());
    normal_.saturated += static_cast<int>((white || black).count());
    const Flags counts = wanted && !((white && value >= grey_) || (black && value <= grey_));
    // d value / d(-distance)
    const Floats slope = density * gain * contrast * per_blur;
    if (sectors_ != nullptr) {
      AddToSectors(u, v, counts, {cover, slope, grey_ - value});
      return;
    }
    const Floats by_shape = -slope * by_steep;
    const Flags edge = near && counts;
    Eigen::Array<float, kTogether, kDiscParameters + 1> j;
    j.col(0) = edge.select(slope * px * by_steep - shade * gradient_x, 0.0F);
    j.col(1) = edge.select(slope * py * by_steep - shade * gradient_y, 0.0F);
    j.col(2) = counts.select(by_shape * u * dx_, 0.0F);
    j.col(3) = counts.select(by_shape * (u * dy_ + v * dx_), 0.0F);
    j.col(4) = counts.select(by_shape * v * dy_, 0.0F);
    j.col(5) = counts.select(-slope * t, 0.0F);
    j.col(6) = counts.select(gain * cover, 0.0F);
    j.col(7) = counts.select(gain, 0.0F);
    j.col(8) = counts.select(shade * dx_, 0.0F);
    j.col(9) = counts.select(shade * dy_, 0.0F);
    j.col(10) = counts.select(grey_ - value, 0.0F);
    for (int a = 0; a <= kDiscParameters; ++a) {
      for (int b = 0; b <= a; ++b) {
        sums_(a, b) += static_cast<double>((j.col(a) * j.col(b)).sum());
      }
    }
  }

  struct SectorValues {
    Floats cover, by_shift, residual;
  };

  void AddToSectors(const Floats& u, const Floats& v, const Flags& counts, const SectorValues& of) {
    constexpr float kIn = 0.95F;
    constexpr float kOut = 0.05F;
    for (int i = 0; i < kTogether; ++i) {
      if (!counts[i]) continue;
      const bool steep = std::abs(v[i]) > std::abs(u[i]);
      SectorSum& sum = (*sectors_)[(u[i] > 0 ? 1U : 0U) + (v[i] > 0 ? 2U : 0U) + (steep ? 4U : 0U)];
      const double residual = static_cast<double>(of.residual[i]);
      const double by_shift = static_cast<double>(of.by_shift[i]);
      sum.edge += by_shift * residual;
      sum.edge2 += by_shift * by_shift;
      if (of.cover[i] > kIn) {
        sum.inside += residual;
        ++sum.inside_count;
      } else if (of.cover[i] < kOut) {
        sum.outside += residual;
        ++sum.outside_count;
      }
    }
  }

  /// @param blurs  beyond the ring's inner edge.
  void AddRing(const Floats& u, const Floats& v, const Floats& blurs, const Flags& wanted,
               Floats& cover) const {
    const Flags near = wanted && blurs > static_cast<float>(-kRingReach);
    if (!near.any()) return;
    Floats ink = Floats::Zero();
    for (int i = 0; i < kTogether; ++i) {
      if (near[i]) ink[i] = ring_->At(std::atan2(v[i], u[i]));
    }
    const Floats bounded = blurs.max(-kFlat).min(kFlat);
    cover += near.select(NormalIntegral(bounded, NormalDensity(bounded)) * ink, 0.0F);
  }

  static constexpr float kFlat = 6;  ///< blurs from the edge, where nothing changes any more

  const PageView& picture_;
  const DiscModel& m_;
  double outer_ = 0;
  double inner_ = 0;
  float band_px_ = 0;
  std::optional<SoftRing> ring_;
  SectorSums* sectors_ = nullptr;  ///< instead of the normal equations
  Floats grey_, dx_, dy_;
  int count_ = 0;
  /// Sums of products of the pixels' derivatives by parameter, and of the residual; lower triangle.
  Eigen::Matrix<double, kDiscParameters + 1, kDiscParameters + 1> sums_ =
      Eigen::Matrix<double, kDiscParameters + 1, kDiscParameters + 1>::Zero();
  DiscNormal normal_;
};

/// Sums over the pixels that SumOverPixels takes of every row, without saturated ones.
SectorSums SumBySectors(const PageView& picture, const DiscModel& model, const RingShade& ring) {
  SectorSums sums{};
  Pass(picture, model, ring).RunBySectors(sums);
  return sums;
}

/// Computes sums over the pixels within 3.5 blurs + 1.5 px of the edge, short of the ring.
/// @param picture  1 channel, at least 4 px wide.
/// @param every    uses one row in so many, >= 1.
DiscNormal SumOverPixels(const PageView& picture, const DiscModel& model, const RingShade& ring,
                         int every) {
  return Pass(picture, model, ring).Run(every);
}

constexpr int kMaxIterations = 20;
constexpr double kSettledCut_px = 0.001;   ///< the set of saturated pixels still changes
constexpr double kSettled = 0.2;           ///< a step's own error, of the centre's sigma
constexpr double kRowsOfFirst = 5;         ///< up to twice as many cross the disc in the first pass
constexpr double kRoundingNoise = 0.2887;  ///< 1 / sqrt(12)

/// Takes a step, limited to that of a start right to a pixel.
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

/// Shrinks the gradient to its significant part. Centre and gradient explain the same pixels in
/// part: a gradient that is only noise costs up to a third of the centre's precision. So the part
/// that may be noise is subtracted, and the centre follows by their covariance. Its variance is
/// then between that with a known gradient and that with a free one. A quarter of the difference
/// always remains for a real gradient lost in noise, and all of it if the subtracted part was
/// hardly noise.
void ShrinkGradient(const DiscMatrix& covariance, DiscFit& fit) {
  constexpr double kNoiseChi2 = 3;  ///< two parameters: 78 % of pictures without one are below
  constexpr double kMinShare = 0.25;
  constexpr double kCertainChi2 = 6;  ///< noise alone reaches it in 5 % of pictures
  DiscModel& m = fit.model;
  const double a = covariance(8, 8);
  const double b = covariance(8, 9);
  const double c = covariance(9, 9);
  const double det = a * c - b * b;
  double share = kMinShare;
  std::array<double, 2> by_gradient{};  // variance that the gradient brings, in units of noise²
  if (det > 0) {
    const double px = (c * m.gradient_x - b * m.gradient_y) / det;
    const double py = (a * m.gradient_y - b * m.gradient_x) / det;
    const double chi2 = (px * m.gradient_x + py * m.gradient_y) / (fit.noise * fit.noise);
    const double back = std::min(1.0, kNoiseChi2 / std::max(chi2, 1e-12));
    share = std::clamp(chi2 / kCertainChi2, kMinShare, 1.0);
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

/// Computes the centre's sigma from the factored normal equations.
double CentreSigma(const DiscFactor& factor, double mean_square) {
  const DiscMatrix inverse = factor.solve(DiscMatrix::Identity());
  return std::sqrt((inverse(0, 0) + inverse(1, 1)) * mean_square);
}

/// Returns the factor on the centre's uncertainty compared with independent pixels: a lamp's image
/// or a shadow's edge has one sign over a whole sector. 1 without evidence.
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

/// Computes noise and sigmas.
/// @param factor  of normal.jtj
/// @param step    the last, from `normal`.
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

std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale) {
  // a x² + 2 b x y + c y² + d x + e y = 1
  SmallMatrix<5> normal = SmallMatrix<5>::Zero();
  SmallVector<5> right = SmallVector<5>::Zero();
  for (const Offset& point : points) {
    const double x = point.x / scale;
    const double y = point.y / scale;
    const SmallVector<5> row(x * x, 2 * x * y, y * y, x, y);
    normal += row * row.transpose();
    right += row;
  }
  const auto factor = Factored<5>(normal);
  if (!factor) return std::nullopt;
  const SmallVector<5> conic = factor->solve(right);
  const double a = conic[0], b = conic[1], c = conic[2], d = conic[3], e = conic[4];
  const double det = a * c - b * b;
  if (!(a > 0 && det > 0)) return std::nullopt;
  const double cx = -(c * d - b * e) / (2 * det);
  const double cy = -(a * e - b * d) / (2 * det);
  const double level = 1 + a * cx * cx + 2 * b * cx * cy + c * cy * cy;
  // W is the square root of the form: (A + sqrt(det) I) / sqrt(trace + 2 sqrt(det)).
  const double root = std::sqrt(det);
  const double norm = std::sqrt((a + c + 2 * root) * level) * scale;
  DiscModel disc;
  disc.column_px = cx * scale;
  disc.row_px = cy * scale;
  disc.wxx = (a + root) / norm;
  disc.wxy = b / norm;
  disc.wyy = (c + root) / norm;
  return disc;
}

double DistanceFrom(const DiscModel& disc, std::span<const Offset> points) {
  double sum = 0;
  for (const Offset& point : points) {
    const double x = point.x - disc.column_px;
    const double y = point.y - disc.row_px;
    const double u = disc.wxx * x + disc.wxy * y;
    const double v = disc.wxy * x + disc.wyy * y;
    const double off = std::sqrt(u * u + v * v) - 1;
    sum += off * off;
  }
  return std::sqrt(sum / static_cast<double>(points.size())) * MeanRadius(disc);
}

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
  constexpr int kMinSamples = 3 * kDiscParameters;
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
    if (normal.samples - normal.saturated < kMinSamples) return std::nullopt;
    const double mean = normal.rss / (normal.samples - normal.saturated);
    // The fit of a few rows does not represent all of them.
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
