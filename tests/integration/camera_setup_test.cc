// trammel pa setup against virtual printers whose laser and camera sit otherwise than the settings
// say: what it finds, what it refuses, and how it leaves the machine.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "fault_scenario.h"
#include "setup_scene.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

using ::testing::IsEmpty;

constexpr double kDegree = 0.017453292519943295;
// Tolerances of the values: a scan at 0.05 mm, heights at 1 %.
const std::map<std::string, double> kBorne = {
    {"offset_x_mm", 0.05}, {"offset_y_mm", 0.05},   {"focus_height_mm", 0.2}, {"px_per_mm", 0.01},
    {"rotation_deg", 0.3}, {"laser_turn_deg", 0.3}, {"laser_sheet_deg", 1}};

sim::MountedRig Wrong() {
  sim::MountedRig rig;
  rig.mount.offset_x_mm += 4;
  rig.mount.offset_y_mm -= 4;
  rig.mount.focus_height_mm -= 1;
  rig.rig.scale = 1.1;
  rig.rig.camera_turn_rad = 3 * kDegree;
  return rig;
}

TEST(CameraSetup, FindsHowLaserAndCameraSitAndLeavesThePrinterAsItWas) {
  constexpr std::uint64_t kSeed = 7;
  MachineShop shop(SetupHall(kSeed, Wrong()));
  shop.Script(kWorkedWith);
  const PrinterLook before = shop.Look();
  const std::string settings = ReadWhole(shop.folder() / "trammel.toml");
  const ProcessEnd end = shop.Run(SetupArguments(shop, {"--json"}));
  ASSERT_EQ(end.exit_code, 0) << end.standard_error << end.standard_output;
  const auto answer = nlohmann::json::parse(end.standard_output);
  for (const SetupError& error : SetupErrors(answer, TruthOf(kSeed, Wrong()))) {
    EXPECT_LT(std::abs(error.error), kBorne.at(error.name)) << error.name;
    EXPECT_LT(std::abs(error.error), 4 * error.standard_uncertainty) << error.name;
    std::printf("%-16s off by %+.4f, u = %.4f\n", error.name.c_str(), error.error,
                error.standard_uncertainty);
  }
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
  EXPECT_EQ(ReadWhole(shop.folder() / "trammel.toml"), settings) << "nothing is written unasked";
  for (const char* name : {"setup.json", "camera.toml", "lit.jpg"}) {
    EXPECT_TRUE(std::filesystem::exists(shop.folder() / "set" / name)) << name;
  }
}

TEST(CameraSetup, ALaserThatIsNotSeenIsNamedBeforeAnythingIsPrinted) {
  sim::MountedRig rig;
  rig.rig.laser_brightness = 0;
  MachineShop shop(SetupHall(7, rig));
  const PrinterLook before = shop.Look();
  EXPECT_THAT(shop.Run(SetupArguments(shop)),
              Prints(2, "no laser stripe goes through the picture"));
  EXPECT_FALSE(std::filesystem::exists(shop.folder() / "set" / "mark.gcode"));
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
}

TEST(CameraSetup, AnInterruptionWithTheLaserOnLeavesThePrinterAsItWas) {
  MachineShop shop(SetupHall(7, {}));
  shop.Script(kWorkedWith);
  const PrinterLook before = shop.Look();
  TrammelProcess process(SetupArguments(shop, {"--write", "new.toml"}), shop.folder());
  shop.WaitUntil([](sim::VirtualKlipper& klipper) { return klipper.pins.at("LASER") > 0; },
                 "the laser was on", process);
  process.Send(SIGINT);
  EXPECT_THAT(process.Wait(), Ends(130));
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(shop.folder() / "new.toml"));
}

}  // namespace
}  // namespace trammel::test
