// A drive over a board on a virtual mill: what moves, what ends it, and where it is left.
#include "part_alignment/procedure/board_drive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "align_scene.h"
#include "board_scene.h"
#include "sim/camera/jpeg.h"
#include "sim/spindle/spindle_board.h"
#include "sim/spindle/spindle_camera.h"
#include "support/matchers.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using part_alignment::BoardMeasurement;
using ::testing::HasSubstr;

constexpr double kSafe_mm = 1000;
const Vector3d kStart_mm(600, 400, 520);

// A machine that goes where it is told, and what its camera sees there.
struct Stand {
  Stand() {
    sim::BoardSetup setup = test::BoardScene();
    setup.touched.clear();
    setup.stops = {{{0, 0, 0}, 0}};
    constexpr double kSmaller = 4;  // pixels of a camera that is quickly drawn
    setup.lens.width_px /= 4;
    setup.lens.height_px /= 4;
    setup.lens.pixel_pitch_mm *= kSmaller;
    for (double& offset : setup.lens.principal_offset_px) offset /= kSmaller;
    setup.lens.k1 = setup.lens.k2 = setup.lens.p1 = setup.lens.p2 = 0;
    setup.sheet.columns = 6;
    setup.sheet.rows = 5;
    setup.sheet.pitch_mm = 40;
    setup.machine.repeatability_mm = 0;
    world = sim::DrawBoardWorld(setup, 17);
    auto book = part_alignment::MakeCodeBook(14);
    if (!book) return;
    sim::RingPattern pattern;
    pattern.bits = 14;
    pattern.dot_radius_mm = 5;
    pattern.ring_inner_mm = 10;
    pattern.ring_outer_mm = 15;
    pattern.ground_radius_mm = 18.5;
    for (std::size_t i = 0; i < world.marks_mm.size(); ++i) {
      pattern.word = book->words.at(i);
      patterns.push_back(pattern);
      options.marks.insert(std::to_string(i + 1));
    }
    options.reading.book = *book;
    options.board.camera.pixel_pitch_mm = setup.lens.pixel_pitch_mm;
    options.board.camera.looks_along = part_alignment::LooksAlong::kPlusZ;
    options.board.disc_radius_mm = pattern.dot_radius_mm;
    options.route.safe_z_mm = kSafe_mm;
    options.route.travel = {{0, 0, 0}, {1200, 800, kSafe_mm}};
    options.pictures = 12;
    like.light.white = 30;
    like.light.dark = 205;
    like.light.surface = 190;
    hooks.move_to = [this](const Vector3d& mm) -> Result<void> {
      if (move_fails && moves.size() == *move_fails) return Fail("refused", ErrorKind::kMachine);
      at_mm = mm;
      moves.push_back(mm);
      return {};
    };
    hooks.stands_at = [this]() -> Result<Vector3d> { return at_mm; };
    hooks.take_picture = [this] { return Take(); };
    hooks.keep_picture = [this](std::size_t view, const machine::CapturedFrame&) -> Result<void> {
      kept.push_back(view);
      return {};
    };
    hooks.keep_views = [this](const BoardMeasurement& so_far) -> Result<void> {
      board = so_far;
      return {};
    };
    hooks.may_move = [this](const std::string& how) -> Result<bool> {
      asked.push_back(how);
      return asked.size() <= yes;
    };
    hooks.turn_to = [this](double to_deg) -> Result<void> {
      turns.push_back(to_deg);
      c_deg = to_deg;
      return {};
    };
    hooks.tell = [this](const std::string& line) { told += line + "\n"; };
  }

  Result<machine::CapturedFrame> Take() {
    if (before_picture) {
      TRY(before_picture());
    }
    constexpr double kRadPerDeg = 3.141592653589793 / 180;
    world.setup.stops.front() = {{at_mm.x(), at_mm.y(), at_mm.z()}, c_deg * kRadPerDeg};
    world.actual_mm.front() = world.setup.stops.front().stated_mm;
    sim::SpindlePicture picture = sim::BoardPictureAt(world, 0, patterns, like);
    if (at_mm.x() > dark_beyond_mm) picture.light.white = picture.light.dark = 20;
    const auto page = TRY(sim::TakePicture(picture, world.noise.Fork(kept.size())));
    Frame frame(page.width, page.height);
    for (int y = 0; y < page.height; ++y) {
      for (int x = 0; x < page.width; ++x) {
        std::memset(frame.row(y) + std::ptrdiff_t{3} * x,
                    page.samples[static_cast<std::size_t>(y * page.width + x)], 3);
      }
    }
    machine::CapturedFrame captured;
    sim::EncodeJpeg(frame.view(), 98, captured.image);
    captured.width_px = frame.width;
    captured.height_px = frame.height;
    return captured;
  }

  [[nodiscard]] Result<BoardMeasurement> Drive() { return DriveOverBoard(options, hooks); }
  [[nodiscard]] bool back() const { return at_mm == kStart_mm; }

  sim::BoardWorld world;
  std::vector<sim::RingPattern> patterns;
  sim::SpindlePicture like;
  procedure::BoardDriveOptions options;
  procedure::BoardHooks hooks;
  Vector3d at_mm = kStart_mm;
  double c_deg = 0;
  double dark_beyond_mm = 1e9;
  std::function<Result<void>()> before_picture;
  std::optional<std::size_t> move_fails;  ///< after so many
  std::size_t yes = 9;                    ///< answers, then no
  std::vector<Vector3d> moves;
  std::vector<double> turns;
  std::vector<std::size_t> kept;
  std::vector<std::string> asked;
  std::string told;
  BoardMeasurement board;
};

TEST(BoardDrive, GoesUpAcrossAndDownAndComesBackToWhereItStood) {
  Stand stand;
  const auto board = Must(stand.Drive());
  EXPECT_EQ(board.views.size(), 5U + 12U);
  EXPECT_EQ(board.camera.width_px, 648);
  EXPECT_EQ(stand.asked.size(), 2U);
  EXPECT_TRUE(stand.back());
  Vector3d at_mm = kStart_mm;
  for (const Vector3d& to : stand.moves) {
    EXPECT_GE(to.z(), kStart_mm.z());
    if (to.head<2>() != at_mm.head<2>()) EXPECT_EQ(std::min(to.z(), at_mm.z()), kSafe_mm);
    at_mm = to;
  }
  const auto found = Must(part_alignment::CalibrateByBoard(board, {}));
  EXPECT_NEAR(found.camera.focal_length_mm, stand.world.setup.lens.focal_length_mm, 0.01)
      << found.reason;
}

TEST(BoardDrive, HalfATurnAndBackIsTakenWithPicturesAtEach) {
  Stand stand;
  stand.options.half_turn = true;
  const auto board = Must(stand.Drive());
  EXPECT_THAT(stand.turns, testing::ElementsAre(180, 0));
  EXPECT_EQ(board.views.size(), 5U + 12U + 6U + 5U);
  const auto turned = std::count_if(board.views.begin(), board.views.end(), [](const auto& view) {
    return view.spindle_rotation(0, 0) < 0;
  });
  EXPECT_EQ(turned, 6);
  EXPECT_TRUE(stand.back());
}

TEST(BoardDrive, NothingMovesBeforeTheFirstYes) {
  Stand stand;
  stand.yes = 0;
  EXPECT_THAT(stand.Drive(), FailsWith(ErrorKind::kInterrupted, "as you answered"));
  EXPECT_TRUE(stand.moves.empty());
}

TEST(BoardDrive, ANoToThePlanBringsItBack) {
  Stand stand;
  stand.yes = 1;
  const auto board = stand.Drive();
  ASSERT_FALSE(board);
  EXPECT_EQ(stand.kept.size(), 5U);
  EXPECT_THAT(stand.told, HasSubstr("plan      12 pictures"));
  EXPECT_TRUE(stand.back());
}

TEST(BoardDrive, ACameraThatFailsBringsItBack) {
  Stand stand;
  stand.before_picture = [&stand]() -> Result<void> {
    if (stand.kept.size() < 8) return {};
    return Fail("the camera is gone", ErrorKind::kMachine);
  };
  const auto board = stand.Drive();
  ASSERT_THAT(board, FailsWith("view 9: the camera is gone", "the spindle is back where it stood"));
  EXPECT_EQ(stand.board.views.size(), 8U);
  EXPECT_TRUE(stand.back());
}

TEST(BoardDrive, BehindAFailureOfTheMachineNothingMovesAnyMore) {
  Stand stand;
  stand.move_fails = 20;
  EXPECT_THAT(stand.Drive(), FailsWith(ErrorKind::kMachine));
  EXPECT_EQ(stand.moves.size(), 20U);
}

TEST(BoardDrive, AStopLeavesItWhereItIs) {
  Stand stand;
  stand.before_picture = [&stand]() -> Result<void> {
    if (stand.kept.size() < 8) return {};
    return Fail("stopped", ErrorKind::kInterrupted);
  };
  EXPECT_THAT(stand.Drive(), FailsWith(ErrorKind::kInterrupted));
  EXPECT_FALSE(stand.back());
}

TEST(BoardDrive, ASpindleThatSomebodyMovesIsLeftToThem) {
  Stand stand;
  stand.before_picture = [&stand]() -> Result<void> {
    if (stand.kept.size() == 8) stand.at_mm.x() += 0.02;
    return {};
  };
  EXPECT_THAT(stand.Drive(), FailsWith("view 9: the spindle moved by 0.020 mm"));
  const std::size_t moves = stand.moves.size();
  EXPECT_EQ(stand.at_mm, stand.moves.back() + Vector3d(0.02, 0, 0)) << moves;
}

TEST(BoardDrive, PicturesThatShowTooLittleAreLeftOutAndSaid) {
  Stand stand;
  stand.dark_beyond_mm = kStart_mm.x() + 60;
  const auto board = Must(stand.Drive());
  EXPECT_THAT(stand.told, HasSubstr(": 0 marks; fewer than 4, it is left out"));
  EXPECT_EQ(board.views.size(), 5U + 12U);
  EXPECT_TRUE(stand.back());
}

TEST(BoardDrive, WhereTooManyShowTooLittleItComesBackAndSaysWhy) {
  Stand stand;
  stand.before_picture = [&stand]() -> Result<void> {
    if (stand.kept.size() == 6) stand.dark_beyond_mm = 0;
    return {};
  };
  const auto board = stand.Drive();
  ASSERT_THAT(board, FailsWith(ErrorKind::kMeasurement,
                               "7 of 12 planned pictures show fewer than 4 marks"));
  EXPECT_LT(stand.board.views.size(), 5U + 12U);  // no longer than it takes to know
  EXPECT_TRUE(stand.back());
}

TEST(BoardDrive, WithoutTheBoardInViewNothingIsAskedOrMoved) {
  Stand stand;
  stand.dark_beyond_mm = 0;
  EXPECT_THAT(stand.Drive(), FailsWith("shows 0 of the sheet's 30 marks"));
  EXPECT_TRUE(stand.asked.empty());
  EXPECT_TRUE(stand.moves.empty());
}

TEST(BoardDrive, LimitsThatLeaveTooLittleAreRefusedAndItComesBack) {
  Stand stand;
  stand.options.route.travel.high_mm.z() = stand.options.route.safe_z_mm = kStart_mm.z() + 40;
  EXPECT_THAT(stand.Drive(), FailsWith(ErrorKind::kSafety, "the upper limit of Z"));
  EXPECT_TRUE(stand.back());

  Stand above;
  above.options.route.safe_z_mm = kStart_mm.z() - 1;
  EXPECT_THAT(above.Drive(), FailsWith("above the safe height"));
  EXPECT_TRUE(above.kept.empty());
}

TEST(BoardDrive, AnObstacleInTheWayIsRefusedBeforeItIsDrivenTo) {
  Stand stand;
  stand.options.route.camera_radius_mm = 40;
  stand.options.route.camera_below_mm = 350;
  stand.options.route.obstacles = {{{690, 0, 0}, {1200, 800, 250}}};
  EXPECT_THAT(stand.Drive(), FailsWith(ErrorKind::kSafety, "obstacle 1"));
  EXPECT_EQ(stand.asked.size(), 1U);
  EXPECT_TRUE(stand.back());
}

}  // namespace
}  // namespace trammel
