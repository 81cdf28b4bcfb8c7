#include "pressure_advance/procedure/laser_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "machine/net/host_clock.h"
#include "session/fake_printer.h"
#include "support/laser_world.h"
#include "support/test_pictures.h"

namespace trammel::procedure {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Check CheckDrawn(const test::LaserWorld& world) {
  Random random(1);
  machine::CapturedFrame frame;
  const std::string jpeg = test::JpegOf(test::DrawLaserFrame(world, 0, random), 90);
  frame.image.assign(jpeg.begin(), jpeg.end());
  settings::ScanSettings settings;
  settings.px_per_mm = 44;
  return CheckLaserLine(frame, settings);
}

test::LaserWorld WholePicture() {
  test::LaserWorld world;
  world.width = 320;
  world.height = 240;
  world.plate_column_px = 170;
  world.plate_amplitude = 180;
  return world;
}

TEST(LaserCheck, ASharpLinePassesWithItsWidth) {
  const Check check = CheckDrawn(WholePicture());
  EXPECT_TRUE(check.passed);
  EXPECT_THAT(check.detail, AllOf(HasSubstr("px (0.1"), HasSubstr("grey levels over the plate")));
}

TEST(LaserCheck, WhatIsWrongWithTheLineIsAdviceWithItsRemedy) {
  test::LaserWorld blurred = WholePicture();
  blurred.stripe_sigma_px = 8;
  blurred.plate_amplitude = 110;
  const Check wide = CheckDrawn(blurred);
  EXPECT_FALSE(wide.passed);
  EXPECT_TRUE(wide.advice);
  EXPECT_THAT(wide.detail, AllOf(HasSubstr("out of focus"), HasSubstr("focus_height")));
  test::LaserWorld dim = WholePicture();
  dim.plate_amplitude = 15;
  dim.noise = 0.5;
  EXPECT_THAT(CheckDrawn(dim).detail, HasSubstr("raise the camera's exposure"));
  test::LaserWorld burnt = WholePicture();
  burnt.plate_amplitude = 4000;
  EXPECT_THAT(CheckDrawn(burnt).detail, HasSubstr("overexposed"));
}

class DarkCamera final : public machine::FrameSource {
 public:
  Result<std::optional<machine::CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    machine::CapturedFrame frame;
    const std::string jpeg = test::JpegOf(test::TestPicture(48, 32, 3));
    frame.image.assign(jpeg.begin(), jpeg.end());
    frame.width_px = 48, frame.height_px = 32;
    frame.arrival_s = machine::HostNow();
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "dark"; }
  [[nodiscard]] bool live() const override { return true; }
};

TEST(LaserCheck, LightsNoLaserInAnothersPrint) {
  testing::FakePrinter printer;
  printer.state.print_state = "printing";
  printer.state.print_file = "vase.gcode";
  DarkCamera camera;
  FrameRecorder recorder(camera, 5);
  const auto seen = CheckLaser({printer, {}, {}}, recorder, {});
  ASSERT_FALSE(seen);
  EXPECT_THAT(seen.error().message, HasSubstr("vase.gcode is printing"));
  EXPECT_THAT(printer.scripts, IsEmpty());
}

TEST(LaserCheck, APictureThatCannotBeReadIsNoPass) { EXPECT_FALSE(CheckLaserLine({}, {}).passed); }

}  // namespace
}  // namespace trammel::procedure
