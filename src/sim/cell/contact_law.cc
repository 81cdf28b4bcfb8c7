#include "sim/cell/contact_law.h"

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
    case ContactKind::kTwoSlope:
      return x < law.knee ? Relative{x, 1} : Relative{x + a * (x - law.knee), 1 + a};
    case ContactKind::kYielding:
      return {law.knee * (1 - std::exp(-x / law.knee)), std::exp(-x / law.knee)};
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

// Solves d = x + (1 - s) T (1 - exp(-x / (s T))) for x by Newton's method, which from 0 rises to
// the root without passing it, as the right side is concave.
double BehindExponentialToe(const ContactLaw& law, double depth_mm) {
  constexpr double kToMm = 1e-12;
  constexpr int kMostSteps = 100;
  const double film_mm = (1 - law.toe_share) * law.toe_mm;
  const double packed_mm = law.toe_share * law.toe_mm;
  double x_mm = 0;
  for (int i = 0; i < kMostSteps; ++i) {
    const double left = std::exp(-x_mm / packed_mm);
    const double step_mm =
        (depth_mm - x_mm - film_mm * (1 - left)) / (1 + film_mm / packed_mm * left);
    x_mm += step_mm;
    if (!(step_mm > kToMm)) break;
  }
  return x_mm;
}

// Depth that the law sees behind the toe: the integral of the share of its stiffness that is there.
double BehindToe(const ContactLaw& law, double depth_mm) {
  if (law.toe_kind == ToeKind::kExponential && law.toe_mm > 0) {
    return BehindExponentialToe(law, depth_mm);
  }
  const double from_mm = law.toe_mm * (1 - law.toe_rounding);
  const double to_mm = law.toe_mm * (1 + law.toe_rounding);
  double soft_mm = std::min(depth_mm, law.toe_mm);
  if (depth_mm > from_mm && depth_mm < to_mm) {
    const double into_mm = depth_mm - from_mm;
    soft_mm = from_mm + into_mm - into_mm * into_mm / (2 * (to_mm - from_mm));
  }
  return depth_mm - (1 - law.toe_share) * soft_mm;
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
    case ContactKind::kTwoSlope:
      return "two-slope";
    case ContactKind::kYielding:
      return "yielding";
  }
  return "linear";
}

double ContactForce(const ContactLaw& law, double depth_mm) {
  if (depth_mm <= 0) return 0;
  depth_mm = BehindToe(law, depth_mm);
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
