#include "pressure_advance/setup/camera_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/square.h"
#include "base/statistics.h"
#include "geometry/linear_systems.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kMinLeftOver = 3;
constexpr double kGreatestInverse = 1e10;  // normalised normal matrix: condition squared

}  // namespace

std::optional<LinearFit> FitLinear(const Eigen::MatrixXd& design, const Eigen::VectorXd& observed) {
  const Eigen::Index columns = design.cols();
  LinearFit fit;
  fit.degrees_of_freedom = static_cast<double>(design.rows() - columns);
  if (fit.degrees_of_freedom < kMinLeftOver) return std::nullopt;
  Eigen::VectorXd length(columns);
  for (Eigen::Index i = 0; i < columns; ++i) length[i] = design.col(i).norm();
  if (!length.allFinite() || !observed.allFinite() || length.minCoeff() <= 0) return std::nullopt;
  Eigen::MatrixXd unit = design;
  for (Eigen::Index i = 0; i < columns; ++i) unit.col(i) /= length[i];
  const Eigen::MatrixXd normal = unit.transpose() * unit;
  Eigen::MatrixXd inverse =
      geometry::SolveSymmetric(normal, Eigen::MatrixXd::Identity(columns, columns));
  const Eigen::MatrixXd check = normal * inverse - Eigen::MatrixXd::Identity(columns, columns);
  constexpr double kInverted = 1e-3;  // a singular matrix is not inverted, whatever comes back
  if (!inverse.allFinite() || inverse.diagonal().minCoeff() <= 0 ||
      inverse.diagonal().maxCoeff() > kGreatestInverse || check.cwiseAbs().maxCoeff() > kInverted) {
    return std::nullopt;
  }
  const Eigen::VectorXd scaled = inverse * (unit.transpose() * observed);
  const Eigen::VectorXd left = observed - unit * scaled;
  const double variance = left.squaredNorm() / fit.degrees_of_freedom;
  fit.residual = std::sqrt(variance);
  const Eigen::VectorXd back = length.cwiseInverse();
  fit.value = scaled.cwiseProduct(back);
  fit.covariance = variance * (back.asDiagonal() * inverse * back.asDiagonal());
  return fit;
}

double Variance(const LinearFit& fit, const Eigen::VectorXd& gradient) {
  return std::max(0.0, gradient.dot(fit.covariance * gradient));
}

Measured MeasuredFrom(double value, double statistical, double systematic,
                      double degrees_of_freedom) {
  const double u = std::sqrt(statistical + systematic);
  const double half = std::sqrt(Square(StudentT95(degrees_of_freedom)) * statistical +
                                Square(kNormal95) * systematic);
  return Measured::Good({value, u, {value - half, value + half}});
}

namespace {

constexpr int kValues = 10;

CameraScale None(CameraScale scale, const Measured& reason) {
  scale.px_per_mm = scale.rotation_rad = scale.backlash_x_mm = scale.backlash_y_mm = reason;
  return scale;
}

std::optional<LinearFit> Fit(std::span<const SeenMark> marks, double middle_x, double middle_y) {
  const auto count = static_cast<Eigen::Index>(marks.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(2 * count, kValues);
  Eigen::VectorXd observed(2 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SeenMark& mark = marks[static_cast<std::size_t>(i)];
    const double terms[] = {1, mark.head.x_mm - middle_x, mark.head.y_mm - middle_y,
                            0.5 * mark.head.from_x, 0.5 * mark.head.from_y};
    for (int axis = 0; axis < 2; ++axis) {
      for (int term = 0; term < 5; ++term) design(2 * i + axis, 2 * term + axis) = terms[term];
    }
    observed[2 * i] = mark.column_px;
    observed[2 * i + 1] = mark.row_px;
  }
  return FitLinear(design, observed);
}

// Computes the backlash in the picture along the axis' own motion.
Measured Backlash(const LinearFit& fit, int motion, int backlash) {
  const Eigen::Vector2d along = fit.value.segment<2>(motion);
  const double length = along.squaredNorm();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(kValues);
  gradient.segment<2>(backlash) = along / length;
  const double value = along.dot(fit.value.segment<2>(backlash)) / length;
  return MeasuredFrom(value, Variance(fit, gradient), 0, fit.degrees_of_freedom);
}

// Parts of picture_from_bed = -(d picture / d head) that a rotated camera has, and those that it
// cannot have.
struct Shape {
  double cosine, sine;  // scale times these
  double unlike, skew;  // scales of the axes that differ; axes that are not square
  [[nodiscard]] double scale() const { return std::hypot(cosine, sine); }
};

Shape ShapeOf(const Eigen::VectorXd& v) {
  const double xx = -v[2], yx = -v[3], xy = -v[4], yy = -v[5];
  return {(xx - yy) / 2, (xy + yx) / 2, (xx + yy) / 2, (yx - xy) / 2};
}

std::string Fault(const CameraScale& found, const Shape& shape) {
  const double unlike = std::hypot(shape.unlike, shape.skew);
  if (unlike > shape.scale()) {
    return "the picture is mirrored, or an axis of the printer counts backwards: a head that moves "
           "in x and in y moves the plate's picture round the wrong way; switch off the camera's "
           "mirror, or correct the axis' direction";
  }
  if (found.repeat_mm > kMaxRepeat_mm) {
    return fmt::format(
        "the same place does not show the same picture: {:.3f} mm rms where {:.3f} mm are borne; "
        "tighten the camera's mount and the belts",
        found.repeat_mm, kMaxRepeat_mm);
  }
  for (const auto& [name, backlash] :
       {std::pair{"x", &found.backlash_x_mm}, std::pair{"y", &found.backlash_y_mm}}) {
    const double value = std::abs(backlash->quantity().value);
    if (value <= kMaxBacklash_mm) continue;
    return fmt::format(
        "coming from the two sides in {} shows places {:.3f} mm apart where {:.3f} mm are borne: "
        "the camera is loose on the head, or the axis has backlash",
        name, value, kMaxBacklash_mm);
  }
  constexpr double kGreatestUnlike = 0.01;  // the scale's own claim; 8 degrees of tilt
  if (unlike > kGreatestUnlike * shape.scale()) {
    return fmt::format(
        "a millimetre of x and one of y differ by {:.1f} % in the picture: the camera looks "
        "slantwise, or an axis' steps per mm are wrong",
        200 * unlike / shape.scale());
  }
  return {};
}

}  // namespace

CameraScale FitCameraScale(std::span<const SeenMark> marks, double height_uncertainty) {
  CameraScale found;
  for (const SeenMark& mark : marks) {
    found.middle_x_mm += mark.head.x_mm / static_cast<double>(marks.size());
    found.middle_y_mm += mark.head.y_mm / static_cast<double>(marks.size());
  }
  found.fit = Fit(marks, found.middle_x_mm, found.middle_y_mm);
  if (!found.fit) {
    return None(found, Measured::CannotTell(fmt::format(
                           "{} pictures of the mark do not determine scale, rotation and play: "
                           "move in x and in y, and come to places from both sides",
                           marks.size())));
  }
  const LinearFit& fit = *found.fit;
  const Shape shape = ShapeOf(fit.value);
  const double scale = shape.scale();
  constexpr double kSeen = 5;  // standard deviations by which the mark must follow the head
  Eigen::VectorXd to_cosine = Eigen::VectorXd::Zero(kValues);
  Eigen::VectorXd to_sine = Eigen::VectorXd::Zero(kValues);
  to_cosine[2] = -0.5, to_cosine[5] = 0.5, to_sine[3] = to_sine[4] = -0.5;
  const double shape_u = std::sqrt(Variance(fit, to_cosine) + Variance(fit, to_sine));
  const double full = std::hypot(scale, std::hypot(shape.unlike, shape.skew));
  if (!(full > kSeen * shape_u)) {
    return None(found, Measured::Refused("the mark does not follow the head's motion: it was not "
                                         "printed, or something else was taken for it"));
  }
  found.repeat_mm = fit.residual / full;
  found.backlash_x_mm = Backlash(fit, 2, 6);
  found.backlash_y_mm = Backlash(fit, 4, 8);
  const std::string fault = Fault(found, shape);
  if (!fault.empty()) return None(found, Measured::Refused(fault));
  const Eigen::VectorXd to_scale = (shape.cosine * to_cosine + shape.sine * to_sine) / scale;
  const Eigen::VectorXd to_turn = (shape.cosine * to_sine - shape.sine * to_cosine) / Square(scale);
  // Two axes with independent errors: half of their sum. They do not rotate the picture.
  const double relative = Square(kAxisScaleUncertainty) / 2 + Square(height_uncertainty);
  found.px_per_mm = MeasuredFrom(scale, Variance(fit, to_scale), Square(scale) * relative,
                                 fit.degrees_of_freedom);
  found.rotation_rad = MeasuredFrom(std::atan2(shape.sine, shape.cosine), Variance(fit, to_turn), 0,
                                    fit.degrees_of_freedom);
  return found;
}

CameraOffset FindCameraOffset(const CameraScale& scale, const OffsetQuestion& question) {
  if (!scale.px_per_mm.good()) return {scale.px_per_mm, scale.px_per_mm};
  const LinearFit& fit = *scale.fit;
  Eigen::MatrixXd picture_from_head(2, 2);
  picture_from_head << fit.value[2], fit.value[4], fit.value[3], fit.value[5];
  const Eigen::MatrixXd head_from_picture = geometry::Inverse(picture_from_head);
  const Eigen::Vector2d pixel(question.column_px, question.row_px);
  const Eigen::Vector2d from_middle = head_from_picture * (pixel - fit.value.head<2>());
  const double mark[] = {question.mark_x_mm, question.mark_y_mm};
  const double middle[] = {scale.middle_x_mm, scale.middle_y_mm};
  const double backlash[] = {scale.backlash_x_mm.quantity().value,
                             scale.backlash_y_mm.quantity().value};
  CameraOffset offset;
  Measured* const axes[] = {&offset.x_mm, &offset.y_mm};
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d row = head_from_picture.row(axis).transpose();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(fit.value.size());
    gradient.segment<2>(0) = row;
    gradient.segment<2>(2) = row * from_middle[0];
    gradient.segment<2>(4) = row * from_middle[1];
    const double systematic = Square(question.mark_uncertainty_mm) +
                              Square(question.pixel_uncertainty_px) * row.squaredNorm() +
                              Square(backlash[axis]) / 12;
    *axes[axis] = MeasuredFrom(mark[axis] - (middle[axis] + from_middle[axis]),
                               Variance(fit, gradient), systematic, fit.degrees_of_freedom);
  }
  return offset;
}

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

// Returns the parabola's minimum, wherever it is.
std::optional<double> LowestOfParabola(const WidthFit& parabola) {
  if (!parabola.fit || !(parabola.fit->value[2] > 0)) return std::nullopt;
  return parabola.middle_mm - parabola.fit->value[1] / (2 * parabola.fit->value[2]);
}

// Returns the cubic's minimum. With b² < 3ac it has none.
std::optional<double> LowestOfCubic(const WidthFit& cubic) {
  if (!cubic.fit) return std::nullopt;
  const double a = cubic.fit->value[1], b = cubic.fit->value[2], c = cubic.fit->value[3];
  const double root = b * b - 3 * a * c;
  if (!(b > 0) || !(root > 0)) return std::nullopt;
  return cubic.middle_mm - a / (b + std::sqrt(root));
}

// Computes the focus error of two other fits of the same widths from `focus_mm`: a blur that grows
// unequally to the two sides, and only points near the focus, where a halo has another weight. Rms
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
