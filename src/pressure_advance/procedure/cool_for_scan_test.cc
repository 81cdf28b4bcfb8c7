#include "pressure_advance/procedure/cool_for_scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kLimit_s = 10;

// The fake's nozzle is at 205 °C and never cools: whatever waits for it fails.
TEST(CoolForScan, ZeroSwitchesOffAndWaitsForNothing) {
  testing::FakePrinter printer;
  const auto cooled = CoolForScan({printer, {}, {}}, printer.state, 0, kLimit_s);
  EXPECT_TRUE(cooled) << cooled.error().message;
  EXPECT_THAT(printer.scripts, ElementsAre("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=0"));
}

TEST(CoolForScan, AnyOtherTemperatureIsWaitedFor) {
  testing::FakePrinter printer;
  EXPECT_FALSE(CoolForScan({printer, {}, {}}, printer.state, 150, kLimit_s));
  EXPECT_THAT(printer.scripts, ElementsAre("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=150"));
  printer.state.heaters["extruder"] = {152, 150, true};
  EXPECT_TRUE(CoolForScan({printer, {}, {}}, printer.state, 150, kLimit_s));
}

TEST(CoolForScan, ANozzleThatIsColdStaysCold) {
  testing::FakePrinter printer;
  printer.state.heaters["extruder"] = {30, 0, false};
  EXPECT_TRUE(CoolForScan({printer, {}, {}}, printer.state, 150, kLimit_s));
  EXPECT_THAT(printer.scripts, IsEmpty());
}

}  // namespace
}  // namespace trammel::procedure
