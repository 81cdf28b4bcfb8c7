// Logarithm and exponential of four numbers in single precision at once.
#pragma once

#include <bit>
#include <cstddef>

namespace trammel::tap {

inline constexpr std::size_t kLanes = 4;
using Floats = float __attribute__((vector_size(16)));
using Ints = int __attribute__((vector_size(16)));

/// Natural logarithm, to 2e-7 of it or of 1: of 2^e m with m from sqrt(1/2) to sqrt(2), by the
/// series of the inverse hyperbolic tangent, ln m = 2 artanh((m - 1) / (m + 1)).
/// @param x  REQUIRES normal numbers > 0.
[[nodiscard]] inline Floats Log(const Floats& x) {
  constexpr int kRootHalf = 0x3f3504f3;  // the bits of sqrt(1/2)
  constexpr int kFraction = 23;          // bits of the fraction
  constexpr float kLn2 = 0.6931471806F;
  const Ints bits = std::bit_cast<Ints>(x);
  const Ints exponent = (bits - kRootHalf) >> kFraction;
  const Floats m = std::bit_cast<Floats>(bits - (exponent << kFraction));
  const Floats z = (m - 1) / (m + 1);
  const Floats w = z * z;
  const Floats series = z * (2 + w * (2.0F / 3 + w * (2.0F / 5 + w * (2.0F / 7 + w * (2.0F / 9)))));
  return series + kLn2 * __builtin_convertvector(exponent, Floats);
}

/// Exponential, to 3e-7 of it: 2^n e^r with r from -ln(2)/2 to ln(2)/2, by the power series.
/// @param x  Below 88; 2^-126 or so where it is below -87.
[[nodiscard]] inline Floats Exp(const Floats& x) {
  constexpr float kLog2E = 1.442695041F;
  // ln 2 in two parts, the first of which times n is exact (Cody & Waite 1980).
  constexpr float kLn2High = 0.693359375F;
  constexpr float kLn2Low = -2.121944401e-4F;
  constexpr int kFraction = 23;
  constexpr int kBias = 127;
  constexpr float kLeast = -87;
  const Floats at = x > kLeast ? x : Floats{} + kLeast;
  const Floats scaled = at * kLog2E;
  const Ints n =
      __builtin_convertvector(scaled + (scaled > 0 ? Floats{} + 0.5F : Floats{} - 0.5F), Ints);
  const Floats whole = __builtin_convertvector(n, Floats);
  const Floats r = at - whole * kLn2High - whole * kLn2Low;
  Floats series = Floats{} + 1;
#pragma GCC unroll 8
  for (int i = 7; i > 0; --i) {
    series = 1 + r * series * (1.0F / static_cast<float>(i));
  }
  return series * std::bit_cast<Floats>((n + kBias) << kFraction);
}

}  // namespace trammel::tap
