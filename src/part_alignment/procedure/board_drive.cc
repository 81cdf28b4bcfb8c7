#include "part_alignment/procedure/board_drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/frame.h"
#include "base/page.h"
#include "base/statistics.h"
#include "geometry/euler.h"
#include "part_alignment/board/board_input.h"
#include "part_alignment/board/board_poses.h"
#include "part_alignment/targets/ring_finder.h"

namespace trammel::procedure {
namespace {

using Eigen::Vector3d;
using part_alignment::BoardMeasurement;
using part_alignment::BoardPoses;
using part_alignment::BoardSketch;
using part_alignment::BoardView;
using part_alignment::MachineBox;
using part_alignment::View;

constexpr std::size_t kMinMarks = part_alignment::kMinMarksInView;
constexpr std::size_t kMinFirstMarks = 8;  // in the first picture, base of all other plans
constexpr double kHalfTurn_deg = 180;
constexpr int kMinTurnedBack = 5;  // pictures: one at each height
// Margin around the given places, for a camera beside the spindle's axis after a turn.
constexpr double kAroundStated_mm = 20;

std::string Text(const MachineBox& box) {
  return fmt::format("X {:.1f} … {:.1f}, Y {:.1f} … {:.1f}, Z {:.1f} … {:.1f} mm", box.low_mm.x(),
                     box.high_mm.x(), box.low_mm.y(), box.high_mm.y(), box.low_mm.z(),
                     box.high_mm.z());
}

MachineBox Around(const std::vector<Vector3d>& places) {
  MachineBox box{places.front(), places.front()};
  for (const Vector3d& place : places) {
    box.low_mm = box.low_mm.cwiseMin(place);
    box.high_mm = box.high_mm.cwiseMax(place);
  }
  return box;
}

MachineBox Common(const MachineBox& a, const MachineBox& b) {
  return {a.low_mm.cwiseMax(b.low_mm), a.high_mm.cwiseMin(b.high_mm)};
}

double Length(const std::vector<Waypoint>& way, Vector3d at_mm) {
  double length_mm = 0;
  for (const Waypoint& point : way) {
    length_mm += (point.spindle_mm - at_mm).norm();
    at_mm = point.spindle_mm;
  }
  return length_mm;
}

std::vector<View> ViewsAt(const std::vector<Vector3d>& places) {
  std::vector<View> views;
  for (const Vector3d& place : places) {
    views.push_back({place, Eigen::Matrix3d::Identity(), {}});
  }
  return views;
}

class Driving {
 public:
  Driving(const BoardDriveOptions& options, const BoardHooks& shop)
      : options_(options),
        shop_(shop),
        hooks_(static_cast<const ViewHooks&>(shop)),
        board_(options.board) {
    hooks_.move_to = [this](const Vector3d& mm) {
      moved_ = true;
      return Noted(shop_.move_to(mm));
    };
    hooks_.stands_at = [this] { return Noted(shop_.stands_at()); };
    hooks_.take_picture = [this] {
      auto picture = shop_.take_picture();
      camera_failed_ = !picture && picture.error().kind != ErrorKind::kInterrupted;
      return picture;
    };
  }

  Result<BoardMeasurement> Run() {
    auto done = TakeAll();
    if (!moved_ || !MayGoBack(done)) {
      if (!done) return tl::unexpected(done.error());
      return std::move(board_);
    }
    const auto back = GoBack();
    if (done && back) return std::move(board_);
    if (done) return tl::unexpected(back.error());
    return Fail(fmt::format("{}; the spindle {}", done.error().message,
                            back ? "is back where it stood"
                                 : "could not be brought back: " + back.error().message),
                done.error().kind);
  }

 private:
  // True if the spindle may return: not after a stop, nor if the machine is in use by others or
  // faulty.
  [[nodiscard]] bool MayGoBack(const Result<void>& done) const {
    if (done) return true;
    if (failed_) return false;
    if (declined_ || camera_failed_) return true;
    return done.error().kind != ErrorKind::kInterrupted && done.error().kind != ErrorKind::kMachine;
  }

  template <class T>
  T Noted(T done) {
    failed_ = failed_ || !done;
    return done;
  }

  [[nodiscard]] std::vector<int> Rounds() const {
    std::vector<int> rounds = {options_.pictures};
    if (options_.half_turn) {
      rounds.push_back(options_.pictures / 2);
      rounds.push_back(std::max(options_.pictures / 4, kMinTurnedBack));
    }
    return rounds;
  }

  Result<void> TakeAll() {
    TRY(Begin());
    TRY(TakeFirst());
    auto sketch = TRY(part_alignment::SketchBoard(board_));
    TRY(PlanAll(sketch));
    const std::vector<int> rounds = Rounds();
    for (std::size_t round = 0; round < rounds.size(); ++round) {
      const double c_deg = round % 2 == 0 ? 0 : kHalfTurn_deg;
      TRY(TurnTo(c_deg));
      TRY(c_deg == 0 ? TakeRound(sketch, rounds[round]) : TakeTurnedRound(sketch, rounds[round]));
    }
    return {};
  }

  // Records the start position and checks that a path back to it exists.
  Result<void> Begin() {
    const auto at_mm = TRY(hooks_.stands_at());
    start_mm_ = at_mm;
    const RouteOptions& route = options_.route;
    if (start_mm_.z() > route.safe_z_mm) {
      return Fail(fmt::format("the spindle stands at Z {:.3f}, above the safe height {:.3f}: begin "
                              "lower, or give a higher one",
                              start_mm_.z(), route.safe_z_mm),
                  ErrorKind::kSafety);
    }
    room_ = {route.travel.low_mm, route.travel.high_mm};
    room_.low_mm.z() = start_mm_.z();
    room_.high_mm.z() = std::min(room_.high_mm.z(), route.safe_z_mm);
    const auto back = RouteThrough(start_mm_, ViewsAt({start_mm_}), route);
    return back ? Result<void>() : tl::unexpected(back.error());
  }

  // Takes the pictures from which all others are planned.
  Result<void> TakeFirst() {
    AddViews({start_mm_});
    TRY(TakeView(0, views_[0], hooks_, OnSeen()));
    const BoardView& first = board_.views.front();
    if (first.observations.size() < kMinFirstMarks) {
      return Fail(
          fmt::format("the picture from here shows {} of the sheet's {} marks, and {} are needed: "
                      "bring the board into view, look at focus and light, and at the sheet's file",
                      first.observations.size(), options_.marks.size(), kMinFirstMarks),
          ErrorKind::kMeasurement);
    }
    std::vector<double> radii;
    for (const auto& disc : first.discs) radii.push_back(disc.semi_major_px);
    const double mm_per_px = board_.disc_radius_mm / Median(radii);
    const double field_mm = board_.camera.width_px * mm_per_px;
    auto places = TRY(part_alignment::FirstBoardPoses(start_mm_, field_mm, room_));
    const MachineBox box = Around(places);
    places.erase(places.begin());
    const std::size_t first_view = AddViews(places);
    const auto way = TRY(WayFrom(start_mm_, first_view));
    shop_.tell(
        fmt::format("the picture is about {:.0f} mm wide on the board; {} more pictures are "
                    "needed to plan the others",
                    field_mm, places.size()));
    TRY(
        Ask(fmt::format("the spindle moves to {}, each time over Z {:.1f} mm, at {:g} "
                        "mm/min, and in the end back here: may it",
                        Text(box), options_.route.safe_z_mm, options_.feed_mm_min)));
    return DriveThroughViews(way, views_, hooks_, OnSeen());
  }

  // Plans all rounds, before the first of them moves.
  Result<void> PlanAll(const BoardSketch& sketch) {
    const auto at_mm = TRY(hooks_.stands_at());
    std::vector<Vector3d> all;
    std::size_t count = 0;
    double way_mm = 0;
    BoardPoses first;
    const std::vector<int> rounds = Rounds();
    for (std::size_t round = 0; round < rounds.size(); ++round) {
      const double turn_rad = round % 2 == 0 ? 0 : std::numbers::pi;
      auto poses = TRY(PlanBoardPoses(sketch, turn_rad, start_mm_, PoseOptions(rounds[round])));
      // Checks the whole way for obstacles.
      const auto way = TRY(RouteThrough(at_mm, ViewsAt(poses.spindle_mm), options_.route));
      way_mm += Length(way, at_mm);
      count += poses.spindle_mm.size();
      all.insert(all.end(), poses.spindle_mm.begin(), poses.spindle_mm.end());
      if (round == 0) first = std::move(poses);
    }
    all.push_back(start_mm_);
    told_ = Around(all);
    first_ = views_.size();
    planned_ = count;
    constexpr double kReading_s = 1;  // per picture
    const double minutes = way_mm / options_.feed_mm_min +
                           static_cast<double>(count) * (options_.settle_s + kReading_s) / 60;
    shop_.tell(
        fmt::format("plan      {} pictures, {:.0f} … {:.0f} mm from the board, {:.0f} minutes",
                    count, first.nearest_mm, first.farthest_mm, std::ceil(minutes)));
    shop_.tell(
        fmt::format("spindle   {}; across at Z {:.1f} mm", Text(told_), options_.route.safe_z_mm));
    if (options_.half_turn) {
      shop_.tell(
          fmt::format("turns     by half a turn behind {} of them, and back behind {}: the "
                      "camera's cable has to follow; there it may go {:g} mm farther aside",
                      rounds[0], rounds[0] + rounds[1], kAroundStated_mm));
    }
    for (const std::string& notice : first.notices) shop_.tell("notice    " + notice);
    return Ask(
        fmt::format("the spindle moves through these places at {:g} mm/min and back to X "
                    "{:.1f} Y {:.1f} Z {:.1f}: may it",
                    options_.feed_mm_min, start_mm_.x(), start_mm_.y(), start_mm_.z()));
  }

  Result<void> TakeRound(const BoardSketch& sketch, int pictures) {
    const auto poses = TRY(PlanBoardPoses(sketch, 0, start_mm_, PoseOptions(pictures)));
    return Drive(poses.spindle_mm);
  }

  // Takes the round after a turn: its first picture shows the new position of a camera beside the
  // spindle's axis.
  Result<void> TakeTurnedRound(BoardSketch sketch, int pictures) {
    part_alignment::BoardPoseOptions options = PoseOptions(pictures);
    MachineBox around = told_;
    around.low_mm.head<2>().array() -= kAroundStated_mm;
    around.high_mm.head<2>().array() += kAroundStated_mm;
    options.room = Common(options.room, around);
    const double turn_rad = std::numbers::pi;
    const auto plain = TRY(PlanBoardPoses(sketch, turn_rad, start_mm_, options));
    TRY(Drive({plain.spindle_mm.front()}));
    const BoardView& view = board_.views.back();
    if (view.observations.size() < kMinMarks) {
      return Fail(
          "behind half a turn the board is no longer in view: the camera sits far beside "
          "the spindle's axis; begin higher, or leave --half-turn out and state its place",
          ErrorKind::kMeasurement);
    }
    const double off_px = ShiftSketch(view, turn_rad, sketch);
    constexpr double kMaxOff = 0.1;  // of the picture's width; a manual turn may be 6 degrees off
    if (off_px > kMaxOff * board_.camera.width_px) {
      return Fail(fmt::format("the picture behind half a turn is {:.0f} px beside what a camera "
                              "sees that turned with the spindle: did both turn by 180 degrees?",
                              off_px),
                  ErrorKind::kMeasurement);
    }
    auto poses = TRY(PlanBoardPoses(sketch, turn_rad, start_mm_, options));
    poses.spindle_mm.erase(poses.spindle_mm.begin());
    return Drive(poses.spindle_mm);
  }

  Result<void> Drive(const std::vector<Vector3d>& places) {
    const auto at_mm = TRY(hooks_.stands_at());
    const auto way = TRY(WayFrom(at_mm, AddViews(places)));
    return DriveThroughViews(way, views_, hooks_, OnSeen());
  }

  Result<void> TurnTo(double c_deg) {
    if (c_deg == c_deg_) return {};
    TRY(Noted(shop_.turn_to(c_deg)));
    c_deg_ = c_deg;
    return {};
  }

  // Returns: up, turned back, across and down.
  Result<void> GoBack() {
    const auto at_mm = TRY(hooks_.stands_at());
    auto way = TRY(RouteThrough(at_mm, ViewsAt({start_mm_}), options_.route));
    way.pop_back();  // up again
    bool first = true;
    for (const Waypoint& point : way) {
      TRY(hooks_.move_to(point.spindle_mm));
      if (!std::exchange(first, false)) continue;
      TRY(TurnTo(0));
    }
    return {};
  }

  [[nodiscard]] part_alignment::BoardPoseOptions PoseOptions(int pictures) const {
    part_alignment::BoardPoseOptions options;
    options.room = room_;
    options.pictures = pictures;
    options.highest_mm = options_.highest_mm;
    return options;
  }

  // @returns the number of the first of them.
  std::size_t AddViews(const std::vector<Vector3d>& places) {
    const std::size_t first = views_.size();
    for (const View& view : ViewsAt(places)) views_.push_back(view);
    return first;
  }

  Result<std::vector<Waypoint>> WayFrom(const Vector3d& at_mm, std::size_t first_view) const {
    const std::vector<View> views(views_.begin() + static_cast<long>(first_view), views_.end());
    auto way = RouteThrough(at_mm, views, options_.route);
    if (!way) return way;
    for (Waypoint& point : *way) {
      if (point.view >= 0) point.view += static_cast<int>(first_view);
    }
    return way;
  }

  Result<void> Ask(const std::string& how) {
    const auto may = TRY(shop_.may_move(how));
    if (may) return {};
    declined_ = true;
    return Fail("no further picture was taken, as you answered", ErrorKind::kInterrupted);
  }

  OnPicture OnSeen() {
    return [this](std::size_t number, const machine::CapturedFrame& picture) {
      return See(number, picture);
    };
  }

  Result<void> See(std::size_t number, const machine::CapturedFrame& picture) {
    const auto frame = TRY(machine::DecodeFrame(picture));
    if (number == 0) {
      board_.camera.width_px = frame.width;
      board_.camera.height_px = frame.height;
    }
    if (frame.width != board_.camera.width_px || frame.height != board_.camera.height_px) {
      return Fail(fmt::format("the picture has {} x {} px, the first one {} x {}", frame.width,
                              frame.height, board_.camera.width_px, board_.camera.height_px),
                  ErrorKind::kMeasurement);
    }
    const Page grey = part_alignment::GreyPicture(frame.width, frame.height, frame.bgr);
    std::vector<std::string> notices;
    auto seen = TRY(ReadSurveyPicture(fmt::format("view {}", number + 1), grey.view(),
                                      options_.reading, workspace_, notices));
    BoardView& view = board_.views.emplace_back();
    view.width_px = frame.width;
    view.height_px = frame.height;
    view.spindle_mm = views_[number].spindle_mm;
    view.spindle_rotation =
        geometry::RotationFromAngles({0, 0, c_deg_ / kHalfTurn_deg * std::numbers::pi});
    for (std::size_t i = 0; i < seen.observations.size(); ++i) {
      if (!options_.marks.contains(seen.observations[i].target)) continue;
      view.observations.push_back(seen.observations[i]);
      view.discs.push_back(seen.discs[i]);
    }
    TRY(shop_.keep_views(board_));
    const std::size_t marks = view.observations.size();
    const bool few = marks < kMinMarks;
    left_out_ += few ? 1 : 0;
    shop_.tell(fmt::format("view {}{}: {} marks{}", number + 1,
                           planned_ > 0 ? fmt::format(" of {}", first_ + planned_) : "", marks,
                           few ? fmt::format("; fewer than {}, it is left out", kMinMarks) : ""));
    for (const std::string& notice : notices) shop_.tell("notice    " + notice);
    return number == 0 ? Result<void>() : CheckEnough(left_out_);
  }

  // Ends the drive as soon as half of the pictures are out of reach.
  Result<void> CheckEnough(std::size_t left_out) const {
    if (planned_ == 0 || 2 * left_out <= planned_) return {};
    return Fail(fmt::format("{} of {} planned pictures show fewer than {} marks of the sheet: look "
                            "at light and reflections, at what lies on the board, and at whether "
                            "board or camera moved",
                            left_out, planned_, kMinMarks),
                ErrorKind::kMeasurement);
  }

  const BoardDriveOptions& options_;
  const BoardHooks& shop_;
  ViewHooks hooks_;  ///< the shop's, watched
  BoardMeasurement board_;
  std::vector<View> views_;  ///< reached or planned, successful or not
  Vector3d start_mm_ = Vector3d::Zero();
  MachineBox room_;
  MachineBox told_;          ///< holds every place of the plan
  std::size_t first_ = 0;    ///< pictures before the plan
  std::size_t planned_ = 0;  ///< 0: nothing yet
  std::size_t left_out_ = 0;
  double c_deg_ = 0;
  bool moved_ = false;
  bool failed_ = false;  ///< the machine did
  bool camera_failed_ = false;
  bool declined_ = false;  ///< the answer was no
  part_alignment::FinderWorkspace workspace_;
};

}  // namespace

Result<BoardMeasurement> DriveOverBoard(const BoardDriveOptions& options, const BoardHooks& shop) {
  return Driving(options, shop).Run();
}

}  // namespace trammel::procedure
