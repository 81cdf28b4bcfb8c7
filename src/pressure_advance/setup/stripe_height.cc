#include "pressure_advance/setup/stripe_height.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "base/square.h"
#include "pressure_advance/setup/linear_fit.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kValues = 4;
// Of a cheap camera's optical axis from the picture's middle: about 1 % of its width.
constexpr double kPrincipalPoint_px = 8;
constexpr double kLeastAngle_rad = 10 * std::numbers::pi / 180;

StripeHeight None(StripeHeight found, const Measured& reason) {
  found.px_per_height_mm = found.laser_angle_rad = found.play_z_mm = reason;
  return found;
}

std::optional<LinearFit> Fit(std::span<const SeenStripe> stripes, double height_mm) {
  const auto count = static_cast<Eigen::Index>(stripes.size());
  Eigen::MatrixXd design(count, kValues);
  Eigen::VectorXd observed(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SeenStripe& stripe = stripes[static_cast<std::size_t>(i)];
    const double z_mm = stripe.head.z_mm - height_mm;
    design.row(i) << 1, z_mm, -z_mm * stripe.across_px, 0.5 * stripe.head.from_z;
    observed[i] = stripe.across_px;
  }
  return FitLinear(design, observed);
}

std::string Fault(const StripeHeight& found, double play_mm, const SetupLimits& limits) {
  if (found.repeat_mm > limits.repeat_mm) {
    return fmt::format(
        "the same height does not show the stripe at the same place: {:.3f} mm rms where {:.3f} mm "
        "are borne; tighten the mount of camera and laser",
        found.repeat_mm, limits.repeat_mm);
  }
  if (std::abs(play_mm) > limits.play_mm) {
    return fmt::format(
        "coming from above and from below shows heights {:.3f} mm apart where {:.3f} mm are borne: "
        "camera or laser is loose, or z has backlash",
        std::abs(play_mm), limits.play_mm);
  }
  return {};
}

}  // namespace

StripeHeight FitStripeHeight(std::span<const SeenStripe> stripes, double height_mm,
                             const Measured& px_per_mm, const SetupLimits& limits) {
  StripeHeight found;
  const auto fit = Fit(stripes, height_mm);
  if (!fit) {
    return None(found, Measured::CannotTell(fmt::format(
                           "{} pictures of the stripe do not determine its way: see it at heights "
                           "on both sides of {:.2f} mm, reached from above and from below",
                           stripes.size(), height_mm)));
  }
  const auto [low, high] =
      std::ranges::minmax(stripes, {}, [](const SeenStripe& stripe) { return stripe.head.z_mm; });
  if (low.head.z_mm > height_mm || high.head.z_mm < height_mm) {
    return None(found, Measured::CannotTell(fmt::format(
                           "the stripe was seen from {:.2f} to {:.2f} mm, which leaves out the "
                           "height asked for, {:.2f} mm",
                           low.head.z_mm, high.head.z_mm, height_mm)));
  }
  const double across = fit->value[0], inverse_mm = fit->value[2];
  found.perspective = {height_mm, inverse_mm, std::sqrt(fit->covariance(2, 2))};
  found.across_px = across;
  found.across_uncertainty_px = std::sqrt(fit->covariance(0, 0));
  const double slope = fit->value[1] - inverse_mm * across;  // d across / d z at the height
  Eigen::VectorXd to_slope(kValues);
  to_slope << -inverse_mm, 1, -across, 0;
  constexpr double kSeen = 5;
  if (!(std::abs(slope) > kSeen * std::sqrt(Variance(*fit, to_slope)))) {
    return None(found, Measured::Refused("the stripe does not move with the head's height: the "
                                         "laser is not seen, and a glint or a lamp is taken for "
                                         "it, or laser and camera look the same way"));
  }
  found.repeat_mm = fit->residual / std::abs(slope);
  Eigen::VectorXd to_play = Eigen::VectorXd::Zero(kValues);
  to_play[3] = 1 / slope;
  const double play_mm = fit->value[3] / slope;
  const std::string fault = Fault(found, play_mm, limits);
  if (!fault.empty()) return None(found, Measured::Refused(fault));
  const double dof = fit->degrees_of_freedom;
  found.play_z_mm = MeasuredFrom(play_mm, Variance(*fit, to_play), 0, dof);
  found.px_per_height_mm = MeasuredFrom(slope, Variance(*fit, to_slope),
                                        Square(slope * limits.axis_scale_uncertainty), dof);
  if (!px_per_mm.good()) {
    found.laser_angle_rad = px_per_mm;
    return found;
  }
  const double scale = px_per_mm.quantity().value;
  const double tangent = std::abs(fit->value[1]) / scale;
  const double gain = 1 / (1 + Square(tangent));  // d angle / d tangent
  if (std::atan(tangent) < kLeastAngle_rad) {
    found.laser_angle_rad = Measured::CannotTell(fmt::format(
        "the laser stands {:.1f} degrees from the vertical, too steep to show heights: turn it to "
        "about 45 degrees",
        std::atan(tangent) * 180 / std::numbers::pi));
    return found;
  }
  Eigen::VectorXd to_angle = Eigen::VectorXd::Zero(kValues);
  to_angle[1] = gain / scale;
  const double systematic =
      Square(gain * tangent) * (Square(px_per_mm.quantity().standard_uncertainty / scale) +
                                Square(limits.axis_scale_uncertainty)) +
      Square(gain * inverse_mm * kPrincipalPoint_px / scale);
  found.laser_angle_rad =
      MeasuredFrom(std::atan(tangent), Variance(*fit, to_angle), systematic, dof);
  return found;
}

}  // namespace trammel::pressure_advance
