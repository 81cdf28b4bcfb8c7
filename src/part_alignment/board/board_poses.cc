#include "part_alignment/board/board_poses.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/euler.h"
#include "part_alignment/board/board_input.h"
#include "part_alignment/board/board_start.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kHeights = 5;
constexpr double kMinRatio = 1.25;  // of distances: below it the focal length is uncertain
constexpr double kMinDisc_px = 6;   // radius: centres are within 1.3 of the bound from 5 px on
constexpr int kMinMarks = 6;        // per picture
constexpr int kMinPictures = 4;     // per spindle angle

tl::unexpected<Error> Unsafe(std::string what) { return Fail(std::move(what), ErrorKind::kSafety); }

Matrix3d MachineFromCamera(const BoardSketch& sketch, double turn_rad) {
  return geometry::RotationFromAngles({0, 0, turn_rad}) *
         geometry::RotationFromAngles(sketch.camera.taper_from_camera.angles_rad);
}

// Counts the marks that a picture shows completely.
int MarksSeen(const BoardSketch& sketch, const Matrix3d& machine_from_camera,
              const Vector3d& spindle_mm) {
  const Camera& camera = sketch.camera;
  constexpr double kMargin_px = 20;
  int seen = 0;
  for (const Vector3d& mark : sketch.marks_mm) {
    const auto pixel = Project(camera, machine_from_camera.transpose() * (mark - spindle_mm));
    if (pixel && pixel->x() >= kMargin_px && pixel->x() <= camera.width_px - 1 - kMargin_px &&
        pixel->y() >= kMargin_px && pixel->y() <= camera.height_px - 1 - kMargin_px) {
      ++seen;
    }
  }
  return seen;
}

std::string Limit(const char* side, int axis, double at_mm) {
  return fmt::format("the {} limit of {}, {:.1f} mm,", side, "XYZ"[axis], at_mm);
}

// Computes the spindle's place at a height from which the board's middle appears at a pixel,
// limited to the room.
std::optional<Vector3d> PlaceFor(const BoardSketch& sketch, const Matrix3d& machine_from_camera,
                                 const Vector2d& pixel, double z_mm, const MachineBox& room) {
  const auto line = LineOfSight(sketch.camera, pixel);
  if (!line) return std::nullopt;
  const Vector3d ray = machine_from_camera * *line;
  if (!(ray.z() < 0)) return std::nullopt;
  const Vector3d at = sketch.middle_mm - (sketch.middle_mm.z() - z_mm) / ray.z() * ray;
  return Vector3d(std::clamp(at.x(), room.low_mm.x(), room.high_mm.x()),
                  std::clamp(at.y(), room.low_mm.y(), room.high_mm.y()), z_mm);
}

struct Heights {
  double low_mm = 0;
  double high_mm = 0;
  double distance_mm = 0;  // above the lowest
};

Result<Heights> HeightsOf(const BoardSketch& sketch, const Vector3d& start_mm,
                          const BoardPoseOptions& options, std::vector<std::string>& notices) {
  Heights heights;
  heights.low_mm = start_mm.z();
  heights.distance_mm = start_mm.z() - sketch.middle_mm.z();
  if (!(heights.distance_mm > 0)) {
    return Fail("the board would lie above the camera: look at the sign of the machine's Z",
                ErrorKind::kMeasurement);
  }
  struct Bound {
    double ratio;
    std::string what;
  };
  const double d = heights.distance_mm;
  const double top_mm = options.room.high_mm.z();
  std::vector<Bound> bounds = {
      {(top_mm - heights.low_mm) / d + 1, Limit("upper", 2, top_mm)},
      {(options.highest_mm - heights.low_mm) / d + 1,
       fmt::format("the highest Z that was given, {:.1f} mm,", options.highest_mm)}};
  if (sketch.disc_radius_px > 0) {
    bounds.push_back({sketch.disc_radius_px / kMinDisc_px,
                      fmt::format("the size of the discs, {:.0f} px in radius from here,",
                                  sketch.disc_radius_px)});
  }
  double ratio = options.largest_ratio;
  const Bound* least = nullptr;
  for (const Bound& bound : bounds) {
    if (!(bound.ratio < ratio)) continue;
    ratio = bound.ratio;
    least = &bound;
  }
  if (!(ratio >= kMinRatio)) {
    return Unsafe(fmt::format(
        "{} leaves distances of 1 : {:.2f} from the board, and at least 1 : {:g} tells the focal "
        "length: begin nearer to the board (it is {:.0f} mm away), raise what limits it, or print "
        "larger discs",
        least->what, std::max(0.0, ratio), kMinRatio, d));
  }
  if (least != nullptr) {
    notices.push_back(fmt::format("{} leaves distances of 1 : {:.2f} instead of 1 : {:g}",
                                  least->what, ratio, options.largest_ratio));
  }
  heights.high_mm = heights.low_mm + (ratio - 1) * d;
  return heights;
}

// Names the limits of X and Y that clipped positions.
std::string LimitsOf(const std::vector<Vector3d>& places, const MachineBox& room) {
  std::string words;
  for (int axis = 0; axis < 2; ++axis) {
    for (const bool upper : {false, true}) {
      const double at_mm = upper ? room.high_mm[axis] : room.low_mm[axis];
      const auto count = std::count_if(places.begin(), places.end(),
                                       [&](const Vector3d& place) { return place[axis] == at_mm; });
      if (count == 0) continue;
      words += fmt::format("{}{} {} of the places", words.empty() ? "" : "; ",
                           Limit(upper ? "upper" : "lower", axis, at_mm), count);
    }
  }
  return words;
}

}  // namespace

Result<std::vector<Vector3d>> FirstBoardPoses(const Vector3d& start_mm, double field_mm,
                                              const MachineBox& room) {
  TRAMMEL_CHECK(field_mm > 0, "field = {} mm", field_mm);
  // The scale of a lens of usual width (25 to 100 degrees) then changes by 20 to 60 %, and the
  // board remains in view.
  constexpr double kUp = 0.25;
  constexpr double kMinUp = 0.1;
  constexpr double kAside = 0.15;
  const double up_mm = std::min(kUp * field_mm, room.high_mm.z() - start_mm.z());
  if (!(up_mm >= kMinUp * field_mm)) {
    return Unsafe(fmt::format(
        "{} leaves {:.1f} mm above here, and the first pictures need {:.1f}: begin lower, or raise "
        "the limit",
        Limit("upper", 2, room.high_mm.z()), std::max(0.0, up_mm), kMinUp * field_mm));
  }
  const double aside_mm = kAside * field_mm;
  Vector3d aside = Vector3d::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    if (start_mm[axis] + aside_mm <= room.high_mm[axis]) {
      aside[axis] = aside_mm;
    } else if (start_mm[axis] - aside_mm >= room.low_mm[axis]) {
      aside[axis] = -aside_mm;
    } else {
      return Unsafe(fmt::format(
          "{:.1f} … {:.1f} mm of {} leave less than {:.1f} mm to either side of here, which the "
          "first pictures need: move the board towards the middle of the machine",
          room.low_mm[axis], room.high_mm[axis], "XYZ"[axis], aside_mm));
    }
  }
  const Vector3d up(0, 0, up_mm);
  const Vector3d x(aside.x(), 0, 0);
  const Vector3d y(0, aside.y(), 0);
  return std::vector<Vector3d>{start_mm, start_mm + up, start_mm + up + x, start_mm + up + y,
                               start_mm + x + y + up / 2};
}

Result<BoardSketch> SketchBoard(const BoardMeasurement& first) {
  const BoardPieces pieces = PiecesOf(first);
  const BoardStart start = StartBoard(pieces.network);
  const auto wrong = [](const std::string& what) {
    return Fail("the first pictures do not tell how the camera sees the board: " + what,
                ErrorKind::kMeasurement);
  };
  switch (start.fault) {
    case BoardStartFault::kNone:
      break;
    case BoardStartFault::kMirrored:
      return wrong(
          "they are the mirror image of what is seen from these places: switch the mirroring of "
          "the camera's pictures off; else an axis of the machine has the wrong sign");
    case BoardStartFault::kLooksAway:
      return wrong("the camera would look into the spindle: Z must count upwards");
    case BoardStartFault::kFewPictures:
      return wrong("fewer than 4 of them show 4 marks of the sheet that others show");
    case BoardStartFault::kOneHeight:
    case BoardStartFault::kShallow:
    case BoardStartFault::kOneLine:
    case BoardStartFault::kNoCamera:
      return wrong(
          "look at focus and light, and that neither board nor camera can move; the picture must "
          "be the whole sensor's, and the spindle along the machine's Z");
  }
  BoardSketch sketch;
  sketch.camera = start.state.camera;
  sketch.camera.k1 = 0;  // nearly the same where it is aimed with, and no place folds
  sketch.camera.taper_from_camera.translation_mm.setZero();
  for (std::size_t i = 0; i < start.state.marks_mm.size(); ++i) {
    if (!start.placed[i]) continue;
    sketch.marks_mm.push_back(start.state.marks_mm[i]);
    sketch.ids.push_back(pieces.ids[i]);
    sketch.middle_mm += start.state.marks_mm[i];
  }
  sketch.middle_mm /= std::max<double>(1, static_cast<double>(sketch.marks_mm.size()));
  std::vector<double> radii;
  for (const ImageEllipse& disc : first.views.front().discs) radii.push_back(disc.semi_major_px);
  if (!radii.empty()) sketch.disc_radius_px = Median(radii);
  return sketch;
}

Result<BoardPoses> PlanBoardPoses(const BoardSketch& sketch, double turn_rad,
                                  const Vector3d& start_mm, const BoardPoseOptions& options) {
  TRAMMEL_CHECK(options.pictures >= kMinPictures && options.pictures <= 500, "pictures = {}",
                options.pictures);
  BoardPoses poses;
  const auto heights = TRY(HeightsOf(sketch, start_mm, options, poses.notices));
  const double rise_mm = heights.high_mm - heights.low_mm;
  poses.nearest_mm = heights.distance_mm;
  poses.farthest_mm = heights.distance_mm + rise_mm;
  const Matrix3d machine_from_camera = MachineFromCamera(sketch, turn_rad);
  const Vector2d half((sketch.camera.width_px - 1) / 2.0, (sketch.camera.height_px - 1) / 2.0);
  // Most even sequence of the plane (Roberts 2018): powers of the root of x³ = x + 1.
  constexpr double kFirst = 0.7548776662466927;
  constexpr double kSecond = 0.5698402909980532;
  // Reach of the board's middle towards the picture's edges; smaller where too few marks would
  // remain.
  constexpr std::array<double, 5> kReaches = {0.95, 0.7, 0.45, 0.2, 0};
  for (int k = 0; k < options.pictures; ++k) {
    // More often near the edges, which determine the distortion, than a lens needs in between.
    const Vector2d where(std::sin(std::numbers::pi * (std::fmod(0.5 + kFirst * k, 1.0) - 0.5)),
                         std::sin(std::numbers::pi * (std::fmod(0.5 + kSecond * k, 1.0) - 0.5)));
    const double z_mm = heights.high_mm - rise_mm * (k % kHeights) / (kHeights - 1);
    for (const double reach : kReaches) {
      const Vector2d pixel = half + reach * half.cwiseProduct(where);
      const auto place = PlaceFor(sketch, machine_from_camera, pixel, z_mm, options.room);
      if (!place || MarksSeen(sketch, machine_from_camera, *place) < kMinMarks) continue;
      poses.spindle_mm.push_back(*place);
      break;
    }
  }
  const std::string limits = LimitsOf(poses.spindle_mm, options.room);
  const auto left = static_cast<int>(poses.spindle_mm.size());
  if (left < std::max(kMinPictures, options.pictures / 2)) {
    return Unsafe(fmt::format(
        "the board is in view from {} of {} places within the machine's limits ({}): move it "
        "towards the middle of the machine",
        left, options.pictures, limits.empty() ? "none of them was in the way" : limits));
  }
  if (!limits.empty()) poses.notices.push_back("nearer to the board's middle by " + limits);
  return poses;
}

double ShiftSketch(const BoardView& view, double turn_rad, BoardSketch& sketch) {
  const Matrix3d machine_from_camera = MachineFromCamera(sketch, turn_rad);
  std::vector<std::pair<Vector3d, Vector2d>> seen;
  Vector2d shift = Vector2d::Zero();
  for (const Observation& observation : view.observations) {
    const auto at = std::find(sketch.ids.begin(), sketch.ids.end(), observation.target);
    if (at == sketch.ids.end()) continue;
    const Vector2d pixel(observation.column_px, observation.row_px);
    const auto line = LineOfSight(sketch.camera, pixel);
    if (!line) continue;
    const Vector3d ray = machine_from_camera * *line;
    const Vector3d& mark = sketch.marks_mm[static_cast<std::size_t>(at - sketch.ids.begin())];
    const Vector3d there = view.spindle_mm + (mark.z() - view.spindle_mm.z()) / ray.z() * ray;
    shift += (there - mark).head<2>();
    seen.emplace_back(mark, pixel);
  }
  TRAMMEL_CHECK(!seen.empty(), "{} marks in the view", view.observations.size());
  shift /= static_cast<double>(seen.size());
  for (Vector3d& mark : sketch.marks_mm) mark.head<2>() += shift;
  sketch.middle_mm.head<2>() += shift;
  std::vector<double> off;
  for (const auto& [mark, pixel] : seen) {
    const Vector3d moved = mark + Vector3d(shift.x(), shift.y(), 0);
    const auto foretold =
        Project(sketch.camera, machine_from_camera.transpose() * (moved - view.spindle_mm));
    off.push_back(foretold ? (*foretold - pixel).norm() : sketch.camera.width_px);
  }
  return Median(off);
}

}  // namespace trammel::part_alignment
