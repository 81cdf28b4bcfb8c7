#include "pressure_advance/setup/focus_height.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/square.h"
#include "pressure_advance/setup/linear_fit.h"

namespace trammel::pressure_advance {
namespace {

// width² over z: value 0 + value 1 · (z - middle) + value 2 · (z - middle)²
struct Parabola {
  double middle_mm = 0;
  std::optional<LinearFit> fit;

  [[nodiscard]] double lowest_mm() const { return middle_mm - fit->value[1] / (2 * fit->value[2]); }
};

Parabola FitParabola(std::span<const SeenStripe> stripes, const Perspective& perspective) {
  Parabola parabola;
  for (const SeenStripe& stripe : stripes) {
    parabola.middle_mm += stripe.head.z_mm / static_cast<double>(stripes.size());
  }
  const auto count = static_cast<Eigen::Index>(stripes.size());
  Eigen::MatrixXd design(count, 3);
  Eigen::VectorXd observed(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SeenStripe& stripe = stripes[static_cast<std::size_t>(i)];
    const double z_mm = stripe.head.z_mm - parabola.middle_mm;
    design.row(i) << 1, z_mm, Square(z_mm);
    observed[i] = Square(stripe.width_px * perspective.Shrinks(stripe.head.z_mm));
  }
  parabola.fit = FitLinear(design, observed);
  if (parabola.fit) {  // a width's error is in proportion to it: weighted by the widths of the fit
    const Eigen::VectorXd weight =
        (design * parabola.fit->value).cwiseMax(observed.minCoeff()).cwiseInverse();
    parabola.fit = FitLinear(weight.asDiagonal() * design, weight.cwiseProduct(observed));
  }
  return parabola;
}

}  // namespace

Measured FitFocusHeight(std::span<const SeenStripe> stripes, const Perspective& perspective) {
  const Parabola parabola = FitParabola(stripes, perspective);
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
  const double focus_mm = parabola.lowest_mm();
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
  const Parabola shifted = FitParabola(stripes, other);
  const double systematic = shifted.fit ? Square(shifted.lowest_mm() - focus_mm) : 0;
  return MeasuredFrom(focus_mm, Variance(*parabola.fit, gradient), systematic,
                      parabola.fit->degrees_of_freedom);
}

}  // namespace trammel::pressure_advance
