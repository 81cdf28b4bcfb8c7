#include "part_alignment/targets/disc_pass.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "part_alignment/targets/target_layout.h"

namespace trammel::part_alignment {
namespace {

constexpr float kSaturated = 254.5F;  ///< 8-bit white holds anything from here on
constexpr float kBlack = 0.5F;
constexpr double kReach = 3.5;       ///< the edge is over, in blurs
constexpr double kMargin_px = 1.5;   ///< flat pixels beyond it, on either side
constexpr double kOuterLimit = 1.8;  ///< radii: short of the ring
constexpr double kLeastOuterLimit = 1.4;
constexpr double kRingReach = 3;  ///< blurs before the ring from where on it is part of the model

/// Pixels that are looked at together: Eigen takes as many of them at a time as the processor does.
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

/// The ring's cover, softened along the ring as the blur does.
class SoftRing {
 public:
  SoftRing(const RingShade& ring, double blur_rad) {
    constexpr double kStep = 2 * std::numbers::pi / RingShade::kAngles;
    constexpr int kMostReach = 40;
    const int reach = std::min(static_cast<int>(std::ceil(3 * blur_rad / kStep)), kMostReach);
    std::array<float, RingShade::kAngles + 2 * kMostReach> around;
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
    // Counted from a turn before, so that conversion cuts off downwards.
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

/// What one pass over the pixels needs of the model.
class Pass {
 public:
  Pass(const PageView& picture, const DiscModel& model, const RingShade& ring)
      : picture_(picture), m_(model) {
    const double radius_px = MeanRadius(model);
    const double band_px = kReach * m_.blur_px + kMargin_px;
    band_px_ = static_cast<float>(band_px);
    // Short of where the ring's blurred edge would have to be known well.
    const double limit =
        std::clamp(kRingInner - 2 * m_.blur_px / radius_px, kLeastOuterLimit, kOuterLimit);
    outer_ = std::min(limit, 1 + band_px / radius_px * 1.5);
    inner_ = std::max(0.0, 1 - band_px / radius_px * 1.5);
    const double steepest = 0.5 * (m_.wxx + m_.wyy) + std::hypot(0.5 * (m_.wxx - m_.wyy), m_.wxy);
    if (kRingInner - outer_ < kRingReach * m_.blur_px * steepest &&
        std::any_of(ring.cover.begin(), ring.cover.end(), [](float c) { return c > 0; })) {
      ring_.emplace(ring, m_.blur_px / (kRingInner * radius_px));
    }
  }

  /// Instead of the normal equations.
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

  /// Columns x0 … x1 - 1.
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

  /// What the pixels tell, and begins anew.
  void AddPixels() {
    const auto wxx = static_cast<float>(m_.wxx);
    const auto wxy = static_cast<float>(m_.wxy);
    const auto wyy = static_cast<float>(m_.wyy);
    const auto per_blur = static_cast<float>(1 / m_.blur_px);
    const auto contrast = static_cast<float>(m_.contrast);
    const auto gradient_x = static_cast<float>(m_.gradient_x);
    const auto gradient_y = static_cast<float>(m_.gradient_y);
    // The last ones may be fewer: the others stand far outside.
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
    // In the middle itself first order tells nothing.
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
    // What the sensor cut off tells only that it was beyond.
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
  /// Of products of what pixels tell of each parameter, and of the residual; lower triangle.
  Eigen::Matrix<double, kDiscParameters + 1, kDiscParameters + 1> sums_ =
      Eigen::Matrix<double, kDiscParameters + 1, kDiscParameters + 1>::Zero();
  DiscNormal normal_;
};

}  // namespace

SectorSums SumBySectors(const PageView& picture, const DiscModel& model, const RingShade& ring) {
  SectorSums sums{};
  Pass(picture, model, ring).RunBySectors(sums);
  return sums;
}

DiscNormal SumOverPixels(const PageView& picture, const DiscModel& model, const RingShade& ring,
                         int every) {
  return Pass(picture, model, ring).Run(every);
}

}  // namespace trammel::part_alignment
