#include "pressure_advance/setup/camera_offset.h"

#include "base/square.h"
#include "geometry/linear_systems.h"

namespace trammel::pressure_advance {

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
  const double play[] = {scale.play_x_mm.quantity().value, scale.play_y_mm.quantity().value};
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
                              Square(play[axis]) / 12;
    *axes[axis] = MeasuredFrom(mark[axis] - (middle[axis] + from_middle[axis]),
                               Variance(fit, gradient), systematic, fit.degrees_of_freedom);
  }
  return offset;
}

}  // namespace trammel::pressure_advance
