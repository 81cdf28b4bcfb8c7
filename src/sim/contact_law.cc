#include "sim/contact_law.h"

#include <algorithm>
#include <cmath>

namespace trammel::sim {
namespace {

// Force over k D and its slope, at a depth in units of D that is at most 1.
struct Relative {
  double force = 0;
  double slope = 0;
};

Relative At(const ContactLaw& law, double x) {
  const double a = law.share;
  switch (law.kind) {
    case ContactKind::kLinear:
      break;
    case ContactKind::kQuadratic:
      return {x * (1 + a * x), 1 + 2 * a * x};
    case ContactKind::kCubic:
      return {x * (1 + a * x * x), 1 + 3 * a * x * x};
    case ContactKind::kPower:
      return {std::pow(x, law.exponent), law.exponent * std::pow(x, law.exponent - 1)};
  }
  return {x, 1};
}

double BedForce(const ContactLaw& law, double depth_mm) {
  if (depth_mm <= 0) return 0;
  const double x = depth_mm / law.reference_mm;
  const Relative at = At(law, std::min(x, 1.0));
  const double beyond = std::max(0.0, x - 1);
  return law.stiffness_g_mm * law.reference_mm * (at.force + at.slope * beyond);
}

}  // namespace

std::string_view ToString(ContactKind kind) {
  switch (kind) {
    case ContactKind::kLinear:
      return "linear";
    case ContactKind::kQuadratic:
      return "quadratic";
    case ContactKind::kCubic:
      return "cubic";
    case ContactKind::kPower:
      return "power";
  }
  return "linear";
}

double ContactForce(const ContactLaw& law, double depth_mm) {
  if (depth_mm <= 0) return 0;
  const double sheet_mm = std::min(depth_mm, law.sheet_gap_mm);
  return law.sheet_stiffness_g_mm * sheet_mm + BedForce(law, depth_mm - law.sheet_gap_mm);
}

double ContactDepth(const ContactLaw& law, double force_g) {
  if (!(force_g > 0)) return 0;
  constexpr double kDeepestMm = 1e6;
  constexpr double kToMm = 1e-9;
  double lo = 0;
  double hi = law.reference_mm;
  while (ContactForce(law, hi) < force_g && hi < kDeepestMm) hi *= 2;
  while (hi - lo > kToMm) {
    const double middle = 0.5 * (lo + hi);
    (ContactForce(law, middle) < force_g ? lo : hi) = middle;
  }
  return 0.5 * (lo + hi);
}

}  // namespace trammel::sim
