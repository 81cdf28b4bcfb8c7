#include "part_alignment/camera/calibrate.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/camera/calibrate_start.h"
#include "part_alignment/network/least_squares.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kMinViews = 12;  // 24 equations for 13 numbers
constexpr double kWrongSigma = 5;      // a view beyond it is taken for wrong

// View for the fit: a place in the taper frame and the whitener of its residual.
struct Sample {
  Vector3d taper_mm;
  Vector2d pixel;
  Matrix2d whiten;  ///< covariance^(-1/2)
  double sigma_px = 0;
};

Matrix2d Whitening(const Matrix2d& covariance) {
  return geometry::SolveLower(geometry::CholeskyRoot(covariance), Matrix2d::Identity());
}

std::optional<std::string> FaultOfGrid(const GridMeasurement& grid) {
  Camera camera = grid.camera;
  camera.focal_length_mm = 1;  // is measured
  if (auto fault = FaultOf(camera)) return fault;
  constexpr double kMaxPlace_mm = 1e6;
  const auto there = [](const auto& v) { return v.allFinite() && v.norm() < kMaxPlace_mm; };
  const auto sigma = [](double s) { return s >= 0 && s < 1e3; };
  if (!there(grid.cmm_from_taper.translation_mm) || !grid.cmm_from_taper.angles_rad.allFinite()) {
    return "cmm_from_taper has a number that is not finite or too large";
  }
  if (!there(grid.target_from_tip_mm)) {
    return "target_from_tip has a number that is not finite or too large";
  }
  bool sound = sigma(grid.position_sigma_mm);
  for (const double s : grid.taper_sigma) sound = sound && sigma(s);
  for (const double s : grid.target_from_tip_sigma_mm) sound = sound && sigma(s);
  if (!sound)
    return "an uncertainty of the taper, of the target or of the places is below 0 or none";
  for (std::size_t i = 0; i < grid.views.size(); ++i) {
    const GridView& view = grid.views[i];
    if (!there(view.tip_mm) || !std::isfinite(view.column_px) || !std::isfinite(view.row_px) ||
        !(view.sigma_px > 0 && view.sigma_px < 1e3)) {
      return fmt::format(
          "view {}: tip {} {} {} mm, column {}, row {}, sigma {} px: numbers must be finite, sigma "
          "above 0",
          i + 1, view.tip_mm.x(), view.tip_mm.y(), view.tip_mm.z(), view.column_px, view.row_px,
          view.sigma_px);
    }
  }
  return std::nullopt;
}

std::vector<Sample> SamplesOf(const GridMeasurement& grid) {
  const Eigen::Matrix3d taper_from_cmm =
      geometry::RotationFromAngles(grid.cmm_from_taper.angles_rad).transpose();
  std::vector<Sample> samples;
  for (const GridView& view : grid.views) {
    const Vector3d cmm_mm = view.tip_mm + grid.target_from_tip_mm;
    samples.push_back({taper_from_cmm * (cmm_mm - grid.cmm_from_taper.translation_mm),
                       {view.column_px, view.row_px},
                       Matrix2d::Identity() / view.sigma_px,
                       view.sigma_px});
  }
  return samples;
}

LeastSquaresFit FitCamera(const Camera& start, const std::vector<Sample>& samples,
                          const std::vector<std::size_t>& used) {
  const auto rows = static_cast<Eigen::Index>(2 * used.size());
  const auto function = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* j) {
    const Camera camera = WithParameters(start, x);
    if (!(camera.focal_length_mm > 0)) return false;
    r.resize(rows);
    if (j != nullptr) j->resize(rows, kCameraParameters);
    Eigen::Index row = 0;
    for (const std::size_t i : used) {
      const auto projected = ProjectFromTaper(camera, samples[i].taper_mm);
      if (!projected) return false;
      r.segment<2>(row) = samples[i].whiten * (projected->pixel - samples[i].pixel);
      if (j != nullptr) j->middleRows<2>(row) = samples[i].whiten * projected->by_parameter;
      row += 2;
    }
    return true;
  };
  return FitLeastSquares(function, ParametersOf(start));
}

// Adds the uncertainty of a place, as pixels, to that of the picture.
void JoinPlaceUncertainty(const Camera& camera, double position_sigma_mm,
                          const GridMeasurement& grid, std::vector<Sample>& samples) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto projected = ProjectFromTaper(camera, samples[i].taper_mm);
    if (!projected) continue;
    const Eigen::Matrix<double, 2, 3> by_place = projected->by_taper * position_sigma_mm;
    const double sigma_px = grid.views[i].sigma_px;
    const Matrix2d covariance =
        by_place * by_place.transpose() + sigma_px * sigma_px * Matrix2d::Identity();
    samples[i].whiten = Whitening(covariance);
    samples[i].sigma_px = std::sqrt(covariance.trace() / 2);
  }
}

double WhitenedError(const Camera& camera, const Sample& sample) {
  const auto projected = ProjectFromTaper(camera, sample.taper_mm);
  if (!projected) return std::numeric_limits<double>::infinity();
  return (sample.whiten * (projected->pixel - sample.pixel)).norm();
}

// Drops views that do not fit the rest, the worst first; false if there are too many.
bool DropWrongViews(const std::vector<Sample>& samples, Camera& camera,
                    std::vector<std::size_t>& used) {
  const std::size_t least =
      samples.size() -
      static_cast<std::size_t>(std::ceil(kMaxRejected * static_cast<double>(samples.size())));
  while (true) {
    std::vector<double> errors;
    for (const std::size_t i : used) errors.push_back(WhitenedError(camera, samples[i]));
    // The median of the length of two standard normal numbers is 1.177.
    const double scale = std::max(1.0, Median(errors) / 1.177);
    const auto worst = std::max_element(errors.begin(), errors.end());
    if (!(*worst > kWrongSigma * scale)) return true;
    if (used.size() <= least) return false;
    // Drops all that are about as wrong at once: one by one would need as many fits.
    const double limit = std::max(kWrongSigma * scale, *worst / 2);
    std::vector<std::size_t> kept;
    for (std::size_t k = 0; k < used.size(); ++k) {
      if (!(errors[k] > limit)) kept.push_back(used[k]);
    }
    if (kept.size() < least) return false;
    used = std::move(kept);
    const LeastSquaresFit fit = FitCamera(camera, samples, used);
    if (fit.converged) camera = WithParameters(camera, fit.x);
  }
}

// Computes taper_from_camera for a target or taper elsewhere than stated. The views fix the camera
// in the measuring machine's frame, so taper_from_camera follows them.
Eigen::Matrix<double, 6, 1> TaperFromCamera(const Eigen::Matrix3d& cmm_from_camera,
                                            const Vector3d& camera_in_cmm_mm,
                                            const geometry::Pose& cmm_from_taper) {
  const Eigen::Matrix3d taper_from_cmm =
      geometry::RotationFromAngles(cmm_from_taper.angles_rad).transpose();
  Eigen::Matrix<double, 6, 1> pose;
  pose << taper_from_cmm * (camera_in_cmm_mm - cmm_from_taper.translation_mm),
      geometry::AnglesFromRotation(taper_from_cmm * cmm_from_camera);
  return pose;
}

// Computes the covariance that the probed taper and the target's position on its tip add. No view
// determines either; both shift and turn the camera in its taper.
CameraCovariance CovarianceOfSetUp(const GridMeasurement& grid, const Camera& camera) {
  const Eigen::Matrix3d cmm_from_taper =
      geometry::RotationFromAngles(grid.cmm_from_taper.angles_rad);
  const Eigen::Matrix3d cmm_from_camera =
      cmm_from_taper * geometry::RotationFromAngles(camera.taper_from_camera.angles_rad);
  const Vector3d in_cmm_mm =
      cmm_from_taper * camera.taper_from_camera.translation_mm + grid.cmm_from_taper.translation_mm;
  Eigen::Matrix<double, 6, 9> by_sigma;  // columns: taper, target; each times its sigma
  constexpr double kStep = 1e-5;         // mm and rad
  for (int i = 0; i < 9; ++i) {
    std::array<Eigen::Matrix<double, 6, 1>, 2> pose;
    for (const int side : {0, 1}) {
      geometry::Pose taper = grid.cmm_from_taper;
      Vector3d moved_mm = in_cmm_mm;
      const double step = side == 0 ? -kStep : kStep;
      if (i < 3) taper.translation_mm[i] += step;
      if (i >= 3 && i < 6) taper.angles_rad[i - 3] += step;
      if (i >= 6) moved_mm[i - 6] += step;
      pose[static_cast<std::size_t>(side)] = TaperFromCamera(cmm_from_camera, moved_mm, taper);
    }
    const double sigma = i < 6 ? grid.taper_sigma[i] : grid.target_from_tip_sigma_mm[i - 6];
    by_sigma.col(i) = (pose[1] - pose[0]) / (2 * kStep) * sigma;
  }
  CameraCovariance covariance = CameraCovariance::Zero();
  covariance.bottomRightCorner<6, 6>() = by_sigma.lazyProduct(by_sigma.transpose());
  return covariance;
}

double AlongAxis(const Camera& camera, const Vector3d& taper_mm) {
  const geometry::Pose& pose = camera.taper_from_camera;
  return std::abs(
      geometry::RotationFromAngles(pose.angles_rad).col(2).dot(taper_mm - pose.translation_mm));
}

// Groups views of one distance, separated by gaps of the distances.
std::vector<std::vector<std::size_t>> PlanesOf(const Camera& camera,
                                               const std::vector<Sample>& samples,
                                               std::vector<std::size_t> used) {
  const auto distance = [&](std::size_t i) { return AlongAxis(camera, samples[i].taper_mm); };
  std::sort(used.begin(), used.end(),
            [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
  constexpr double kGap = 1.0 / 25;  // fraction of the grid's depth
  const double gap_mm = kGap * (distance(used.back()) - distance(used.front()));
  std::vector<std::vector<std::size_t>> planes;
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (k == 0 || distance(used[k]) - distance(used[k - 1]) > gap_mm) planes.emplace_back();
    planes.back().push_back(used[k]);
  }
  return planes;
}

std::vector<HeldOutPlane> CrossValidate(const Camera& camera, const std::vector<Sample>& samples,
                                        const std::vector<std::size_t>& used) {
  const auto planes = PlanesOf(camera, samples, used);
  std::vector<HeldOutPlane> held_out;
  if (planes.size() < 3) return held_out;  // the remainder would be one plane
  for (const auto& plane : planes) {
    std::vector<std::size_t> rest;
    std::copy_if(used.begin(), used.end(), std::back_inserter(rest), [&](std::size_t i) {
      return std::find(plane.begin(), plane.end(), i) == plane.end();
    });
    if (rest.size() < kMinViews) continue;
    const LeastSquaresFit fit = FitCamera(camera, samples, rest);
    if (!fit.converged) continue;
    const Camera other = WithParameters(camera, fit.x);
    const Eigen::MatrixXd covariance = InvertNormal(fit.jacobian).covariance;
    HeldOutPlane result;
    double sum_px = 0;
    double sum_sigma = 0;
    for (const std::size_t i : plane) {
      const auto projected = ProjectFromTaper(other, samples[i].taper_mm);
      if (!projected) continue;
      const Vector2d error_px = samples[i].pixel - projected->pixel;
      const Matrix2d expected = (samples[i].whiten.transpose() * samples[i].whiten).inverse() +
                                geometry::PropagateCovariance(projected->by_parameter, covariance);
      result.distance_mm += AlongAxis(other, samples[i].taper_mm);
      sum_px += error_px.squaredNorm();
      sum_sigma += geometry::SquaredMahalanobisDistance(expected, error_px);
      ++result.views;
    }
    if (result.views == 0) continue;
    result.distance_mm /= result.views;
    result.rms_px = std::sqrt(sum_px / (2 * result.views));
    result.rms_sigma = std::sqrt(sum_sigma / (2 * result.views));
    held_out.push_back(result);
  }
  return held_out;
}

// Names the parameters that share the weakest direction.
std::string WeakestText(const Eigen::VectorXd& weakest) {
  constexpr double kShare = 0.3;
  std::string words;
  for (int i = 0; i < kCameraParameters; ++i) {
    if (std::abs(weakest[i]) < kShare) continue;
    words += (words.empty() ? "" : ", ") +
             std::string(kCameraParameterNames[static_cast<std::size_t>(i)]);
  }
  return words;
}

void NoteResiduals(const GridMeasurement& grid, const std::vector<Sample>& samples,
                   const std::vector<std::size_t>& used, CameraCalibration& result) {
  double sum_px = 0;
  double sum_sigma = 0;
  result.nearest_mm = std::numeric_limits<double>::infinity();
  RejectionTally tally;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto projected = ProjectFromTaper(result.camera, samples[i].taper_mm);
    const Vector2d error_px = projected ? Vector2d(samples[i].pixel - projected->pixel)
                                        : Vector2d::Constant(std::nan(""));
    const bool kept = std::binary_search(used.begin(), used.end(), i);
    result.residuals.push_back({error_px.x(), error_px.y(), samples[i].sigma_px, kept});
    tally.Add({fmt::format("view {}", i + 1)}, !kept);
    if (!kept) {
      result.notices.push_back(
          fmt::format("view {} (column {:.1f}, row {:.1f}) is {:.3g} px beside where the others "
                      "put it, and was "
                      "left out",
                      i + 1, grid.views[i].column_px, grid.views[i].row_px, error_px.norm()));
      continue;
    }
    sum_px += error_px.squaredNorm();
    sum_sigma += (samples[i].whiten * error_px).squaredNorm();
    const double distance_mm = AlongAxis(result.camera, samples[i].taper_mm);
    result.nearest_mm = std::min(result.nearest_mm, distance_mm);
    result.farthest_mm = std::max(result.farthest_mm, distance_mm);
  }
  const auto equations = static_cast<int>(2 * used.size());
  result.degrees_of_freedom = equations - kCameraParameters;
  result.check = tally.Check(result.degrees_of_freedom);
  result.residual_rms_px = std::sqrt(sum_px / equations);
  result.residual_rms_sigma = std::sqrt(sum_sigma / result.degrees_of_freedom);
}

void NoteMisfit(CameraCalibration& result) {
  // Four standard deviations of the root mean square of as many normal numbers.
  const double expected = 4 / std::sqrt(2.0 * result.degrees_of_freedom);
  if (result.residual_rms_sigma > 1 + expected) {
    result.notices.push_back(fmt::format(
        "residuals are {:.2f} times the stated sigmas: the covariance was widened accordingly; "
        "check sigma_px, the places' uncertainty and the lens model",
        result.residual_rms_sigma));
  } else if (result.residual_rms_sigma < 1 - expected) {
    result.notices.push_back(fmt::format(
        "residuals are {:.2f} times the stated sigmas: they are stated too large, and so is the "
        "covariance",
        result.residual_rms_sigma));
  }
  constexpr double kForetold = 1.5;
  for (const HeldOutPlane& plane : result.cross_validation) {
    if (plane.rms_sigma > kForetold * std::max(1.0, result.residual_rms_sigma)) {
      result.notices.push_back(
          fmt::format("the plane at {:.0f} mm is foretold by the others only to {:.3f} px, {:.1f} "
                      "times what is "
                      "expected: the lens model or a plane's places are not right",
                      plane.distance_mm, plane.rms_px, plane.rms_sigma));
    }
  }
}

CameraCalibration SetVerdict(Verdict verdict, std::string reason) {
  CameraCalibration result;
  result.verdict = verdict;
  result.reason = std::move(reason);
  return result;
}

CameraCalibration ReportStartFault(const CameraStart& start) {
  if (start.fault == StartFault::kFlat) {
    return SetVerdict(
        Verdict::kCannotTell,
        fmt::format("all places lie within {:.2g} mm of one plane: the focal length and the "
                    "camera's distance (z_mm) cannot be told apart; add planes at other "
                    "distances",
                    start.flatness_mm));
  }
  const bool plus = start.camera.looks_along == LooksAlong::kPlusZ;
  return SetVerdict(
      Verdict::kRefused,
      fmt::format("the pictures are the mirror image of what a camera that looks along {} "
                  "sees: say looks_along \"{}\", or count rows from the other edge",
                  plus ? "+z" : "-z", plus ? "-z" : "+z"));
}

}  // namespace

std::optional<std::string> NoticeOfCoverage(const Camera& camera, const char* what,
                                            double seen_px) {
  constexpr double kEnough = 0.9;
  double corner_px = 0;
  for (const double column : {0.0, camera.width_px - 1.0}) {
    for (const double row : {0.0, camera.height_px - 1.0}) {
      corner_px = std::max(corner_px, (Vector2d(column, row) - PrincipalPoint(camera)).norm());
    }
  }
  if (seen_px >= kEnough * corner_px) return std::nullopt;
  return fmt::format(
      "no {} is farther than {:.0f} px from the principal point, the corner is {:.0f} px away: do "
      "not measure outside, the lens is extrapolated there",
      what, seen_px, corner_px);
}

Result<CameraCalibration> CalibrateCamera(const GridMeasurement& grid,
                                          const CalibrateOptions& options) {
  if (const auto fault = FaultOfGrid(grid)) return Fail(*fault);
  if (grid.views.size() < kMinViews) {
    return SetVerdict(Verdict::kCannotTell,
                      fmt::format("{} views; at least {} are needed, in several planes",
                                  grid.views.size(), kMinViews));
  }
  std::vector<Sample> samples = SamplesOf(grid);
  std::vector<Vector3d> places;
  std::vector<Vector2d> pixels;
  for (const Sample& sample : samples) {
    places.push_back(sample.taper_mm);
    pixels.push_back(sample.pixel);
  }
  const CameraStart start = StartCamera(grid.camera, places, pixels);
  if (start.fault != StartFault::kNone) return ReportStartFault(start);
  std::vector<std::size_t> used(samples.size());
  std::iota(used.begin(), used.end(), std::size_t{0});
  LeastSquaresFit fit = FitCamera(start.camera, samples, used);
  if (!fit.converged) {
    return SetVerdict(Verdict::kRefused,
                      "no camera of this model fits the views: check that pixels and places belong "
                      "together, the unit of the places, and the model's convention");
  }
  Camera camera = WithParameters(start.camera, fit.x);
  JoinPlaceUncertainty(camera, grid.position_sigma_mm, grid, samples);
  const bool few_wrong = DropWrongViews(samples, camera, used);
  fit = FitCamera(camera, samples, used);
  CameraCalibration result;
  result.camera = WithParameters(camera, fit.x);
  const JacobianInverse inverse = InvertNormal(fit.jacobian);
  NoteResiduals(grid, samples, used, result);
  const double widened = std::max(1.0, result.residual_rms_sigma);
  result.scatter = inverse.covariance * (widened * widened);
  result.covariance = result.scatter + CovarianceOfSetUp(grid, result.camera);
  const double focal = std::sqrt(result.scatter(0, 0)) / result.camera.focal_length_mm;
  if (!fit.converged || !few_wrong || result.residual_rms_sigma > options.max_residual_sigma) {
    result.verdict = Verdict::kRefused;
    result.reason = fmt::format(
        "the views do not fit one camera: residuals are {:.3g} px, {:.1f} times the stated sigmas "
        "(at most {:g}){}; check places, pixels and the model's convention",
        result.residual_rms_px, result.residual_rms_sigma, options.max_residual_sigma,
        few_wrong ? ""
                  : fmt::format(", and more than {:.0f} % of them stand out", 100 * kMaxRejected));
    return result;
  }
  if (!(focal <= options.max_focal_uncertainty)) {
    result.verdict = Verdict::kCannotTell;
    result.reason = fmt::format(
        "the focal length is known only to {:.2g} of itself (k = 1, at most {:g}): {} cannot be "
        "told apart; add planes at other distances and places towards the picture's corners",
        focal, options.max_focal_uncertainty, WeakestText(inverse.weakest));
    return result;
  }
  result.verdict = Verdict::kGood;
  result.cross_validation = CrossValidate(result.camera, samples, used);
  if (result.cross_validation.empty()) {
    result.notices.push_back("fewer than three planes: nothing could be held out to foretell");
  }
  double seen_px = 0;
  for (const std::size_t i : used) {
    seen_px = std::max(seen_px, (samples[i].pixel - PrincipalPoint(result.camera)).norm());
  }
  if (auto notice = NoticeOfCoverage(result.camera, "view", seen_px)) {
    result.notices.push_back(std::move(*notice));
  }
  NoteMisfit(result);
  return result;
}

}  // namespace trammel::part_alignment
