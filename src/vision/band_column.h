// Eight rows side by side, in vector registers.
#pragma once

#include <cstddef>
#include <cstring>

namespace trammel::vision {

/// Rows that are worked on side by side: the workspace's images are stored in bands of so many
/// rows, in a band column by column. Whatever runs along a row runs along all of them.
inline constexpr int kBandRows = 8;

/// One column of a band, or one value a row. In the compiler's own vectors: what clang 16 makes of
/// Eigen's expressions of this size goes through memory, and waits for it.
class BandColumn {
 public:
  BandColumn() = default;  ///< zeros
  explicit BandColumn(float all) : low_(Half{} + all), high_(low_) {}

  [[nodiscard]] static BandColumn At(const float* from) {
    BandColumn column;
    std::memcpy(&column.low_, from, sizeof(Half));
    std::memcpy(&column.high_, from + kBandRows / 2, sizeof(Half));
    return column;
  }
  void Put(float* to) const {
    std::memcpy(to, &low_, sizeof(Half));
    std::memcpy(to + kBandRows / 2, &high_, sizeof(Half));
  }

  friend BandColumn operator+(const BandColumn& a, const BandColumn& b) {
    return {a.low_ + b.low_, a.high_ + b.high_};
  }
  friend BandColumn operator-(const BandColumn& a, const BandColumn& b) {
    return {a.low_ - b.low_, a.high_ - b.high_};
  }
  friend BandColumn operator*(const BandColumn& a, const BandColumn& b) {
    return {a.low_ * b.low_, a.high_ * b.high_};
  }
  friend BandColumn operator/(const BandColumn& a, const BandColumn& b) {
    return {a.low_ / b.low_, a.high_ / b.high_};
  }
  friend BandColumn operator+(const BandColumn& a, float b) { return a + BandColumn(b); }
  friend BandColumn operator-(const BandColumn& a, float b) { return a - BandColumn(b); }
  friend BandColumn operator*(const BandColumn& a, float b) { return a * BandColumn(b); }
  BandColumn& operator+=(const BandColumn& other) { return *this = *this + other; }
  BandColumn& operator-=(const BandColumn& other) { return *this = *this - other; }
  BandColumn& operator*=(const BandColumn& other) { return *this = *this * other; }

  friend BandColumn Larger(const BandColumn& a, const BandColumn& b) {
    return {a.low_ > b.low_ ? a.low_ : b.low_, a.high_ > b.high_ ? a.high_ : b.high_};
  }
  friend BandColumn Smaller(const BandColumn& a, const BandColumn& b) {
    return {a.low_ < b.low_ ? a.low_ : b.low_, a.high_ < b.high_ ? a.high_ : b.high_};
  }

 private:
  using Half [[gnu::vector_size(16)]] = float;
  BandColumn(const Half& low, const Half& high) : low_(low), high_(high) {}

  Half low_{};
  Half high_{};
};

}  // namespace trammel::vision
