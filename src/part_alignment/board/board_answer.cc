#include "part_alignment/board/board_answer.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/targets/eccentricity.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Frame with the board's plane as x and y, z to the spindle's side.
struct BoardPlane {
  Vector3d middle = Vector3d::Zero();
  Matrix3d axes = Matrix3d::Identity();  ///< columns, in the machine
};

BoardPlane PlaneOf(const BoardNetwork& network, const BoardState& state) {
  const std::vector<bool> seen = SeenMarks(network);
  const auto count = static_cast<double>(std::count(seen.begin(), seen.end(), true));
  BoardPlane plane;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) plane.middle += state.marks_mm[i] / count;
  }
  Matrix3d squares = Matrix3d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    const Vector3d from = state.marks_mm[i] - plane.middle;
    squares += from * from.transpose();
  }
  Vector3d normal = geometry::DecomposeSymmetric(squares).vectors.col(0);
  if (normal.dot(network.machine_from_spindle.col(2)) < 0) normal = -normal;
  const Vector3d x = geometry::DecomposeSymmetric(squares).vectors.col(2);
  plane.axes << x, normal.cross(x), normal;
  return plane;
}

// Computes the normals of bent paper, from a quadratic surface through all marks.
std::vector<Vector3d> NormalsOf(const BoardNetwork& network, const BoardState& state) {
  const std::vector<bool> seen = SeenMarks(network);
  const BoardPlane plane = PlaneOf(network, state);
  const auto count = std::count(seen.begin(), seen.end(), true);
  std::vector<Vector3d> normals(network.marks, plane.axes.col(2));
  constexpr int kEnough = 12;
  if (count < kEnough) return normals;
  MatrixXd rows(count, 6);
  VectorXd heights(count);
  Index row = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    const Vector3d at = plane.axes.transpose() * (state.marks_mm[i] - plane.middle);
    rows.row(row) << 1, at.x(), at.y(), at.x() * at.x(), at.x() * at.y(), at.y() * at.y();
    heights[row++] = at.z();
  }
  const VectorXd c = geometry::SolveLeastSquares(rows, heights);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    const Vector3d at = plane.axes.transpose() * (state.marks_mm[i] - plane.middle);
    const Vector3d normal(-(c[1] + 2 * c[3] * at.x() + c[4] * at.y()),
                          -(c[2] + c[4] * at.x() + 2 * c[5] * at.y()), 1);
    normals[i] = plane.axes * normal.normalized();
  }
  return normals;
}

struct CameraFrame {
  Matrix3d camera_from_machine;
  Vector3d origin_mm;  ///< machine frame
};

CameraFrame FrameOfCamera(const BoardNetwork& network, const BoardState& state,
                          std::size_t station) {
  const StationFrame frame = FrameOf(network, state, station);
  const geometry::Pose& pose = state.camera.taper_from_camera;
  const Matrix3d camera_from_taper = geometry::RotationFromAngles(pose.angles_rad).transpose();
  return {camera_from_taper * frame.taper_from_machine,
          frame.actual_mm + frame.taper_from_machine.transpose() * pose.translation_mm};
}

// Disc of a mark in the frame of the camera that sees it.
struct SeenDisc {
  Vector3d centre_mm;
  Vector3d normal;
};
SeenDisc SeenDiscOf(const BoardNetwork& network, const BoardState& state,
                    const std::vector<Vector3d>& normals, const NetworkObservation& observation) {
  const CameraFrame camera = FrameOfCamera(network, state, observation.station);
  return {camera.camera_from_machine * (state.marks_mm[observation.point] - camera.origin_mm),
          camera.camera_from_machine * normals[observation.point]};
}

// Explains why a mark's position is omitted: its code was misread in too many pictures.
std::vector<std::string> DoubtsOfMarks(const BoardWork& work, const std::vector<int>& counts) {
  const BoardNetwork& network = work.pieces.network;
  constexpr double kMaxRejected = 0.25;  // a mark's own: few enough, and the rest holds its place
  std::vector<int> rejected(network.marks, 0);
  for (std::size_t i = 0; i < work.rejected.size(); ++i) {
    if (work.rejected[i]) ++rejected[network.observations[i].point];
  }
  std::vector<std::string> doubts(network.marks);
  for (std::size_t i = 0; i < network.marks; ++i) {
    const int all = counts[i] + rejected[i];
    if (rejected[i] <= kMaxRejected * all) continue;
    doubts[i] = fmt::format(
        "mark {} is not given: {} of the {} pictures that show it put it elsewhere; see that no "
        "other mark has its code",
        work.pieces.ids[i], rejected[i], all);
  }
  return doubts;
}

void NoteMarks(const BoardWork& work, BoardCalibration& result) {
  const BoardNetwork& network = work.pieces.network;
  const std::vector<bool> seen = SeenMarks(network);
  std::vector<double> squares(network.marks, 0);
  std::vector<int> counts(network.marks, 0);
  std::vector<double> of_view(network.stations.size(), 0);
  std::vector<int> in_view(network.stations.size(), 0);
  result.nearest_mm = std::numeric_limits<double>::infinity();
  result.farthest_mm = 0;
  double sum = 0;
  int all = 0;
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    const auto residual = ResidualOf(network, work.state, observation);
    if (!residual) continue;
    squares[observation.point] += residual->squaredNorm();
    of_view[observation.station] += residual->squaredNorm();
    sum += residual->squaredNorm();
    ++counts[observation.point];
    ++in_view[observation.station];
    ++all;
    const CameraFrame camera = FrameOfCamera(network, work.state, observation.station);
    const double distance = std::abs(
        (camera.camera_from_machine * (work.state.marks_mm[observation.point] - camera.origin_mm))
            .z());
    result.nearest_mm = std::min(result.nearest_mm, distance);
    result.farthest_mm = std::max(result.farthest_mm, distance);
  }
  const std::vector<std::string> doubts = DoubtsOfMarks(work, counts);
  for (std::size_t i = 0; i < network.marks; ++i) {
    if (!seen[i]) continue;
    if (!doubts[i].empty()) {
      result.notices.push_back(doubts[i]);
      continue;
    }
    result.marks.push_back({work.pieces.ids[i], work.state.marks_mm[i], counts[i],
                            std::sqrt(squares[i] / (2.0 * std::max(1, counts[i])))});
  }
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    BoardViewResult& view = result.views[i];
    view.used = network.stations[i].used;
    view.off_mm = work.state.off_mm[i];
    view.rms_px = std::sqrt(of_view[i] / (2.0 * std::max(1, in_view[i])));
  }
  result.residual_rms_px = std::sqrt(sum / (2.0 * std::max(1, all)));
}

// Returns the ratio of the sheet's size in machine lengths to its printed size; absent if unknown.
std::optional<double> LengthRatio(const BoardWork& work, const BoardCalibration& result) {
  if (result.print) return std::sqrt(result.print->scale_right * result.print->scale_up);
  if (work.measurement->disc_radius_mm > 0 && work.disc_radius_mm > 0) {
    return work.disc_radius_mm / work.measurement->disc_radius_mm;
  }
  return std::nullopt;
}

// Checks lengths across the spindle; true if it refuses them.
bool RefuseLengths(const BoardWork& work, BoardCalibration& result) {
  const auto ratio = LengthRatio(work, result);
  if (!ratio) {
    result.notices.push_back(
        "no layout of the sheet and no disc's size is given: the unit of the places was checked by "
        "nothing");
    return false;
  }
  constexpr double kPrinted = 0.02;  // no printer is that far off
  if (std::abs(*ratio - 1) > kPrinted) {
    result.verdict = Verdict::kRefused;
    result.reason = fmt::format(
        "the sheet is {:.4g} times as large in the machine's lengths as it was meant to be{}: the "
        "unit of the places is wrong (mm are meant), or the sheet was printed with another scale, "
        "or is another one",
        *ratio, work.measurement->layout.empty() ? " (by its discs)" : "");
    return true;
  }
  constexpr double kNotice = 0.005;
  if (result.print && std::max(std::abs(result.print->scale_right - 1),
                               std::abs(result.print->scale_up - 1)) > kNotice) {
    result.notices.push_back(fmt::format(
        "the sheet was printed {:.2f} % by {:.2f} % of its size: the printer scales, which does no "
        "harm here, as the print is not trusted",
        100 * result.print->scale_right, 100 * result.print->scale_up));
  }
  return false;
}

// The focal length scales with the unit along the spindle: only the lens itself reveals a wrong
// one.
bool RefuseFocal(const BoardWork& work, BoardCalibration& result) {
  const double found_mm = work.state.camera.focal_length_mm;
  const double wide_mm = work.state.camera.pixel_pitch_mm *
                         std::hypot(work.state.camera.width_px, work.state.camera.height_px);
  const double lens_mm = work.measurement->lens_focal_length_mm;
  constexpr double kLens = 0.2;     // engraved lengths are rounded, and hold at infinity
  constexpr double kWidest = 0.25;  // focal length per diagonal: 127 degrees
  std::string words;
  if (lens_mm > 0 && std::abs(found_mm / lens_mm - 1) > kLens) {
    words = fmt::format("the focal length would be {:.4g} mm, and the lens has {:.4g} mm", found_mm,
                        lens_mm);
  } else if (found_mm < kWidest * wide_mm) {
    words = fmt::format(
        "the focal length would be {:.3g} mm with a picture of {:.3g} mm, which no "
        "lens of this model has",
        found_mm, wide_mm);
  }
  if (words.empty()) {
    if (lens_mm > 0) return false;
    result.notices.push_back(
        fmt::format("no picture tells the focal length from the unit along the spindle: see that "
                    "the lens is one of {:.2g} mm",
                    found_mm));
    return false;
  }
  result.verdict = Verdict::kRefused;
  result.reason = words + ": the unit of Z is wrong (inches where mm are meant), or pixel_pitch_mm";
  return true;
}

std::string Micrometres(double mm) { return fmt::format("{:.3g} um", 1e3 * mm); }

void NamePlace(const BoardWork& work, BoardCalibration& result) {
  const bool prior = work.measurement->place.has_value();
  const CameraCovariance& covariance = result.covariance;
  NullDirection along{"the camera's place along the spindle's axis", "",
                      "touching a mark in Z with a tool of known length", std::nullopt, "mm"};
  if (work.told.touched_along) {
    along.taken_from = fmt::format("touched marks and the tool's length ({})",
                                   Micrometres(work.measurement->tool_length_sigma_mm));
  } else if (prior) {
    along.taken_from = "what was stated of the camera's place";
  }
  if (!along.taken_from.empty()) along.sigma = std::sqrt(covariance(9, 9));
  result.null_directions.push_back(along);
  if (!work.told.turned) {
    NullDirection across{
        "the camera's place across the spindle's axis", "",
        "pictures with the spindle at 0 and at 180 degrees, or touching marks in X and Y",
        std::nullopt, "mm"};
    if (work.told.touched_across) across.taken_from = "touched marks";
    if (across.taken_from.empty() && prior) {
      across.taken_from = "what was stated of the camera's place";
    }
    if (!across.taken_from.empty()) {
      across.sigma = std::sqrt(std::max(covariance(7, 7), covariance(8, 8)));
    }
    result.null_directions.push_back(across);
    result.null_directions.push_back(
        {"the lean of the spindle's axis against the machine's axes",
         "0: the camera's angles hold for this machine and this angle of the spindle",
         "pictures with the spindle at 0 and at 180 degrees", work.measurement->machine.lean_rad,
         "rad"});
  }
}

void NameMachine(const BoardWork& work, BoardCalibration& result) {
  const BoardMachineErrors& machine = work.measurement->machine;
  result.null_directions.push_back(
      {"the machine's own scale along X, Y and Z, with the last the focal length",
       fmt::format("the machine, to {:.3g} ppm", 1e6 * machine.scale),
       "a laser, a step gauge or a scale bar of known length", machine.scale, ""});
  result.null_directions.push_back(
      {"the squareness of the machine's axes",
       fmt::format("the machine, to {:.3g} mm/m", 1e3 * machine.squareness_rad),
       "a ball bar or a square", machine.squareness_rad, "rad"});
  result.null_directions.push_back(
      {"the taper's own angle about the spindle's axis", "this clamping: later ones count from it",
       "nothing: a measurement solves for its own clamp angle", std::nullopt, "rad"});
  result.null_directions.push_back(
      {"how far off this clamping held the camera from the spindle's axis",
       "this clamping: it stands in the camera's place",
       "calibrating in several clampings, and their mean", std::nullopt, "mm"});
  std::size_t returns = work.pieces.network.stays;
  if (work.told.turned && returns < 3) {
    result.null_directions.push_back(
        {"a motion of the board while the spindle turned", "none: the board lay still",
         "returning to the first angle for some pictures at the end", std::nullopt, "mm"});
  }
}

// Checks for null directions without a substitute value.
bool LacksPlace(BoardCalibration& result, double max_mm) {
  std::string open;
  for (const NullDirection& direction : result.null_directions) {
    const bool unknown = direction.taken_from.empty() ||
                         (direction.unit == "mm" && direction.sigma.value_or(0) > max_mm);
    if (!unknown) continue;
    open += fmt::format("{}{}, which {} would tell", open.empty() ? "" : "; and ", direction.what,
                        direction.closed_by);
  }
  if (open.empty()) return false;
  result.verdict = Verdict::kCannotTell;
  result.reason = "no picture tells " + open + "; or state the camera's place with its sigma";
  return true;
}

// Returns the machine axis along which the picture's columns run at the first angle.
std::string ColumnsText(const Camera& camera, const Matrix3d& machine_from_taper) {
  const Vector3d right =
      machine_from_taper * geometry::RotationFromAngles(camera.taper_from_camera.angles_rad).col(0);
  Index axis = 0;
  right.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{}{}", right[axis] < 0 ? "-" : "+", "XYZ"[axis]);
}

void NoteCoverage(const BoardWork& work, BoardCalibration& result) {
  const Vector2d principal = PrincipalPoint(result.camera);
  double seen_px = 0;
  for (const NetworkObservation& observation : work.pieces.network.observations) {
    if (!TakesPart(work.pieces.network, observation)) continue;
    seen_px = std::max(seen_px, (observation.pixel - principal).norm());
  }
  if (auto notice = NoticeOfCoverage(result.camera, "mark", seen_px)) {
    result.notices.push_back(std::move(*notice));
  }
}

void NoteSigmas(const BoardWork& work, BoardCalibration& result) {
  constexpr double kMuch = 1.5;
  if (work.pixel_factor > kMuch) {
    result.notices.push_back(fmt::format(
        "marks scatter by {:.2f} times their stated sigmas: the covariance is by what they scatter",
        work.pixel_factor));
  }
  const double stated = work.measurement->machine.repeatability_mm;
  const double found = work.pieces.network.machine.repeatability_mm;
  if (found > 2 * stated) {
    result.notices.push_back(fmt::format(
        "the spindle stands {} beside where the machine states it (k = 1 per axis), more than the "
        "{} stated: the covariance is by what it scatters",
        Micrometres(found), Micrometres(stated)));
  }
}

}  // namespace

std::optional<PrintResult> PrintOf(const BoardWork& work) {
  const BoardNetwork& network = work.pieces.network;
  const std::vector<bool> seen = SeenMarks(network);
  std::map<std::string, Vector2d> layout;
  for (const PrintedMark& mark : work.measurement->layout) layout[mark.id] = mark.at_mm;
  const BoardPlane plane = PlaneOf(network, work.state);
  std::vector<std::pair<Vector2d, Vector3d>> pairs;
  for (std::size_t i = 0; i < network.marks; ++i) {
    const auto meant = layout.find(work.pieces.ids[i]);
    if (!seen[i] || meant == layout.end()) continue;
    pairs.emplace_back(meant->second,
                       plane.axes.transpose() * (work.state.marks_mm[i] - plane.middle));
  }
  constexpr std::size_t kMin = 4;
  if (pairs.size() < kMin) return std::nullopt;
  MatrixXd rows(static_cast<Index>(pairs.size()), 3);
  MatrixXd places(static_cast<Index>(pairs.size()), 2);
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto row = static_cast<Index>(i);
    rows.row(row) << pairs[i].first.transpose(), 1;
    places.row(row) = pairs[i].second.head<2>().transpose();
    low = std::min(low, pairs[i].second.z());
    high = std::max(high, pairs[i].second.z());
  }
  const MatrixXd map = geometry::SolveLeastSquares(rows, places);
  PrintResult print;
  print.scale_right = map.row(0).norm();
  print.scale_up = map.row(1).norm();
  print.bend_mm = high - low;
  print.marks = static_cast<int>(pairs.size());
  return print;
}

bool RefuseUnits(const BoardWork& work, BoardCalibration& result) {
  return RefuseLengths(work, result) || RefuseFocal(work, result);
}

std::vector<Vector2d> CorrectedCentres(const BoardWork& work) {
  const BoardNetwork& network = work.pieces.network;
  const std::vector<Vector3d> normals = NormalsOf(network, work.state);
  std::vector<Vector2d> pixels;
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const NetworkObservation& observation = network.observations[i];
    const BoardView& view = work.measurement->views[observation.station];
    const Observation& seen = view.observations[work.pieces.index_in_view[i]];
    Vector2d pixel(seen.column_px, seen.row_px);
    if (!view.discs.empty() && work.disc_radius_mm > 0 && TakesPart(network, observation)) {
      const SeenDisc disc = SeenDiscOf(network, work.state, normals, observation);
      if (const auto off =
              Eccentricity(work.state.camera, disc.centre_mm, disc.normal, work.disc_radius_mm)) {
        pixel -= *off;
      }
    }
    pixels.push_back(pixel);
  }
  return pixels;
}

double DiscRadius(const BoardWork& work) {
  const BoardNetwork& network = work.pieces.network;
  const std::vector<Vector3d> normals = NormalsOf(network, work.state);
  std::vector<double> radii;
  constexpr std::size_t kMax = 2000;
  for (std::size_t i = 0; i < network.observations.size() && radii.size() < kMax; ++i) {
    const NetworkObservation& observation = network.observations[i];
    const BoardView& view = work.measurement->views[observation.station];
    if (view.discs.empty() || !TakesPart(network, observation)) continue;
    const ImageEllipse& ellipse = view.discs[work.pieces.index_in_view[i]];
    const SeenDisc disc = SeenDiscOf(network, work.state, normals, observation);
    const double trial_mm = std::abs(disc.centre_mm.z()) / 100;
    const auto image = ImageOfDisc(work.state.camera, disc.centre_mm, disc.normal, trial_mm);
    if (!image) continue;
    radii.push_back(trial_mm * std::sqrt(ellipse.semi_major_px * ellipse.semi_minor_px /
                                         (image->semi_major_px * image->semi_minor_px)));
  }
  return radii.empty() ? 0 : Median(radii);
}

void AnswerOf(const BoardWork& work, const BoardCalibrateOptions& options,
              BoardCalibration& result) {
  const BoardNetwork& network = work.pieces.network;
  result.camera = work.state.camera;
  result.lean_rad = work.state.lean_rad;
  result.lean_sigma_rad =
      work.precision.covariance.diagonal().segment<2>(kBoardLean).cwiseMax(0).cwiseSqrt();
  result.residual_rms_sigma = work.pixel_factor;
  result.repeatability_mm = network.machine.repeatability_mm;
  result.degrees_of_freedom = static_cast<int>(std::lround(work.precision.pixel_redundancy));
  NoteMarks(work, result);
  NamePlace(work, result);
  NameMachine(work, result);
  const double focal = std::sqrt(result.covariance(0, 0)) / result.camera.focal_length_mm;
  if (!(focal <= options.max_focal_uncertainty)) {
    result.verdict = Verdict::kCannotTell;
    result.reason = fmt::format(
        "the focal length is known only to {:.2g} of itself (k = 1, at most {:g}): the heights of "
        "the pictures span {:.3g} mm at distances of {:.0f} … {:.0f} mm; take some from heights of "
        "1 : 2 above the board",
        focal, options.max_focal_uncertainty, work.depth_mm, result.nearest_mm, result.farthest_mm);
    return;
  }
  if (LacksPlace(result, options.max_place_mm)) return;
  result.verdict = Verdict::kGood;
  result.notices.push_back(fmt::format(
      "the picture's columns run along {} of the machine at the first picture's angle; pictures do "
      "not tell a machine of which two axes have the wrong sign from a camera that is turned by "
      "half a turn: see that it is so",
      ColumnsText(result.camera, network.machine_from_spindle)));
  NoteCoverage(work, result);
  NoteSigmas(work, result);
}

}  // namespace trammel::part_alignment
