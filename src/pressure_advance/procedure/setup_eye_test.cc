#include "pressure_advance/procedure/setup_eye.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "machine/net/host_clock.h"
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

class SetupEyeTest : public ::testing::Test {
 protected:
  SetupEyeTest() {
    settings_.settle_s = 0.01;
    settings_.lights_off_gcode = "LIGHTS_OFF";
    settings_.lights_on_gcode = "LIGHTS_ON";
    opened_.camera = std::make_unique<StillCamera>();
    opened_.recorder = std::make_unique<FrameRecorder>(*opened_.camera, 5);
  }
  [[nodiscard]] SetupEye Make() {
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
  Eye opened_;
  pressure_advance::PatternConfig config_;
  settings::ScanSettings settings_;
  test::TemporaryFolder folder_;
};

TEST_F(SetupEyeTest, GoesThereSwitchesTheLightAndKeepsThePicture) {
  SetupEye eye = Make();
  const auto picture = eye.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_TRUE(picture) << picture.error().message;
  EXPECT_EQ(picture->width, 48);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "stripe-01.jpg"));
  EXPECT_THAT(printer_.scripts, ElementsAre("G90\nG1 Z17.000 F300\nG1 X100.000 Y80.000 F9000",
                                            "M400", "LIGHTS_OFF", "M400", "_LASER_ON", "M400"));
}

TEST_F(SetupEyeTest, TheLaserGoesOffBeforeTheLightsGoOn) {
  SetupEye eye = Make();
  ASSERT_TRUE(eye.Look({100, 80, 17}, SetupLight::kRoom, "mark-01"));
  const auto off = std::ranges::find(printer_.scripts, "LASER_OFF");
  const auto on = std::ranges::find(printer_.scripts, "LIGHTS_ON");
  EXPECT_LT(off, on);
  EXPECT_NE(on, printer_.scripts.end());
  EXPECT_THAT(printer_.scripts, Not(Contains("_LASER_ON")));
}

TEST_F(SetupEyeTest, NothingMovesOutsideOfWhatIsClear) {
  SetupEye eye = Make();
  const auto picture = eye.Look({100, 80, 26}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().kind, ErrorKind::kSafety);
  EXPECT_TRUE(printer_.scripts.empty());
}

TEST_F(SetupEyeTest, NothingMovesWhileAnothersJobIsUnderWay) {
  SetupEye eye = Make();
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  const auto picture = eye.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(picture.error().message, HasSubstr("vase.gcode"));
  EXPECT_TRUE(printer_.scripts.empty());
}

TEST_F(SetupEyeTest, APictureThatGoesOnMovingIsNoneAndNamed) {
  opened_.recorder.reset();
  auto camera = std::make_unique<StillCamera>();
  camera->step = 5;
  opened_.camera = std::move(camera);
  opened_.recorder = std::make_unique<FrameRecorder>(*opened_.camera, 5);
  SetupEye eye = Make();
  const auto picture = eye.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_THAT(picture.error().message, HasSubstr("still moves"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "stripe-01.jpg"));
}

TEST_F(SetupEyeTest, AStopEndsItWhileThePictureIsWaitedFor) {
  settings_.settle_s = 60;
  SetupEye eye = Make();
  stop_.request_stop();
  const auto picture = eye.Look({100, 80, 17}, SetupLight::kLaser, "stripe-01");
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().kind, ErrorKind::kInterrupted);
}

}  // namespace
}  // namespace trammel::procedure
