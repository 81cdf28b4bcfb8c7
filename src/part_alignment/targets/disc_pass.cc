#include "part_alignment/targets/disc_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "part_alignment/targets/four.h"
#include "part_alignment/targets/target_layout.h"

#ifdef __x86_64__
#include <immintrin.h>
#endif

namespace trammel::part_alignment {
namespace {

constexpr float kSaturated = 254.5F;  ///< 8-bit white holds anything from here on
constexpr float kBlack = 0.5F;
constexpr double kReach = 3.5;       ///< the edge is over, in blurs
constexpr double kMargin_px = 1.5;   ///< flat pixels beyond it, on either side
constexpr double kOuterLimit = 1.8;  ///< radii: short of the ring
constexpr double kLeastOuterLimit = 1.4;
constexpr double kRingReach = 3;  ///< blurs before the ring from where on it is part of the model

constexpr int kValues = kDiscParameters + 1;  ///< the residual follows the parameters
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

#ifdef __x86_64__
/// Whether the processor takes eight floats at a time.
bool TakesEight() {
  static const bool kTakes = __builtin_cpu_supports("avx") != 0;
  return kTakes;
}
#endif

/// Sums of products of values from kFirst on, a batch of pixels at a time.
template <int kFirst>
class Products {
 public:
  Products() {
    for (auto& values : batch_) values[kValues] = Four{};
  }

  /// Where the next four pixels' values go, from kFirst on.
  Four* Next() {
    if (count_ == kBatch) Flush();
    return batch_[count_++];
  }

  /// Adds to the normal equations.
  void AddTo(DiscNormal& normal) {
    for (; count_ < kBatch; ++count_) std::fill_n(batch_[count_], kValues, Four{});
    Flush();
    for (int a = kFirst; a < kDiscParameters; ++a) {
      for (int b = kFirst; b <= a; ++b) normal.jtj[a][b] += Sum(a, b);
      normal.jtr[a] += Sum(kDiscParameters, a);
    }
    normal.rss += Sum(kDiscParameters, kDiscParameters);
  }

 private:
  static constexpr int kBatch = 4;
  static constexpr int kCount = kValues - kFirst;

  [[nodiscard]] double Sum(int a, int b) const {
    const Four& sum = sums_[a - kFirst][b - kFirst];
    return (double{sum[0]} + sum[1]) + (double{sum[2]} + sum[3]);
  }

  void Flush() {
    count_ = 0;
#ifdef __x86_64__
    if (TakesEight()) return FlushByEight();
#endif
    const auto& j = batch_;
    for (int a = kFirst; a < kValues; ++a) {
      for (int b = kFirst; b <= a; ++b) {
        sums_[a - kFirst][b - kFirst] +=
            (j[0][a] * j[0][b] + j[1][a] * j[1][b]) + (j[2][a] * j[2][b] + j[3][a] * j[3][b]);
      }
    }
  }

#ifdef __x86_64__
  /// The same to the bit, two sums at a time.
  [[gnu::target("avx")]] void FlushByEight() {
    const auto& j = batch_;
    for (int a = kFirst; a < kValues; ++a) {
      const auto one = [&j, a ](int k) __attribute__((target("avx"))) {
        return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(&j[k][a]));
      };
      const __m256 a0 = one(0), a1 = one(1), a2 = one(2), a3 = one(3);
      for (int b = kFirst; b <= a; b += 2) {
        const auto by = [&j, b ](int k, __m256 of) __attribute__((target("avx"))) {
          return _mm256_mul_ps(of, _mm256_loadu_ps(reinterpret_cast<const float*>(&j[k][b])));
        };
        float* sum = reinterpret_cast<float*>(&sums_[a - kFirst][b - kFirst]);
        const __m256 added =
            _mm256_add_ps(_mm256_add_ps(by(0, a0), by(1, a1)), _mm256_add_ps(by(2, a2), by(3, a3)));
        _mm256_storeu_ps(sum, _mm256_add_ps(_mm256_loadu_ps(sum), added));
      }
    }
  }
#endif

  // One more of a row each, for what is taken by twos.
  Four batch_[kBatch][kValues + 1];
  int count_ = 0;
  Four sums_[kCount][kCount + 1] = {};
};

/// Of the model and its limits, each in all lanes.
struct Constants {
  Four wxx, wxy, wyy;
  Four outer, inner, band_px;
  Four per_blur, contrast, background;
  Four gradient_x, gradient_y;
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
    const auto all = [](double value) { return AllFour(static_cast<float>(value)); };
    c_ = {all(m_.wxx),        all(m_.wxy),        all(m_.wyy),         all(outer_),
          all(inner_),        all(band_px),       all(1 / m_.blur_px), all(m_.contrast),
          all(m_.background), all(m_.gradient_x), all(m_.gradient_y)};
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

  void AddSpan(int y, int x0, int x1) {
#ifdef __x86_64__
    if (TakesEight()) return AddSpanShort(y, x0, x1);
#endif
    AddPixels(y, x0, x1);
  }

#ifdef __x86_64__
  /// The same to the bit, by instructions that need fewer moves.
  [[gnu::target("avx")]] void AddSpanShort(int y, int x0, int x1) { AddPixels(y, x0, x1); }
#endif

  /// Columns x0 … x1 - 1.
  [[gnu::always_inline]] inline void AddPixels(int y, int x0, int x1) {
    const FourInts lane = {0, 1, 2, 3};
    const std::uint8_t* row = picture_.row(y);
    const auto dy = static_cast<float>(y - m_.row_px);
    for (int x = x0; x < x1; x += 4) {
      const int first = std::min(x, picture_.width - 4);  // reads nothing beyond the row
      const auto dx = static_cast<float>(first - m_.column_px);
      const FourInts wanted = (lane >= x - first) & (lane < x1 - first);
      AddFour(FourPixels(row + first), dx + Four{0, 1, 2, 3}, dy, wanted);
    }
  }

  [[gnu::always_inline]] inline void AddFour(Four grey, Four dx, float dy, FourInts wanted) {
    const Four u = c_.wxx * dx + c_.wxy * dy;
    const Four v = c_.wxy * dx + c_.wyy * dy;
    const Four q = Root(u * u + v * v);
    // Distance from the edge to first order: (|W d| - 1) / |its gradient W² d / |W d||.
    const Four px = c_.wxx * u + c_.wxy * v;
    const Four py = c_.wxy * u + c_.wyy * v;
    const Four by_steep = 1 / Most(Root(px * px + py * py), AllFour(1e-12F));
    const Four distance = (q - 1) * q * by_steep;
    // In the middle itself first order tells nothing.
    wanted &= (q <= c_.outer) & (q >= c_.inner) & (q > 1e-4F);
    wanted &= Magnitude(distance) <= c_.band_px;
    if (!Any(wanted)) return;
    const Four t = -distance * c_.per_blur;
    const FourInts near = wanted & (Magnitude(t) <= static_cast<float>(kReach));
    const bool flat = !Any(near);
    Four density{};
    Four cover = Where(t > 0, AllFour(1));
    if (!flat) {
      const Four bounded = Bounded(t);
      density = Where(near, NormalDensity(bounded));
      cover = NormalIntegral(bounded, density);
    }
    if (ring_) {
      const Four blurs = (q - static_cast<float>(kRingInner)) * q * by_steep * c_.per_blur;
      AddRing(u, v, blurs, wanted, cover);
    }
    const Four gain = 1 + c_.gradient_x * dx + c_.gradient_y * dy;
    const Four shade = c_.background + c_.contrast * cover;
    const Four value = gain * shade;
    // What the sensor cut off tells only that it was beyond.
    const FourInts white = wanted & (grey >= kSaturated);
    const FourInts black = wanted & (grey <= kBlack);
    samples_ -= wanted;
    saturated_ -= white | black;
    wanted &= ~((white & (value >= grey)) | (black & (value <= grey)));
    if (by_sectors_) {
      const Four by_shift = density * gain * c_.contrast * c_.per_blur;
      AddToSectors(u, v, wanted, {cover, by_shift, grey - value});
      return;
    }
    Four* j = flat ? flat_.Next() : edge_.Next();
    j[6] = Where(wanted, gain * cover);
    j[7] = Where(wanted, gain);
    j[8] = Where(wanted, shade * dx);
    j[9] = Where(wanted, shade * dy);
    j[10] = Where(wanted, grey - value);
    if (flat) return;
    // d value / d(-distance)
    density *= gain * c_.contrast * c_.per_blur;
    const Four by_shape = -density * by_steep;
    j[0] = Where(near & wanted, density * px * by_steep - shade * c_.gradient_x);
    j[1] = Where(near & wanted, density * py * by_steep - shade * c_.gradient_y);
    j[2] = Where(wanted, by_shape * u * dx);
    j[3] = Where(wanted, by_shape * (u * dy + v * dx));
    j[4] = Where(wanted, by_shape * v * dy);
    j[5] = Where(wanted, -density * t);
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
  static Four Bounded(Four t) { return Most(Least(t, AllFour(6)), AllFour(-6)); }

  /// @param blurs  beyond the ring's inner edge.
  void AddRing(Four u, Four v, Four blurs, FourInts wanted, Four& cover) const {
    const FourInts near = wanted & (blurs > static_cast<float>(-kRingReach));
    if (!Any(near)) return;
    Four ink{};
    for (int lane = 0; lane < 4; ++lane) {
      if (near[lane] != 0) ink[lane] = ring_->At(std::atan2(v[lane], u[lane]));
    }
    const Four bounded = Bounded(blurs);
    cover += Where(near, NormalIntegral(bounded, NormalDensity(bounded)) * ink);
  }

  const PageView& picture_;
  const DiscModel& m_;
  Constants c_;
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
