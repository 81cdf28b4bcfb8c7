#include "pressure_advance/setup/focus_height.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/square.h"
#include "pressure_advance/setup/linear_fit.h"

namespace trammel::pressure_advance {

Measured FitFocusHeight(std::span<const SeenStripe> stripes) {
  double middle_mm = 0;
  for (const SeenStripe& stripe : stripes) {
    middle_mm += stripe.head.z_mm / static_cast<double>(stripes.size());
  }
  const auto count = static_cast<Eigen::Index>(stripes.size());
  Eigen::MatrixXd design(count, 3);
  Eigen::VectorXd observed(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SeenStripe& stripe = stripes[static_cast<std::size_t>(i)];
    const double z_mm = stripe.head.z_mm - middle_mm;
    design.row(i) << 1, z_mm, Square(z_mm);
    observed[i] = Square(stripe.width_px);
  }
  auto fit = FitLinear(design, observed);
  if (fit) {  // a width's error is in proportion to it: weighted by the widths that the fit gives
    const Eigen::VectorXd weight =
        (design * fit->value).cwiseMax(observed.minCoeff()).cwiseInverse();
    fit = FitLinear(weight.asDiagonal() * design, weight.cwiseProduct(observed));
  }
  if (!fit) {
    return Measured::CannotTell(fmt::format(
        "{} pictures of the stripe do not determine the focus: see it at six heights at least",
        stripes.size()));
  }
  const auto [low, high] =
      std::ranges::minmax(stripes, {}, [](const SeenStripe& stripe) { return stripe.head.z_mm; });
  const double slope = fit->value[1], bend = fit->value[2];
  constexpr double kSeen = 5;
  if (!(bend > kSeen * std::sqrt(fit->covariance(2, 2)))) {
    const bool falls = slope < 0;
    const bool tilts = std::abs(slope) > kSeen * std::sqrt(fit->covariance(1, 1));
    return Measured::CannotTell(
        fmt::format("the stripe has no sharpest height between {:.2f} and {:.2f} mm{}",
                    low.head.z_mm, high.head.z_mm,
                    !tilts  ? ": see it over a greater range"
                    : falls ? ": it becomes sharper upwards, look above"
                            : ": it becomes sharper downwards, look below"));
  }
  const double focus_mm = middle_mm - slope / (2 * bend);
  if (focus_mm < low.head.z_mm || focus_mm > high.head.z_mm) {
    return Measured::CannotTell(
        fmt::format("the stripe is sharpest outside of the heights seen, {:.2f} to {:.2f} mm: look "
                    "about {:.1f} mm",
                    low.head.z_mm, high.head.z_mm, focus_mm));
  }
  Eigen::VectorXd gradient(3);
  gradient << 0, -1 / (2 * bend), slope / (2 * Square(bend));
  return MeasuredFrom(focus_mm, Variance(*fit, gradient), 0, fit->degrees_of_freedom);
}

}  // namespace trammel::pressure_advance
