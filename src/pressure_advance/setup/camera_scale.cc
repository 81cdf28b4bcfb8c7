#include "pressure_advance/setup/camera_scale.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

#include "base/square.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kValues = 10;

CameraScale None(CameraScale scale, const Measured& reason) {
  scale.px_per_mm = scale.rotation_rad = scale.play_x_mm = scale.play_y_mm = reason;
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

// Of the play's picture the part along that of the axis' own motion.
Measured Play(const LinearFit& fit, int motion, int play) {
  const Eigen::Vector2d along = fit.value.segment<2>(motion);
  const double length = along.squaredNorm();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(kValues);
  gradient.segment<2>(play) = along / length;
  const double value = along.dot(fit.value.segment<2>(play)) / length;
  return MeasuredFrom(value, Variance(fit, gradient), 0, fit.degrees_of_freedom);
}

// Parts of picture_from_bed = -(d picture / d head) that a turned camera has, and those it has not.
struct Shape {
  double cosine, sine;  // scale times these
  double unlike, skew;  // scales of the axes that differ; axes that are not square
  [[nodiscard]] double scale() const { return std::hypot(cosine, sine); }
};

Shape ShapeOf(const Eigen::VectorXd& v) {
  const double xx = -v[2], yx = -v[3], xy = -v[4], yy = -v[5];
  return {(xx - yy) / 2, (xy + yx) / 2, (xx + yy) / 2, (yx - xy) / 2};
}

std::string Fault(const CameraScale& found, const Shape& shape, const SetupLimits& limits) {
  const double unlike = std::hypot(shape.unlike, shape.skew);
  if (unlike > shape.scale()) {
    return "the picture is mirrored, or an axis of the printer counts backwards: a head that moves "
           "in x and in y moves the plate's picture round the wrong way; switch off the camera's "
           "mirror, or correct the axis' direction";
  }
  if (found.repeat_mm > limits.repeat_mm) {
    return fmt::format(
        "the same place does not show the same picture: {:.3f} mm rms where {:.3f} mm are borne; "
        "tighten the camera's mount and the belts",
        found.repeat_mm, limits.repeat_mm);
  }
  for (const auto& [name, play] :
       {std::pair{"x", &found.play_x_mm}, std::pair{"y", &found.play_y_mm}}) {
    const double value = std::abs(play->quantity().value);
    if (value <= limits.play_mm) continue;
    return fmt::format(
        "coming from the two sides in {} shows places {:.3f} mm apart where {:.3f} mm are borne: "
        "the camera is loose on the head, or the axis has backlash",
        name, value, limits.play_mm);
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

CameraScale FitCameraScale(std::span<const SeenMark> marks, const SetupLimits& limits,
                           double height_uncertainty) {
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
  found.play_x_mm = Play(fit, 2, 6);
  found.play_y_mm = Play(fit, 4, 8);
  const std::string fault = Fault(found, shape, limits);
  if (!fault.empty()) return None(found, Measured::Refused(fault));
  const Eigen::VectorXd to_scale = (shape.cosine * to_cosine + shape.sine * to_sine) / scale;
  const Eigen::VectorXd to_turn = (shape.cosine * to_sine - shape.sine * to_cosine) / Square(scale);
  // Two axes, each with an error of its own: half of their sum. They do not turn the picture.
  const double relative = Square(limits.axis_scale_uncertainty) / 2 + Square(height_uncertainty);
  found.px_per_mm = MeasuredFrom(scale, Variance(fit, to_scale), Square(scale) * relative,
                                 fit.degrees_of_freedom);
  found.rotation_rad = MeasuredFrom(std::atan2(shape.sine, shape.cosine), Variance(fit, to_turn), 0,
                                    fit.degrees_of_freedom);
  return found;
}

}  // namespace trammel::pressure_advance
