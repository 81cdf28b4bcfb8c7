// Planned stations for pictures of a board, for unknown cameras: by the view of a virtual spindle
// from there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "align_scene.h"
#include "board_scene.h"
#include "part_alignment/board/board_poses.h"
#include "sim/spindle/spindle_board.h"
#include "support/matchers.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using part_alignment::BoardMeasurement;
using part_alignment::BoardPoseOptions;
using part_alignment::BoardView;
using part_alignment::MachineBox;
using ::testing::HasSubstr;

// Seed below 1000: no statistics are made here.
constexpr std::uint64_t kSeed = 31;
const MachineBox kRoom{{0, 0, 0}, {1200, 800, 2000}};

struct Kind {
  std::string name;
  double focal_widths;  ///< focal length over the picture's width
  double turn_rad;      ///< camera about its axis
  double tilt_rad;
  double distance_mm;
  double reach_mm = 130;  ///< half of the board
};

class BoardPlan : public testing::Test {
 protected:
  explicit BoardPlan(const Kind& kind = {"", 1.1, 0.03, 0.01, 250}) : kind_(kind) {
    sim::BoardSetup setup = test::BoardScene();
    setup.touched.clear();
    setup.lens.focal_length_mm = kind.focal_widths * setup.lens.width_px * 0.0022;
    setup.lens.k1 *= std::pow(1.1 / kind.focal_widths, 2);
    setup.lens.k2 = 0;
    setup.lens.angles_rad = {std::numbers::pi - kind.tilt_rad, kind.tilt_rad, kind.turn_rad};
    const double pitch_mm = 2 * kind.reach_mm / 10;
    setup.sheet.pitch_mm = pitch_mm;
    setup.stops = {{{0, 0, 0}, 0}};
    world_ = sim::DrawBoardWorld(setup, kSeed);
    const sim::Triple middle = world_.machine_from_sheet.origin_mm;
    start_mm_ = {middle[0], middle[1], kind.distance_mm - setup.lens.offset_mm[2]};
    // Because of its tilt the camera is jogged until the board is in view.
    start_mm_.x() -= kind.tilt_rad * kind.distance_mm;
    measurement_ = test::BoardMeasurementOf(world_);
    measurement_.views.clear();
  }

  [[nodiscard]] BoardView See(const Vector3d& spindle_mm, double c_rad = 0) {
    world_.setup.stops.front() = {{spindle_mm.x(), spindle_mm.y(), spindle_mm.z()}, c_rad};
    world_.actual_mm.front() = world_.setup.stops.front().stated_mm;
    BoardView view;
    view.spindle_mm = spindle_mm;
    constexpr double kMargin_px = 20;
    for (const auto& seen : sim::Look(world_, 0, kMargin_px, world_.noise)) {
      view.observations.push_back({std::to_string(seen.target + 1), seen.noisy_px[0],
                                   seen.noisy_px[1], world_.setup.sigma_px});
    }
    return view;
  }

  // Width of the picture on the board, as the discs' size tells it.
  [[nodiscard]] double Field_mm() const { return kind_.distance_mm / kind_.focal_widths; }

  [[nodiscard]] Result<part_alignment::BoardSketch> Sketch() {
    auto first = TRY(part_alignment::FirstBoardPoses(start_mm_, Field_mm(), kRoom));
    for (const Vector3d& place : first) measurement_.views.push_back(See(place));
    return part_alignment::SketchBoard(measurement_);
  }

  Kind kind_;
  sim::BoardWorld world_;
  Vector3d start_mm_ = Vector3d::Zero();
  BoardMeasurement measurement_;
};

class BoardPlanOf : public BoardPlan, public testing::WithParamInterface<Kind> {
 protected:
  BoardPlanOf() : BoardPlan(GetParam()) {}
};

TEST_P(BoardPlanOf, FivePicturesTellEnoughToAimAllOthers) {
  const auto sketch = Must(Sketch());
  const double focal_px = sketch.camera.focal_length_mm / sketch.camera.pixel_pitch_mm;
  const double true_px = sim::FocalPx(world_.setup.lens);
  constexpr double kToAim = 0.1;
  EXPECT_NEAR(focal_px, true_px, kToAim * true_px);
  BoardPoseOptions options;
  options.room = kRoom;
  options.highest_mm = 2000;
  const auto poses = Must(part_alignment::PlanBoardPoses(sketch, 0, start_mm_, options));
  EXPECT_NEAR(poses.nearest_mm, kind_.distance_mm, kToAim * kind_.distance_mm);
  EXPECT_NEAR(poses.farthest_mm, 2 * poses.nearest_mm, 1e-6);
  ASSERT_EQ(poses.spindle_mm.size(), 40U);
  int few = 0;
  double farthest_px = 0;
  for (const Vector3d& place : poses.spindle_mm) {
    EXPECT_GE(place.z(), start_mm_.z() - 1e-9);
    const BoardView view = See(place);
    few += view.observations.size() < 6 ? 1 : 0;
    for (const auto& seen : view.observations) {
      farthest_px = std::max(farthest_px, std::hypot(seen.column_px - 1296, seen.row_px - 972));
    }
  }
  EXPECT_LE(few, 2);
  // The corner is 1620 px away.
  EXPECT_GT(farthest_px, 1400);
}

INSTANTIATE_TEST_SUITE_P(Cameras, BoardPlanOf,
                         testing::Values(Kind{"Usual", 1.1, 0.03, 0.01, 250},
                                         Kind{"Wide", 0.5, -1.2, 0.02, 120},
                                         Kind{"Tele", 3, 2.5, 0.01, 600},
                                         Kind{"Tilted", 1.1, 0.8, 0.1, 250},
                                         Kind{"UpsideDown", 1.1, 3.1, 0.01, 250},
                                         Kind{"LargeBoard", 1.1, 0.4, 0.01, 200, 300},
                                         Kind{"SmallBoard", 1.1, 0.4, 0.01, 300, 60}),
                         [](const auto& info) { return info.param.name; });

TEST_F(BoardPlan, HalfATurnOfACameraBesideTheAxisIsFollowed) {
  world_.setup.lens.offset_mm = {18, -11, -320.3};
  start_mm_ += Vector3d(-18, 11, 0);
  auto sketch = Must(Sketch());
  const BoardView turned = See(start_mm_ + Vector3d(0, 0, 100), std::numbers::pi);
  ASSERT_GT(turned.observations.size(), 4U);
  const Vector3d before = sketch.middle_mm;
  const double off_px = part_alignment::ShiftSketch(turned, std::numbers::pi, sketch);
  EXPECT_LT(off_px, 30);  // of 2592: approximate aim by an uncalibrated camera
  EXPECT_NEAR(sketch.middle_mm.x() - before.x(), 2 * 18, 2);
  EXPECT_NEAR(sketch.middle_mm.y() - before.y(), -2 * 11, 2);
  BoardPoseOptions options;
  options.room = kRoom;
  options.highest_mm = 2000;
  const auto poses =
      Must(part_alignment::PlanBoardPoses(sketch, std::numbers::pi, start_mm_, options));
  int few = 0;
  for (const Vector3d& place : poses.spindle_mm) {
    few += See(place, std::numbers::pi).observations.size() < 6 ? 1 : 0;
  }
  EXPECT_LE(few, 2);
  // One that stayed behind shows the board upright.
  auto again = Must(Sketch());
  EXPECT_GT(part_alignment::ShiftSketch(See(start_mm_), std::numbers::pi, again), 260);
}

TEST_F(BoardPlan, ALimitInTheWayIsSaidOrRefusedByItsName) {
  const auto sketch = Must(Sketch());
  BoardPoseOptions options;
  options.room = kRoom;
  options.highest_mm = 2000;
  options.room.high_mm.x() = start_mm_.x() + 30;
  const auto poses = Must(part_alignment::PlanBoardPoses(sketch, 0, start_mm_, options));
  EXPECT_THAT(poses.notices, testing::ElementsAre(HasSubstr("the upper limit of X")));
  for (const Vector3d& place : poses.spindle_mm) EXPECT_LE(place.x(), start_mm_.x() + 30);

  options.room = kRoom;
  options.room.high_mm.z() = start_mm_.z() + 100;
  const auto lower = Must(part_alignment::PlanBoardPoses(sketch, 0, start_mm_, options));
  EXPECT_THAT(lower.notices, testing::ElementsAre(testing::AllOf(HasSubstr("the upper limit of Z"),
                                                                 HasSubstr("instead of 1 : 2"))));
  options.room.high_mm.z() = start_mm_.z() + 40;
  EXPECT_THAT(part_alignment::PlanBoardPoses(sketch, 0, start_mm_, options),
              FailsWith(ErrorKind::kSafety, "the upper limit of Z, "));
  options.room = kRoom;
  options.highest_mm = start_mm_.z() + 40;
  const auto given = part_alignment::PlanBoardPoses(sketch, 0, start_mm_, options);
  ASSERT_FALSE(given);
  EXPECT_THAT(given.error().message, HasSubstr("the highest Z that was given"));
}

TEST_F(BoardPlan, FirstPicturesNeedRoomAboveAndToOneSide) {
  MachineBox room = kRoom;
  room.high_mm.z() = start_mm_.z() + 5;
  EXPECT_THAT(part_alignment::FirstBoardPoses(start_mm_, Field_mm(), room),
              FailsWith("the upper limit of Z"));
  room = kRoom;
  room.high_mm.x() = start_mm_.x() + 5;
  const auto left = Must(part_alignment::FirstBoardPoses(start_mm_, Field_mm(), room));
  for (const Vector3d& place : left) EXPECT_LE(place.x(), start_mm_.x());
  room.low_mm.x() = start_mm_.x() - 5;
  EXPECT_THAT(part_alignment::FirstBoardPoses(start_mm_, Field_mm(), room),
              FailsWith(ErrorKind::kSafety, "of X leave less than"));
}

TEST_F(BoardPlan, MirroredPicturesAreNamed) {
  auto first = Must(part_alignment::FirstBoardPoses(start_mm_, Field_mm(), kRoom));
  for (const Vector3d& place : first) {
    BoardView view = See(place);
    for (auto& seen : view.observations) seen.column_px = 2591 - seen.column_px;
    measurement_.views.push_back(view);
  }
  EXPECT_THAT(part_alignment::SketchBoard(measurement_), FailsWith("mirror image"));
}

}  // namespace
}  // namespace trammel
