#include "part_alignment/chi_square.h"

#include <cmath>

namespace trammel::part_alignment {
namespace {

constexpr int kMostTerms = 100000;
constexpr double kSmall = 1e-16;

/// x^a e^-x / Gamma(a), the common factor.
double Factor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

double BySeries(double a, double x) {
  double term = 1 / a;
  double sum = term;
  for (int n = 1; n < kMostTerms && term > kSmall * sum; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * Factor(a, x);
}

/// Of the complement, by Lentz's method.
double ByFraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1 - a;
  double c = 1 / kTiny;
  double d = 1 / b;
  double fraction = d;
  for (int n = 1; n < kMostTerms; ++n) {
    const double numerator = -n * (n - a);
    b += 2;
    d = 1 / (numerator * d + b);
    c = b + numerator / c;
    fraction *= c * d;
    if (std::abs(c * d - 1) < kSmall * 4) {
      break;
    }
  }
  return fraction * Factor(a, x);
}

}  // namespace

double ChiSquareProbability(double value, int freedom) {
  const double a = 0.5 * freedom;
  const double x = 0.5 * value;
  if (!(x > 0)) {
    return 0;
  }
  return x < a + 1 ? BySeries(a, x) : 1 - ByFraction(a, x);
}

double ChiSquareQuantile(double probability, int freedom) {
  double low = 0;
  double high = freedom;
  while (ChiSquareProbability(high, freedom) < probability && high < 1e12) {
    high *= 2;
  }
  while (high - low > 1e-10 * high) {
    const double middle = 0.5 * (low + high);
    (ChiSquareProbability(middle, freedom) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace trammel::part_alignment
