// Sums of products of what pixels tell of a disc's model: its normal equations.
#pragma once

#include <algorithm>

#include "part_alignment/targets/disc_pass.h"
#include "part_alignment/targets/four.h"

#ifdef __x86_64__
#include <immintrin.h>
#endif

namespace trammel::part_alignment {

inline constexpr int kValues = kDiscParameters + 1;  ///< the residual follows the parameters

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
    if (TakesAvx2()) return FlushByEight();
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
  [[gnu::target("avx2")]] void FlushByEight() {
    const auto& j = batch_;
    for (int a = kFirst; a < kValues; ++a) {
      const auto one = [&j, a ](int k) __attribute__((target("avx2"))) {
        return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(&j[k][a]));
      };
      const __m256 a0 = one(0), a1 = one(1), a2 = one(2), a3 = one(3);
      for (int b = kFirst; b <= a; b += 2) {
        const auto by = [&j, b ](int k, __m256 of) __attribute__((target("avx2"))) {
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

}  // namespace trammel::part_alignment
