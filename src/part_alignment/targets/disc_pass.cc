#include "part_alignment/targets/disc_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "part_alignment/targets/disc_products.h"
#include "part_alignment/targets/four.h"
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

constexpr int kFirstFlat = 6;  ///< contrast, the first that pixels away from the edge tell of

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

/// Of the model and its limits, each in all lanes.
template <typename Floats>
struct Constants {
  Floats wxx, wxy, wyy;
  Floats outer, inner, band_px;
  Floats per_blur, contrast, background;
  Floats gradient_x, gradient_y;
};

/// What one pass over the pixels needs of the model.
class Pass {
 public:
  Pass(const PageView& picture, const DiscModel& model, const RingShade& ring)
      : picture_(picture), m_(model) {
    const double radius_px = MeanRadius(model);
    const double band_px = kReach * m_.blur_px + kMargin_px;
    // Short of where the ring's blurred edge would have to be known well.
    const double limit =
        std::clamp(kRingInner - 2 * m_.blur_px / radius_px, kLeastOuterLimit, kOuterLimit);
    outer_ = std::min(limit, 1 + band_px / radius_px * 1.5);
    inner_ = std::max(0.0, 1 - band_px / radius_px * 1.5);
    const double steepest = 0.5 * (m_.wxx + m_.wyy) + std::hypot(0.5 * (m_.wxx - m_.wyy), m_.wxy);
    SetConstants(band_px, four_);
#ifdef __x86_64__
    if (TakesAvx2()) SetConstants(band_px, eight_);
#endif
    if (kRingInner - outer_ < kRingReach * m_.blur_px * steepest &&
        std::any_of(ring.cover.begin(), ring.cover.end(), [](float c) { return c > 0; })) {
      ring_.emplace(ring, m_.blur_px / (kRingInner * radius_px));
    }
  }

  /// Instead of the normal equations.
  void RunBySectors(SectorSums& sums) {
    by_sectors_ = true;
    constexpr int kEveryRow = 1;  // fewer would show uneven light less than the centre feels it
    (void)Run(kEveryRow);
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const FourSectors& of = four_sectors_[i];
      for (int lane = 0; lane < 4; ++lane) {
        sums[i].edge += of.edge[lane];
        sums[i].edge2 += of.edge2[lane];
        sums[i].inside += of.inside[lane];
        sums[i].outside += of.outside[lane];
        sums[i].inside_count += of.inside_count[lane];
        sums[i].outside_count += of.outside_count[lane];
      }
    }
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
    DiscNormal normal;
    edge_.AddTo(normal);
    flat_.AddTo(normal);
    for (int lane = 0; lane < 4; ++lane) {
      normal.samples += samples_[lane];
      normal.saturated += saturated_[lane];
    }
    return normal;
  }

 private:
  static int Within(double place, int end) {
    return static_cast<int>(std::clamp(place, 0.0, static_cast<double>(end)));
  }

  template <typename Floats>
  [[gnu::always_inline]] inline void SetConstants(double band_px, Constants<Floats>& of) const {
    const auto set = [](Floats & all, double value) __attribute__((always_inline)) {
      for (std::size_t i = 0; i < sizeof(all) / sizeof(float); ++i) {
        all[i] = static_cast<float>(value);
      }
    };
    set(of.wxx, m_.wxx);
    set(of.wxy, m_.wxy);
    set(of.wyy, m_.wyy);
    set(of.outer, outer_);
    set(of.inner, inner_);
    set(of.band_px, band_px);
    set(of.per_blur, 1 / m_.blur_px);
    set(of.contrast, m_.contrast);
    set(of.background, m_.background);
    set(of.gradient_x, m_.gradient_x);
    set(of.gradient_y, m_.gradient_y);
  }

  void AddSpan(int y, int x0, int x1) {
#ifdef __x86_64__
    if (TakesAvx2()) return AddSpanByAvx2(y, x0, x1);
#endif
    AddFours(y, x0, x1);
  }

  /// Four neighbouring pixels of a row.
  struct Neighbours {
    Four grey;
    Four dx;
    FourInts wanted;
  };
  [[nodiscard, gnu::always_inline]] inline Neighbours From(const std::uint8_t* row, int x,
                                                           int end) const {
    const FourInts lane = {0, 1, 2, 3};
    const int first = std::min(x, picture_.width - 4);  // reads nothing beyond the row
    const auto dx = static_cast<float>(first - m_.column_px);
    return {FourPixels(row + first), dx + Four{0, 1, 2, 3},
            (lane >= x - first) & (lane < end - first)};
  }

  /// Columns x0 … x1 - 1.
  void AddFours(int y, int x0, int x1) {
    const std::uint8_t* row = picture_.row(y);
    const auto dy = static_cast<float>(y - m_.row_px);
    for (int x = x0; x < x1; x += 4) {
      const Neighbours of = From(row, x, x1);
      Add(four_, of.grey, of.dx, dy, of.wanted);
    }
  }

#ifdef __x86_64__
  /// The same to the bit.
  [[gnu::target("avx2")]] void AddSpanByAvx2(int y, int x0, int x1) {
    const std::uint8_t* row = picture_.row(y);
    const auto dy = static_cast<float>(y - m_.row_px);
    for (int x = x0; x < x1; x += 8) {
      const Neighbours a = From(row, x, x1);
      if (x + 4 >= x1) {
        Add(four_, a.grey, a.dx, dy, a.wanted);
        break;
      }
      const Neighbours b = From(row, x + 4, x1);
      const Eight grey = __builtin_shufflevector(a.grey, b.grey, 0, 1, 2, 3, 4, 5, 6, 7);
      const Eight dx = __builtin_shufflevector(a.dx, b.dx, 0, 1, 2, 3, 4, 5, 6, 7);
      const EightInts wanted = __builtin_shufflevector(a.wanted, b.wanted, 0, 1, 2, 3, 4, 5, 6, 7);
      Add(eight_, grey, dx, dy, wanted);
    }
  }
#endif

  template <typename Floats>
  [[gnu::always_inline]] inline void Add(const Constants<Floats>& c, const Floats& grey,
                                         const Floats& dx, float dy,
                                         const Mask<Floats>& asked_for) {
    constexpr int kParts = static_cast<int>(sizeof(Floats) / sizeof(float)) / 4;
    const Floats u = c.wxx * dx + c.wxy * dy;
    const Floats v = c.wxy * dx + c.wyy * dy;
    const Floats q = Root(u * u + v * v);
    // Distance from the edge to first order: (|W d| - 1) / |its gradient W² d / |W d||.
    const Floats px = c.wxx * u + c.wxy * v;
    const Floats py = c.wxy * u + c.wyy * v;
    const Floats by_steep = 1 / Most(Root(px * px + py * py), All<Floats>(1e-12F));
    const Floats distance = (q - 1) * q * by_steep;
    // In the middle itself first order tells nothing.
    Mask<Floats> wanted = asked_for & (q <= c.outer) & (q >= c.inner) & (q > 1e-4F);
    wanted &= Magnitude(distance) <= c.band_px;
    if (!Any(wanted)) return;
    const Floats t = -distance * c.per_blur;
    const Mask<Floats> near = wanted & (Magnitude(t) <= static_cast<float>(kReach));
    Floats density{};
    Floats cover = Where(t > 0, All<Floats>(1));
    if (kParts > 1 || Any(near)) {
      const Floats bounded = Bounded(t);
      density = Where(near, NormalDensity(bounded));
      cover = NormalIntegral(bounded, density);
    }
    if (ring_) {
      const Floats blurs = (q - static_cast<float>(kRingInner)) * q * by_steep * c.per_blur;
      AddRing(u, v, blurs, wanted, cover);
    }
    const Floats gain = 1 + c.gradient_x * dx + c.gradient_y * dy;
    const Floats shade = c.background + c.contrast * cover;
    const Floats value = gain * shade;
    // What the sensor cut off tells only that it was beyond.
    const Mask<Floats> white = wanted & (grey >= kSaturated);
    const Mask<Floats> black = wanted & (grey <= kBlack);
    for (int i = 0; i < kParts; ++i) {
      samples_ -= FourOf(wanted, i);
      saturated_ -= FourOf(white | black, i);
    }
    const Mask<Floats> counts = wanted & ~((white & (value >= grey)) | (black & (value <= grey)));
    if (by_sectors_) {
      const Floats by_shift = density * gain * c.contrast * c.per_blur;
      for (int i = 0; i < kParts; ++i) {
        AddToSectors(FourOf(u, i), FourOf(v, i), FourOf(counts, i),
                     {FourOf(cover, i), FourOf(by_shift, i), FourOf(grey - value, i)});
      }
      return;
    }
    // d value / d(-distance)
    const Floats slope = density * (gain * c.contrast * c.per_blur);
    const Floats by_shape = -slope * by_steep;
    for (int i = 0; i < kParts; ++i) {
      if (!Any(FourOf(wanted, i))) continue;
      const bool flat = !Any(FourOf(near, i));
      Four* j = flat ? flat_.Next() : edge_.Next();
      j[6] = FourOf(Where(counts, gain * cover), i);
      j[7] = FourOf(Where(counts, gain), i);
      j[8] = FourOf(Where(counts, shade * dx), i);
      j[9] = FourOf(Where(counts, shade * dy), i);
      j[10] = FourOf(Where(counts, grey - value), i);
      if (flat) continue;
      j[0] = FourOf(Where(near & counts, slope * px * by_steep - shade * c.gradient_x), i);
      j[1] = FourOf(Where(near & counts, slope * py * by_steep - shade * c.gradient_y), i);
      j[2] = FourOf(Where(counts, by_shape * u * dx), i);
      j[3] = FourOf(Where(counts, by_shape * (u * dy + v * dx)), i);
      j[4] = FourOf(Where(counts, by_shape * v * dy), i);
      j[5] = FourOf(Where(counts, -slope * t), i);
    }
  }

  struct SectorValues {
    Four cover, by_shift, residual;
  };

  /// A SectorSum by lanes.
  struct FourSectors {
    Four edge{}, edge2{}, inside{}, outside{};
    FourInts inside_count{}, outside_count{};
  };

  /// Four neighbours count where the first of them lies: any partition that knows nothing of the
  /// residuals does.
  void AddToSectors(Four u, Four v, FourInts wanted, const SectorValues& of) {
    constexpr float kIn = 0.95F;
    constexpr float kOut = 0.05F;
    const bool steep = std::abs(v[0]) > std::abs(u[0]);
    FourSectors& sum =
        four_sectors_[(u[0] > 0 ? 1U : 0U) + (v[0] > 0 ? 2U : 0U) + (steep ? 4U : 0U)];
    const Four by_shift = Where(wanted, of.by_shift);
    sum.edge += by_shift * of.residual;
    sum.edge2 += by_shift * by_shift;
    const FourInts inside = wanted & (of.cover > kIn);
    const FourInts outside = wanted & (of.cover < kOut);
    sum.inside += Where(inside, of.residual);
    sum.outside += Where(outside, of.residual);
    sum.inside_count -= inside;
    sum.outside_count -= outside;
  }

  /// Where nothing changes any more.
  template <typename Floats>
  [[gnu::always_inline]] static inline Floats Bounded(Floats t) {
    return Most(Least(t, All<Floats>(6)), All<Floats>(-6));
  }

  /// @param blurs  beyond the ring's inner edge.
  template <typename Floats>
  [[gnu::always_inline]] inline void AddRing(Floats u, Floats v, Floats blurs, Mask<Floats> wanted,
                                             Floats& cover) const {
    const Mask<Floats> near = wanted & (blurs > static_cast<float>(-kRingReach));
    if (!Any(near)) return;
    Floats ink{};
    for (std::size_t lane = 0; lane < sizeof(Floats) / sizeof(float); ++lane) {
      if (near[lane] != 0) ink[lane] = ring_->At(std::atan2(v[lane], u[lane]));
    }
    const Floats bounded = Bounded(blurs);
    cover += Where(near, NormalIntegral(bounded, NormalDensity(bounded)) * ink);
  }

  const PageView& picture_;
  const DiscModel& m_;
  Constants<Four> four_;
#ifdef __x86_64__
  Constants<Eight> eight_;
#endif
  double outer_ = 0;
  double inner_ = 0;
  std::optional<SoftRing> ring_;
  bool by_sectors_ = false;
  std::array<FourSectors, 8> four_sectors_{};
  Products<0> edge_;
  Products<kFirstFlat> flat_;
  FourInts samples_{};
  FourInts saturated_{};
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
