// Four floats at a time: SSE and its kin, by the compiler's vector types.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace trammel::part_alignment {

typedef float Four __attribute__((vector_size(16)));
/// Of comparisons: -1 where true, 0 where not.
typedef std::int32_t FourInts __attribute__((vector_size(16)));

inline Four AllFour(float value) { return Four{value, value, value, value}; }

/// `value` where the mask says so, else 0; never the product with what may be infinite.
inline Four Where(FourInts mask, Four value) {
  return reinterpret_cast<Four>(mask & reinterpret_cast<FourInts>(value));
}

/// Whether any lane is true.
inline bool Any(FourInts mask) {
#ifdef __SSE2__
  return _mm_movemask_epi8(reinterpret_cast<__m128i>(mask)) != 0;
#else
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
#endif
}

inline Four Most(Four a, Four b) { return a > b ? a : b; }
inline Four Least(Four a, Four b) { return a < b ? a : b; }
inline Four Magnitude(Four a) {
  return reinterpret_cast<Four>(reinterpret_cast<FourInts>(a) & 0x7fffffff);
}

/// REQUIRES nothing below 0.
inline Four Root(Four a) {
#ifdef __SSE2__
  return _mm_sqrt_ps(a);
#else
  return Four{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
#endif
}

/// Four neighbouring pixels.
inline Four FourPixels(const std::uint8_t* p) {
#ifdef __SSE2__
  std::int32_t bytes = 0;
  std::memcpy(&bytes, p, sizeof(bytes));
  const __m128i zero = _mm_setzero_si128();
  const __m128i words = _mm_unpacklo_epi8(_mm_cvtsi32_si128(bytes), zero);
  return _mm_cvtepi32_ps(_mm_unpacklo_epi16(words, zero));
#else
  return Four{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]),
              static_cast<float>(p[3])};
#endif
}

/// exp(x) for x in -80 … 0, to 3e-7 of itself.
inline Four ExpOfNegative(Four x) {
  constexpr float kLog2e = 1.44269504F;
  constexpr float kLn2 = 0.693147181F;
  const Four binary = x * kLog2e;
  // To the nearest whole number: conversion cuts towards 0, and there is nothing above 0.
  const FourInts whole = __builtin_convertvector(binary - 0.5F, FourInts);
  const Four z = (binary - __builtin_convertvector(whole, Four)) * kLn2;
  const Four rest =
      1 +
      z * (1 + z * (0.5F + z * (0.166666667F +
                                z * (0.0416666667F + z * (0.00833333333F + z * 0.00138888889F)))));
  return rest * reinterpret_cast<Four>((whole + 127) << 23);
}

inline Four NormalDensity(Four t) { return 0.39894228F * ExpOfNegative(-0.5F * t * t); }

/// The normal distribution's integral from its density, to 2e-7 (Abramowitz & Stegun 26.2.17).
inline Four NormalIntegral(Four t, Four density) {
  const Four k = 1 / (1 + 0.2316419F * Magnitude(t));
  const Four tail =
      density * k *
      (0.31938153F +
       k * (-0.356563782F + k * (1.781477937F + k * (-1.821255978F + k * 1.330274429F))));
  return t > 0 ? 1 - tail : tail;
}

}  // namespace trammel::part_alignment
