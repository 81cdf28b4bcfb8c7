#include "pressure_advance/procedure/setup_route.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <thread>

#include "machine/net/host_clock.h"
#include "pressure_advance/procedure/setup.h"
#include "session/fake_printer.h"
#include "support/temporary_folder.h"
#include "support/test_pictures.h"

namespace trammel::procedure {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Sends one picture all the time, or another one each time.
class StillCamera final : public machine::FrameSource {
 public:
  int step = 0;
  Result<std::optional<machine::CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    machine::CapturedFrame frame;
    const std::string jpeg = test::JpegOf(test::TestPicture(48, 32, shift_ += step));
    frame.image.assign(jpeg.begin(), jpeg.end());
    frame.width_px = 48, frame.height_px = 32;
    frame.arrival_s = machine::HostNow();
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "still"; }
  [[nodiscard]] bool live() const override { return true; }

 private:
  int shift_ = 3;
};

class SetupReaderTest : public ::testing::Test {
 protected:
  SetupReaderTest() {
    settings_.settle_s = 0.01;
    settings_.lights_off_gcode = "LIGHTS_OFF";
    settings_.lights_on_gcode = "LIGHTS_ON";
    opened_.camera = std::make_unique<StillCamera>();
    opened_.recorder = std::make_unique<FrameRecorder>(*opened_.camera, 5);
  }
  [[nodiscard]] SetupReader Make() {
    return {session_,
            opened_,
            config_,
            settings_,
            ClearHeights{12, 25},
            Reach{{0, 0, 0}, {250, 250, 240}},
            folder_.path()};
  }
  testing::FakePrinter printer_;
  std::stop_source stop_;
  Session session_{printer_, stop_.get_token(), {}};
  OpenedCamera opened_;
  pressure_advance::PatternConfig config_;
  settings::ScanSettings settings_;
  test::TemporaryFolder folder_;
};

TEST_F(SetupReaderTest, GoesThereSwitchesTheLightAndKeepsThePicture) {
  SetupReader reader = Make();
  const auto picture = reader.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_TRUE(picture) << picture.error().message;
  EXPECT_EQ(picture->width, 48);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "stripe-01.jpg"));
  EXPECT_THAT(printer_.scripts, ElementsAre("G90\nG1 Z17.000 F300\nG1 X100.000 Y80.000 F9000",
                                            "M400", "LIGHTS_OFF", "M400", "_LASER_ON", "M400"));
}

TEST_F(SetupReaderTest, TheLaserGoesOffBeforeTheLightsGoOn) {
  SetupReader reader = Make();
  ASSERT_TRUE(reader.Look({100, 80, 17}, SetupLight::kRoom, "mark-01"));
  const auto off = std::ranges::find(printer_.scripts, "LASER_OFF");
  const auto on = std::ranges::find(printer_.scripts, "LIGHTS_ON");
  EXPECT_LT(off, on);
  EXPECT_NE(on, printer_.scripts.end());
  EXPECT_THAT(printer_.scripts, Not(Contains("_LASER_ON")));
}

TEST_F(SetupReaderTest, NothingMovesOutsideOfWhatIsClear) {
  SetupReader reader = Make();
  const auto picture = reader.Look({100, 80, 26}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().kind, ErrorKind::kSafety);
  EXPECT_TRUE(printer_.scripts.empty());
}

TEST_F(SetupReaderTest, NothingMovesWhileAnothersJobIsUnderWay) {
  SetupReader reader = Make();
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  const auto picture = reader.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(picture.error().message, HasSubstr("vase.gcode"));
  EXPECT_TRUE(printer_.scripts.empty());
}

TEST_F(SetupReaderTest, APictureThatGoesOnMovingIsNoneAndNamed) {
  opened_.recorder.reset();
  auto camera = std::make_unique<StillCamera>();
  camera->step = 5;
  opened_.camera = std::move(camera);
  opened_.recorder = std::make_unique<FrameRecorder>(*opened_.camera, 5);
  SetupReader reader = Make();
  const auto picture = reader.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_THAT(picture.error().message, HasSubstr("still moves"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "stripe-01.jpg"));
}

TEST_F(SetupReaderTest, AStopEndsItWhileThePictureIsWaitedFor) {
  settings_.settle_s = 60;
  SetupReader reader = Make();
  stop_.request_stop();
  const auto picture = reader.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().kind, ErrorKind::kInterrupted);
}

using pressure_advance::HeadPlace;
using pressure_advance::MarkReading;
using ::testing::AllOf;
using ::testing::Each;

constexpr double kExact = 1e-9;
constexpr Reach kReach = {{0, 0, 0}, {250, 250, 240}};

std::string RefusalOf(double low_mm, double high_mm) {
  const auto done = CheckClearHeights({low_mm, high_mm}, {}, kReach);
  return done ? "" : done.error().message;
}

TEST(SetupRoute, HeightsThatAreTooFewOutsideTheReachOrWithoutTheFocusAreNamed) {
  EXPECT_EQ(RefusalOf(12, 25), "");
  EXPECT_THAT(RefusalOf(16, 20), AllOf(HasSubstr("leaves 3.00 mm"), HasSubstr("5 mm are needed")));
  EXPECT_THAT(RefusalOf(25, 12), HasSubstr("the lower height comes first"));
  EXPECT_THAT(RefusalOf(19, 30), HasSubstr("leaves out [camera] focus_height, 17.86 mm"));
  EXPECT_THAT(RefusalOf(12, 300), HasSubstr("0.00 to 240.00 mm"));
  const auto below = CheckClearHeights({-2, 25}, {}, {{0, 0, -5}, {250, 250, 240}});
  ASSERT_FALSE(below);
  EXPECT_EQ(below.error().kind, ErrorKind::kSafety);
}

TEST(SetupRoute, HeightsRiseAndFallWithinWhatIsClearWithTheirApproach) {
  HeadPlace at;
  at.z_mm = 17.86;
  const ClearHeights clear{15, 20};
  const auto places = SweepHeights(at, 4, 1, clear);
  ASSERT_EQ(places.size(), 8U);  // 15.86 to 18.86 mm, twice
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(places[i].from_z, i < 4 ? 1 : -1);
    EXPECT_NEAR(places[i].z_mm, 15.86 + static_cast<double>(i < 4 ? i : 7 - i), kExact);
    EXPECT_TRUE(CheckPlace({125, 125, places[i].z_mm, 0, 0, places[i].from_z}, clear, kReach));
  }
}

TEST(SetupRoute, NoPlaceOutsideOfReachOrClearHeightsPasses) {
  const ClearHeights clear{15, 20};
  EXPECT_TRUE(CheckPlace({125, 125, 17}, clear, kReach));
  for (const HeadPlace& place :
       {HeadPlace{-0.1, 125, 17}, HeadPlace{125, 249.8, 17}, HeadPlace{125, 125, 14.9},
        HeadPlace{125, 125, 20.1}, HeadPlace{125, 125, 15.2, 0, 0, 1}}) {
    const auto done = CheckPlace(place, clear, kReach);
    ASSERT_FALSE(done) << place.x_mm << " " << place.y_mm << " " << place.z_mm;
    EXPECT_EQ(done.error().kind, ErrorKind::kSafety);
  }
}

TEST(SetupRoute, TheMarkComesToThePixelWhicheverWayTheCameraIsTurnedOrMirrored) {
  for (const double turn_rad : {0.0, 0.05, 1.5, 3.14}) {
    for (const double mirror : {1.0, -1.0}) {
      const double c = 40 * std::cos(turn_rad), s = 40 * std::sin(turn_rad);
      const MarkMotion motion{-c * mirror, -s, -s * mirror, c};
      MarkReading seen;
      seen.column_px = 700, seen.row_px = 200;
      const HeadPlace place = BringMark({100, 80, 17}, seen, 640, 360, motion);
      const double dx = place.x_mm - 100, dy = place.y_mm - 80;
      EXPECT_NEAR(700 + dx * motion.column_per_x + dy * motion.column_per_y, 640, 1e-6);
      EXPECT_NEAR(200 + dx * motion.row_per_x + dy * motion.row_per_y, 360, 1e-6);
    }
  }
}

TEST(SetupRoute, ThePlateIsLookedAtBesideTheMarkWhereTheHeadReachesIt) {
  pressure_advance::MarkPlan mark;
  mark.x_mm = 139, mark.y_mm = 150, mark.run_in_y_mm = 125;
  const auto behind = PlaceBesideMark(mark, {}, kReach);
  ASSERT_TRUE(behind);
  EXPECT_NEAR(behind->x_mm, 139 - 28, kExact);
  EXPECT_GT(behind->y_mm, 150 - 50.2 + 10);
  const auto in_front = PlaceBesideMark(mark, {}, {{0, 0, 0}, {250, 110, 240}});
  ASSERT_TRUE(in_front);
  EXPECT_LT(in_front->y_mm, 150 - 50.2 - 10);
  const auto nowhere = PlaceBesideMark(mark, {}, {{0, 0, 0}, {100, 250, 240}});
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(nowhere.error().message, HasSubstr("--mark-at"));
}

TEST(SetupRoute, MovesAreAbsoluteAndEndAtThePlaceAfterTheApproach) {
  pressure_advance::PatternConfig config;
  EXPECT_EQ(GcodeTo({100, 80, 17.86, 1, -1, 1}, config),
            "G90\nG1 Z17.360 F300\nG1 Z17.860 F300\nG1 X99.500 Y80.500 F9000\n"
            "G1 X100.000 Y80.000 F9000");
  EXPECT_EQ(GcodeTo({100, 80, 17.86}, config), "G90\nG1 Z17.860 F300\nG1 X100.000 Y80.000 F9000");
}

class SetUpCameraTest : public ::testing::Test {
 protected:
  SetUpCameraTest() {
    request_.pattern.material = "pla";
    request_.clear = {12, 25};
    request_.identity.run = "run-1";
    request_.folder = folder_.path();
    request_.identity.state_folder = folder_.path();
  }
  // REQUIRES that it cannot begin.
  Error Refusal() {
    const auto outcome = SetUpCamera({printer_, {}, {}}, request_);
    EXPECT_FALSE(outcome.done);
    EXPECT_EQ(outcome.record.result.verdict(), Verdict::kRefused);
    const bool moved = std::ranges::any_of(printer_.scripts, [](const std::string& script) {
      return script.find("G1") != std::string::npos || script.find("G28") != std::string::npos ||
             script.find("M104") != std::string::npos || script == "_LASER_ON";
    });
    EXPECT_FALSE(moved) << "moved, heated or lit before it was refused";
    return outcome.done ? Error{} : outcome.done.error();
  }
  testing::FakePrinter printer_;
  test::TemporaryFolder folder_;
  SetupRequest request_;
};

TEST_F(SetUpCameraTest, NothingIsHeatedWithoutAMaterial) {
  request_.pattern.material.clear();
  EXPECT_THAT(Refusal().message, HasSubstr("material"));
}

TEST_F(SetUpCameraTest, ALaserThatCannotBeSwitchedOffIsNeverSwitchedOn) {
  request_.settings.laser_off_gcode.clear();
  EXPECT_THAT(Refusal().message, HasSubstr("laser_off_gcode"));
}

TEST_F(SetUpCameraTest, AMarkOutsideOfTheBedOrTheHeadsReachIsASafetyMatter) {
  request_.mark = {245, 245};
  EXPECT_EQ(Refusal().kind, ErrorKind::kSafety);
  request_.mark = {20, 150};  // the nozzle would have to stand at x = -8 mm to look at it
  const Error error = Refusal();
  EXPECT_EQ(error.kind, ErrorKind::kSafety);
  EXPECT_THAT(error.message, HasSubstr("--mark-at"));
}

}  // namespace
}  // namespace trammel::procedure
