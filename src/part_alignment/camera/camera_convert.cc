#include "part_alignment/camera/camera_convert.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "part_alignment/camera/camera.h"
#include "part_alignment/network/least_squares.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Line of sight, and its pixel in the camera to be matched.
struct MatchedDirection {
  Vector3d direction;
  Vector2d pixel;
};

constexpr int kDirectionsAcross = 31;
constexpr int kDirectionsDown = 25;

// Returns pixels in even steps over the sensor, with its edges and corners.
std::vector<Vector2d> SensorPixels(int width_px, int height_px) {
  std::vector<Vector2d> pixels;
  for (int row = 0; row < kDirectionsDown; ++row) {
    for (int column = 0; column < kDirectionsAcross; ++column) {
      pixels.emplace_back((width_px - 1.0) * column / (kDirectionsAcross - 1),
                          (height_px - 1.0) * row / (kDirectionsDown - 1));
    }
  }
  return pixels;
}

tl::unexpected<Error> Folds(const Vector2d& pixel) {
  return Fail(fmt::format(
      "the lens has no line of sight for column {:.0f}, row {:.0f}: its distortion folds the "
      "picture there; coefficients of another camera, or of too high an order for its pictures",
      pixel.x(), pixel.y()));
}

// Computes the direction of a pixel in OpenCV's camera: Newton's method from the middle outwards.
std::optional<Vector3d> OpenCvDirection(const OpenCvCamera& camera, const Vector2d& pixel) {
  constexpr int kRounds = 60;
  constexpr double kEnough_px = 1e-11;
  constexpr double kStep = 1e-6;
  Vector3d direction((pixel.x() - camera.cx_px) / camera.fx_px,
                     (pixel.y() - camera.cy_px) / camera.fy_px, 1);
  for (int round = 0; round < kRounds; ++round) {
    const auto at = ProjectOpenCv(camera, direction);
    const auto right = ProjectOpenCv(camera, direction + Vector3d(kStep, 0, 0));
    const auto down = ProjectOpenCv(camera, direction + Vector3d(0, kStep, 0));
    if (!at || !right || !down) return std::nullopt;
    Eigen::Matrix2d slope;
    slope << (*right - *at) / kStep, (*down - *at) / kStep;
    // Beyond a fold the picture runs backwards.
    if (!(slope.determinant() > 0)) return std::nullopt;
    const Vector2d step = slope.inverse() * (pixel - *at);
    direction.head<2>() += step;
    if (!direction.allFinite()) return std::nullopt;
    if ((pixel - *at).norm() < kEnough_px * std::max(1.0, pixel.norm())) return direction;
  }
  return std::nullopt;
}

void MeasureErrors(const std::vector<MatchedDirection>& observations, ConvertedCamera& converted) {
  double sum = 0;
  for (const MatchedDirection& observation : observations) {
    const auto pixel = Project(converted.camera, observation.direction);
    const double error_px = pixel ? (*pixel - observation.pixel).norm() : INFINITY;
    converted.largest_error_px = std::max(converted.largest_error_px, error_px);
    sum += error_px * error_px;
  }
  converted.rms_error_px = std::sqrt(sum / static_cast<double>(observations.size()));
}

// Fits the intrinsic parameters of `start` to `observations`.
Result<ConvertedCamera> FitObservations(const Camera& start,
                                        const std::vector<MatchedDirection>& observations,
                                        double max_error_px) {
  Camera frame = start;  // the observations are in the camera's frame
  frame.taper_from_camera = {};
  const auto with = [&frame](const Eigen::VectorXd& intrinsics) {
    CameraVector parameters = ParametersOf(frame);
    parameters.head<kIntrinsics>() = intrinsics;
    return WithParameters(frame, parameters);
  };
  const auto residuals = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* j) {
    const Camera camera = with(x);
    if (!(camera.focal_length_mm > 0)) return false;
    const auto rows = static_cast<Eigen::Index>(2 * observations.size());
    r.resize(rows);
    if (j != nullptr) j->resize(rows, kIntrinsics);
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const auto projected = ProjectFromTaper(camera, observations[i].direction);
      if (!projected) return false;
      const auto row = static_cast<Eigen::Index>(2 * i);
      r.segment<2>(row) = projected->pixel - observations[i].pixel;
      if (j != nullptr) j->middleRows<2>(row) = projected->by_parameter.leftCols<kIntrinsics>();
    }
    return true;
  };
  const CameraVector first = ParametersOf(frame);
  const LeastSquaresFit fit = FitLeastSquares(residuals, first.head<kIntrinsics>());
  ConvertedCamera converted;
  converted.camera = with(fit.x);
  converted.camera.taper_from_camera = start.taper_from_camera;
  MeasureErrors(observations, converted);
  if (!(converted.largest_error_px <= max_error_px)) {
    return Fail(fmt::format(
        "the nearest camera of the wanted convention (two radial and two tangential coefficients) "
        "is off by up to {:.3g} px (root mean square {:.3g} px), accepted are {:g} px: calibrate "
        "in "
        "that convention, or accept more",
        converted.largest_error_px, converted.rms_error_px, max_error_px));
  }
  return converted;
}

std::optional<std::string> FaultOfOpenCv(const OpenCvCamera& camera) {
  const std::array<std::pair<const char*, double>, 12> numbers{{{"fx", camera.fx_px},
                                                                {"fy", camera.fy_px},
                                                                {"cx", camera.cx_px},
                                                                {"cy", camera.cy_px},
                                                                {"k1", camera.k1},
                                                                {"k2", camera.k2},
                                                                {"p1", camera.p1},
                                                                {"p2", camera.p2},
                                                                {"k3", camera.k3},
                                                                {"k4", camera.k4},
                                                                {"k5", camera.k5},
                                                                {"k6", camera.k6}}};
  for (const auto& [name, value] : numbers) {
    if (!std::isfinite(value)) return fmt::format("{} is not a finite number", name);
  }
  constexpr double kMaxFocal_px = 1e7;
  for (const auto& [name, value] : {numbers[0], numbers[1]}) {
    if (!(value > 0 && value < kMaxFocal_px)) {
      return fmt::format("{} is {} px; it must be above 0 and below {} px", name, value,
                         kMaxFocal_px);
    }
  }
  return std::nullopt;
}

// Converts OpenCV's camera, without k3 … k6 and the difference of fx and fy.
Camera PlainPart(const OpenCvCamera& camera, double pixel_pitch_mm) {
  const double f_px = (camera.fx_px + camera.fy_px) / 2;
  Camera plain;
  plain.convention = CameraConvention::kBrownIdealToDistorted;
  plain.width_px = camera.width_px;
  plain.height_px = camera.height_px;
  plain.pixel_pitch_mm = pixel_pitch_mm;
  plain.focal_length_mm = f_px * pixel_pitch_mm;
  plain.principal_point_offset_px = {camera.cx_px - (camera.width_px - 1) / 2.0,
                                     camera.cy_px - (camera.height_px - 1) / 2.0};
  plain.k1 = camera.k1 / (f_px * f_px);
  plain.k2 = camera.k2 / (f_px * f_px * f_px * f_px);
  plain.p1 = camera.p1 / f_px;
  plain.p2 = camera.p2 / f_px;
  plain.looks_along = LooksAlong::kPlusZ;
  return plain;
}

// Returns a start for the other direction: to first order it is the same polynomial with the
// opposite sign.
Camera Turned(const Camera& camera, CameraConvention convention) {
  Camera turned = camera;
  if (camera.convention == convention) return turned;
  turned.convention = convention;
  turned.k1 = -camera.k1;
  turned.k2 = 0;
  turned.p1 = -camera.p2;
  turned.p2 = -camera.p1;
  return turned;
}

}  // namespace

std::optional<Vector2d> ProjectOpenCv(const OpenCvCamera& camera, const Vector3d& camera_mm) {
  if (!(camera_mm.z() > 0)) return std::nullopt;
  const double x = camera_mm.x() / camera_mm.z();
  const double y = camera_mm.y() / camera_mm.z();
  const double r2 = x * x + y * y;
  const double radial = (1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3))) /
                        (1 + r2 * (camera.k4 + r2 * (camera.k5 + r2 * camera.k6)));
  const Vector2d lens(x * radial + 2 * camera.p1 * x * y + camera.p2 * (r2 + 2 * x * x),
                      y * radial + camera.p1 * (r2 + 2 * y * y) + 2 * camera.p2 * x * y);
  return Vector2d(camera.fx_px * lens.x() + camera.cx_px, camera.fy_px * lens.y() + camera.cy_px);
}

Result<ConvertedCamera> FromOpenCv(const OpenCvCamera& camera, double pixel_pitch_mm,
                                   const ConvertOptions& options) {
  if (const auto fault = FaultOfOpenCv(camera)) return Fail(*fault);
  const Camera plain = PlainPart(camera, pixel_pitch_mm);
  if (const auto fault = FaultOf(plain)) return Fail(*fault);
  const double half_px = std::max(camera.width_px, camera.height_px) / 2.0;
  const double unequal_px = half_px * std::abs(camera.fx_px / camera.fy_px - 1) / 2;
  if (!(unequal_px <= options.max_error_px)) {
    return Fail(fmt::format(
        "the pixels are not square: fx = {} px and fy = {} px differ by {:.3g} px at the picture's "
        "edge, accepted are {:g} px. This camera model has one focal length: calibrate with a "
        "fixed "
        "aspect ratio (OpenCV: CALIB_FIX_ASPECT_RATIO)",
        camera.fx_px, camera.fy_px, unequal_px, options.max_error_px));
  }
  std::vector<MatchedDirection> observations;
  for (const Vector2d& pixel : SensorPixels(camera.width_px, camera.height_px)) {
    const auto direction = OpenCvDirection(camera, pixel);
    if (!direction) return Folds(pixel);
    observations.push_back({*direction, pixel});
  }
  const bool exact = camera.fx_px == camera.fy_px && camera.k3 == 0 && camera.k4 == 0 &&
                     camera.k5 == 0 && camera.k6 == 0 && options.convention == plain.convention;
  if (!exact)
    return FitObservations(Turned(plain, options.convention), observations, options.max_error_px);
  ConvertedCamera converted{plain};
  MeasureErrors(observations, converted);
  return converted;
}

Result<ConvertedCamera> ConvertConvention(const Camera& camera, const ConvertOptions& options) {
  if (const auto fault = FaultOf(camera)) return Fail(*fault);
  if (camera.convention == options.convention) return ConvertedCamera{camera};
  std::vector<MatchedDirection> observations;
  for (const Vector2d& pixel : SensorPixels(camera.width_px, camera.height_px)) {
    const auto direction = LineOfSight(camera, pixel);
    if (!direction) return Folds(pixel);
    observations.push_back({*direction, pixel});
  }
  return FitObservations(Turned(camera, options.convention), observations, options.max_error_px);
}

Camera TableOneCamera() {
  Camera camera;
  camera.convention = CameraConvention::kBrownMeasuredToIdeal;
  camera.width_px = 2592;
  camera.height_px = 1944;
  camera.pixel_pitch_mm = 0.0022;
  camera.focal_length_mm = 6.189;
  camera.principal_point_offset_px = {-8.732, 27.52};
  camera.k1 = 2.997e-8;
  camera.k2 = -1.937e-15;
  camera.p1 = -6.188e-8;
  camera.p2 = 3.408e-7;
  camera.looks_along = LooksAlong::kMinusZ;
  camera.taper_from_camera.translation_mm = {-2.139, 0.301, -320.3};
  camera.taper_from_camera.angles_rad = {-0.003, -0.009, 0.03};
  return camera;
}

}  // namespace trammel::part_alignment
