// Four floats or doubles at a time: SSE and its kin, by the compiler's vector types; and AVX2,
// where a processor has it.
#pragma once

#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace trammel::part_alignment {

typedef float Four __attribute__((vector_size(16)));
/// Of comparisons: -1 where true, 0 where not.
typedef std::int32_t FourInts __attribute__((vector_size(16)));

typedef double FourDoubles __attribute__((vector_size(32)));
/// Of comparisons of doubles.
typedef std::int64_t FourLongs __attribute__((vector_size(32)));

/// Places in a picture, or directions.
struct FourPlaces {
  FourDoubles x;
  FourDoubles y;
};

#ifdef __x86_64__
/// Whether the processor takes four doubles or eight floats at a time, and whole numbers beside
/// them. What takes them gives the same to the bit: nothing is multiplied and added at once.
inline std::atomic<bool>& Avx2Taken() {
  static std::atomic<bool> taken = __builtin_cpu_supports("avx2") != 0;
  return taken;
}
inline bool TakesAvx2() { return Avx2Taken().load(std::memory_order_relaxed); }

/// Leaves AVX2 aside while it lives: what other processors find, for tests.
class WithoutAvx2 {
 public:
  WithoutAvx2() { Avx2Taken() = false; }
  ~WithoutAvx2() { Avx2Taken() = before_; }
  WithoutAvx2(const WithoutAvx2&) = delete;
  WithoutAvx2& operator=(const WithoutAvx2&) = delete;

 private:
  bool before_ = TakesAvx2();
};
#endif

/// Eight floats, where the processor takes as many at a time.
typedef float Eight __attribute__((vector_size(32)));
typedef std::int32_t EightInts __attribute__((vector_size(32)));

/// What comparisons of such numbers give: -1 where true, 0 where not.
template <typename Floats>
struct MaskOf;
template <>
struct MaskOf<Four> {
  typedef FourInts Type;
};
template <>
struct MaskOf<Eight> {
  typedef EightInts Type;
};
template <>
struct MaskOf<double> {
  typedef bool Type;
};
template <>
struct MaskOf<FourDoubles> {
  typedef FourLongs Type;
};
template <typename Floats>
using Mask = typename MaskOf<Floats>::Type;

template <typename Floats>
[[gnu::always_inline]] inline Floats All(float value) {
  Floats all{};
  for (std::size_t i = 0; i < sizeof(Floats) / sizeof(float); ++i) all[i] = value;
  return all;
}

/// The i-th four of some.
[[gnu::always_inline]] inline Four FourOf(const Four& of, int /*i*/) { return of; }
[[gnu::always_inline]] inline FourInts FourOf(const FourInts& of, int /*i*/) { return of; }
[[gnu::always_inline]] inline Four FourOf(const Eight& of, int i) {
  return i == 0 ? Four{of[0], of[1], of[2], of[3]} : Four{of[4], of[5], of[6], of[7]};
}
[[gnu::always_inline]] inline FourInts FourOf(const EightInts& of, int i) {
  return i == 0 ? FourInts{of[0], of[1], of[2], of[3]} : FourInts{of[4], of[5], of[6], of[7]};
}

/// `value` where the mask says so, else 0; never the product with what may be infinite.
template <typename Floats>
[[gnu::always_inline]] inline Floats Where(Mask<Floats> mask, Floats value) {
  return reinterpret_cast<Floats>(mask & reinterpret_cast<Mask<Floats>>(value));
}

/// Whether any lane is true.
inline bool Any(FourInts mask) {
#ifdef __SSE2__
  return _mm_movemask_epi8(reinterpret_cast<__m128i>(mask)) != 0;
#else
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
#endif
}

inline bool Any(bool is_true) { return is_true; }
[[gnu::always_inline]] inline bool Any(FourLongs mask) {
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
}

[[gnu::always_inline]] inline double Root(double a) { return std::sqrt(a); }
[[gnu::always_inline]] inline FourDoubles Root(FourDoubles a) {
  for (int k = 0; k < 4; ++k) a[k] = std::sqrt(a[k]);
  return a;
}

/// As good as std::hypot's: what rounding a square root's argument loses is made good (Borges, An
/// improved algorithm for hypot(a, b), 2019). REQUIRES squares that neither overflow nor vanish.
[[gnu::always_inline]] inline FourDoubles Lengths(const FourPlaces& of) {
  const FourDoubles x = of.x < 0 ? -of.x : of.x;
  const FourDoubles y = of.y < 0 ? -of.y : of.y;
  const FourDoubles longer = x > y ? x : y;
  const FourDoubles shorter = x > y ? y : x;
  const FourDoubles square = longer * longer + shorter * shorter;
  const FourDoubles length = Root(square);
  // length² - longer² - shorter², by what is left of the length beside the one that is nearer to
  // it.
  const FourDoubles over_shorter = length - shorter;
  const FourDoubles over_longer = length - longer;
  const FourDoubles steep =
      longer * (2 * over_shorter - longer) + (over_shorter - 2 * (longer - shorter)) * over_shorter;
  const FourDoubles flat = 2 * over_longer * (longer - 2 * shorter) +
                           ((4 * over_longer - shorter) * shorter + over_longer * over_longer);
  return length - (length <= 2 * shorter ? steep : flat) / (2 * length);
}

/// Bit k: whether the k-th lane is true.
inline unsigned BitsOf(FourInts mask) {
#ifdef __SSE2__
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(mask)));
#else
  return (mask[0] & 1U) | (mask[1] & 2U) | (mask[2] & 4U) | (mask[3] & 8U);
#endif
}

/// The first lane that is true. REQUIRES Any(mask).
inline int FirstOf(FourInts mask) { return std::countr_zero(BitsOf(mask)); }

[[gnu::always_inline]] inline bool Any(EightInts mask) {
  return Any(FourOf(mask, 0) | FourOf(mask, 1));
}

template <typename Floats>
[[gnu::always_inline]] inline Floats Most(Floats a, Floats b) {
  return a > b ? a : b;
}
template <typename Floats>
[[gnu::always_inline]] inline Floats Least(Floats a, Floats b) {
  return a < b ? a : b;
}
template <typename Floats>
[[gnu::always_inline]] inline Floats Magnitude(Floats a) {
  return reinterpret_cast<Floats>(reinterpret_cast<Mask<Floats>>(a) & 0x7fffffff);
}

/// REQUIRES nothing below 0.
template <typename Floats>
[[gnu::always_inline]] inline Floats Root(Floats a) {
  for (std::size_t i = 0; i < sizeof(Floats) / sizeof(float); ++i) a[i] = std::sqrt(a[i]);
  return a;
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
template <typename Floats>
[[gnu::always_inline]] inline Floats ExpOfNegative(Floats x) {
  constexpr float kLog2e = 1.44269504F;
  constexpr float kLn2 = 0.693147181F;
  const Floats binary = x * kLog2e;
  // To the nearest whole number: conversion cuts towards 0, and there is nothing above 0.
  const Mask<Floats> whole = __builtin_convertvector(binary - 0.5F, Mask<Floats>);
  const Floats z = (binary - __builtin_convertvector(whole, Floats)) * kLn2;
  const Floats rest =
      1 +
      z * (1 + z * (0.5F + z * (0.166666667F +
                                z * (0.0416666667F + z * (0.00833333333F + z * 0.00138888889F)))));
  return rest * reinterpret_cast<Floats>((whole + 127) << 23);
}

template <typename Floats>
[[gnu::always_inline]] inline Floats NormalDensity(Floats t) {
  return 0.39894228F * ExpOfNegative(-0.5F * t * t);
}

/// The normal distribution's integral from its density, to 2e-7 (Abramowitz & Stegun 26.2.17).
template <typename Floats>
[[gnu::always_inline]] inline Floats NormalIntegral(Floats t, Floats density) {
  const Floats k = 1 / (1 + 0.2316419F * Magnitude(t));
  const Floats tail =
      density * k *
      (0.31938153F +
       k * (-0.356563782F + k * (1.781477937F + k * (-1.821255978F + k * 1.330274429F))));
  return t > 0 ? 1 - tail : tail;
}

}  // namespace trammel::part_alignment
