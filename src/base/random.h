// Seeded random numbers with the same sequence on every machine and library.
#pragma once

#include <cstdint>

namespace trammel {

/// xoshiro256++ (Blackman & Vigna 2019) seeded by splitmix64. The standard library's engines are
/// portable but its distributions are not. Here both are fixed, so that a seed determines the
/// sequence.
class Random {
 public:
  explicit Random(std::uint64_t seed);

  /// Returns a uniform 64-bit value.
  std::uint64_t Bits();
  /// Uniform in [0, 1).
  double Uniform();
  /// Uniform in [lo, hi).
  double Uniform(double lo, double hi);
  /// Standard normal (Marsaglia's polar method).
  double Normal();
  double Normal(double mean, double standard_deviation);
  /// Uniform in 0 … n - 1. REQUIRES n > 0.
  std::uint64_t Below(std::uint64_t n);
  /// Returns an independent generator; siblings have different `stream`. Does not advance this one.
  [[nodiscard]] Random Fork(std::uint64_t stream) const;

 private:
  std::uint64_t state_[4];
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace trammel
