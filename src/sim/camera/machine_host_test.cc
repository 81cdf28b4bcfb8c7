#include "sim/camera/machine_host.h"

#include <gtest/gtest.h>

namespace trammel::sim {
namespace {

void Play(const MachineHost& host, double& time_s, double seconds, const char* script) {
  host.With([&](VirtualKlipper& klipper) {
    (void)klipper.RunScript(script);
    klipper.Advance(host.MachineTime(time_s + seconds));
  });
  time_s += seconds;
}

TEST(MachineHost, ShowsWhereTheHeadReallyIsAndWhatShines) {
  MachineOptions options;
  const MachineHost host(options, 1000);
  EXPECT_DOUBLE_EQ(host.At(1000).x_mm, options.klipper.physical_start_mm[0]);
  EXPECT_TRUE(host.At(1000).lights_on);
  double time_s = 1000;
  Play(host, time_s, 40, "G28\nG1 X100 Y50 Z18 F6000\nM400\nLIGHTS_OFF\n_LASER_ON");
  Play(host, time_s, 3, "G1 X130 F400");
  const MachineView view = host.At(time_s);
  EXPECT_NEAR(view.speed_mm_s, 400.0 / 60, 1e-9);
  EXPECT_GT(view.x_mm, 110);
  EXPECT_LT(view.x_mm, 130);
  EXPECT_DOUBLE_EQ(view.z_mm, 18);
  EXPECT_TRUE(view.laser_on);
  EXPECT_FALSE(view.lights_on);
  // A moment ago, as cameras ask.
  EXPECT_NEAR(view.x_mm - host.At(time_s - 0.5).x_mm, 0.5 * 400 / 60, 1e-6);
}

TEST(MachineHost, WhatWasSeenOnceStaysSoHoweverLateTheServerComes) {
  const MachineHost host(MachineOptions{}, 1000);
  double time_s = 1000;
  Play(host, time_s, 40, "G28\nG1 X100 Y50 Z18 F6000\nM400");
  // The camera looks while the server is kept from its processor for half a second; then a move
  // comes.
  const MachineView seen = host.At(time_s + 0.5);
  Play(host, time_s, 2, "G1 X130 F400");
  EXPECT_DOUBLE_EQ(host.At(1040.5).x_mm, seen.x_mm);
  EXPECT_GT(host.At(1042).x_mm, seen.x_mm + 1);
}

TEST(MachineHost, HurriesOnlyWhereNoLaserHasShoneForTenSeconds) {
  MachineOptions options;
  options.hurry = 20;
  const MachineHost host(options, 1000);
  (void)host.At(1000);
  EXPECT_NEAR(host.MachineTime(1001), 1, 1e-9) << "idle";
  // Cools down, for longer than this test.
  host.With([](VirtualKlipper& klipper) { klipper.bed.temperature_c = 1e6; });
  EXPECT_NEAR(host.MachineTime(1002), 1 + 20, 1e-9);
  double time_s = 1002;
  Play(host, time_s, 1, "_LASER_ON");
  const double lit_s = host.MachineTime(time_s);
  Play(host, time_s, 60, "");
  EXPECT_NEAR(host.MachineTime(time_s), lit_s + 60, 1e-9);
  Play(host, time_s, 1, "LASER_OFF");
  Play(host, time_s, 8, "");
  const double dark_s = host.MachineTime(time_s);
  EXPECT_NEAR(dark_s, lit_s + 69, 1e-9);
  Play(host, time_s, 3, "");
  const double hurried_s = host.MachineTime(time_s);
  EXPECT_NEAR(host.MachineTime(time_s + 1), hurried_s + 20, 1e-9);
}

TEST(MachineHost, TheBedHoldsWhatWasPrintedAndNothingElse) {
  MachineOptions options;
  options.seed = 11;
  const MachineHost host(options, 0);
  EXPECT_GE(host.true_pressure_advance_s(), 0.015);
  EXPECT_LE(host.true_pressure_advance_s(), 0.045);
  double time_s = 0;
  EXPECT_TRUE(host.bed(time_s)->strands.empty());
  Play(host, time_s, 60, "G28\nM104 S210\nM109 S210\nM83\nG1 X100 Y100 Z0.25 F6000\nM400");
  EXPECT_TRUE(host.bed(time_s)->strands.empty());
  const std::shared_ptr<const Bed> clean = host.bed(time_s);
  Play(host, time_s, 20,
       "G1 X107.5 E0.344 F300\nG1 X122.5 E0.688 F9000\nG1 X130 E0.344 F300\nG1 Z5\nM400");
  const std::shared_ptr<const Bed> printed = host.bed(time_s);
  EXPECT_NE(printed, clean);
  ASSERT_FALSE(printed->strands.empty());
  const Strand& strand = printed->strands.back();
  EXPECT_NEAR(strand.samples.front().x_mm, 100, 0.1);
  EXPECT_NEAR(strand.samples.back().x_mm, 130, 0.1);
  EXPECT_EQ(host.bed(time_s), printed) << "nothing was added";
  host.With([&](VirtualKlipper& klipper) { klipper.files()["next.gcode"] = "G4 P1\n"; });
  Play(host, time_s, 1, "SDCARD_PRINT_FILE FILENAME=next.gcode");
  EXPECT_TRUE(host.bed(time_s)->strands.empty()) << "a new job begins on a clean plate";
}

}  // namespace
}  // namespace trammel::sim
