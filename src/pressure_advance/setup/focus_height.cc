#include "pressure_advance/setup/focus_height.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "base/square.h"
#include "pressure_advance/setup/linear_fit.h"

namespace trammel::pressure_advance {
namespace {

// width² over z as a polynomial in z - middle, weighted by the widths of a first fit: a width's
// error is in proportion to it.
struct WidthFit {
  double middle_mm = 0;
  std::optional<LinearFit> fit;
};

WidthFit FitWidths(std::span<const SeenStripe> stripes, const Perspective& perspective,
                   int degree) {
  WidthFit widths;
  for (const SeenStripe& stripe : stripes) {
    widths.middle_mm += stripe.head.z_mm / static_cast<double>(stripes.size());
  }
  const auto count = static_cast<Eigen::Index>(stripes.size());
  Eigen::MatrixXd design(count, degree + 1);
  Eigen::VectorXd observed(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SeenStripe& stripe = stripes[static_cast<std::size_t>(i)];
    const double z_mm = stripe.head.z_mm - widths.middle_mm;
    double power = 1;
    for (int term = 0; term <= degree; ++term, power *= z_mm) design(i, term) = power;
    observed[i] = Square(stripe.width_px * perspective.Shrinks(stripe.head.z_mm));
  }
  widths.fit = FitLinear(design, observed);
  if (widths.fit) {
    const Eigen::VectorXd weight =
        (design * widths.fit->value).cwiseMax(observed.minCoeff()).cwiseInverse();
    widths.fit = FitLinear(weight.asDiagonal() * design, weight.cwiseProduct(observed));
  }
  return widths;
}

// The parabola's lowest point, wherever it lies.
std::optional<double> LowestOfParabola(const WidthFit& parabola) {
  if (!parabola.fit || !(parabola.fit->value[2] > 0)) return std::nullopt;
  return parabola.middle_mm - parabola.fit->value[1] / (2 * parabola.fit->value[2]);
}

// The cubic's lowest point. With b² < 3ac it has none.
std::optional<double> LowestOfCubic(const WidthFit& cubic) {
  if (!cubic.fit) return std::nullopt;
  const double a = cubic.fit->value[1], b = cubic.fit->value[2], c = cubic.fit->value[3];
  const double root = b * b - 3 * a * c;
  if (!(b > 0) || !(root > 0)) return std::nullopt;
  return cubic.middle_mm - a / (b + std::sqrt(root));
}

// How far two other readings of the same widths put the focus from `focus_mm`: a blur that grows
// unlike to the two sides, and only what stands near the focus, where a halo weighs otherwise. Rms
// of both.
std::optional<double> ModelError(std::span<const SeenStripe> stripes,
                                 const Perspective& perspective, double focus_mm, double half_mm) {
  const auto cubic = LowestOfCubic(FitWidths(stripes, perspective, 3));
  constexpr double kNear = 2.0 / 3;
  std::vector<SeenStripe> near;
  for (const SeenStripe& stripe : stripes) {
    if (std::abs(stripe.head.z_mm - focus_mm) < kNear * half_mm) near.push_back(stripe);
  }
  constexpr std::size_t kFewest = 7;
  const auto close = near.size() < kFewest ? std::optional(focus_mm)
                                           : LowestOfParabola(FitWidths(near, perspective, 2));
  if (!cubic || !close) return std::nullopt;
  return std::sqrt((Square(*cubic - focus_mm) + Square(*close - focus_mm)) / 2);
}

}  // namespace

Measured FitFocusHeight(std::span<const SeenStripe> stripes, const Perspective& perspective) {
  const WidthFit parabola = FitWidths(stripes, perspective, 2);
  if (!parabola.fit) {
    return Measured::CannotTell(fmt::format(
        "{} pictures of the stripe do not determine the focus: see it at six heights at least",
        stripes.size()));
  }
  const auto [low, high] =
      std::ranges::minmax(stripes, {}, [](const SeenStripe& stripe) { return stripe.head.z_mm; });
  const double slope = parabola.fit->value[1], bend = parabola.fit->value[2];
  constexpr double kSeen = 5;
  if (!(bend > kSeen * std::sqrt(parabola.fit->covariance(2, 2)))) {
    const bool falls = slope < 0;
    const bool tilts = std::abs(slope) > kSeen * std::sqrt(parabola.fit->covariance(1, 1));
    return Measured::CannotTell(
        fmt::format("the stripe has no sharpest height between {:.2f} and {:.2f} mm{}",
                    low.head.z_mm, high.head.z_mm,
                    !tilts  ? ": see it over a greater range"
                    : falls ? ": it becomes sharper upwards, look above"
                            : ": it becomes sharper downwards, look below"));
  }
  const double focus_mm = *LowestOfParabola(parabola);
  if (focus_mm < low.head.z_mm || focus_mm > high.head.z_mm) {
    return Measured::CannotTell(
        fmt::format("the stripe is sharpest outside of the heights seen, {:.2f} to {:.2f} mm: look "
                    "about {:.1f} mm",
                    low.head.z_mm, high.head.z_mm, focus_mm));
  }
  Eigen::VectorXd gradient(3);
  gradient << 0, -1 / (2 * bend), slope / (2 * Square(bend));
  Perspective other = perspective;
  other.inverse_mm += perspective.inverse_uncertainty;
  const auto shifted = LowestOfParabola(FitWidths(stripes, other, 2));
  const auto model_mm =
      ModelError(stripes, perspective, focus_mm, (high.head.z_mm - low.head.z_mm) / 2);
  constexpr double kGreatest_mm = 0.5;  // standard uncertainty: a camera's depth of field
  if (!model_mm || *model_mm > kGreatest_mm) {
    return Measured::CannotTell(fmt::format(
        "the stripe has no clear sharpest height: about {:.1f} mm, {}; a glossy plate or a bright "
        "light smears it",
        focus_mm,
        model_mm ? fmt::format("and {:.1f} mm to either side by other readings", *model_mm)
                 : "and none by other readings"));
  }
  const double lens = shifted ? Square(*shifted - focus_mm) : 0;
  return MeasuredFrom(focus_mm, Variance(*parabola.fit, gradient), lens + Square(*model_mm),
                      parabola.fit->degrees_of_freedom);
}

}  // namespace trammel::pressure_advance
