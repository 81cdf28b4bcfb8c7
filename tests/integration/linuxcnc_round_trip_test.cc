// Path from pictures to a part point under the tool, with LinuxCNC itself as the controller.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "linuxcnc_fixture.h"
#include "part_alignment/correction/part_correction.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/alignment_world_test_support.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using part_alignment::MachineFromPart;
using test::kMicron_mm;

class LinuxCncRoundTrip : public test::LinuxCncFixture {
 protected:
  // Returns the machine's position at rest after a block of a program.
  static Vector3d Go(const std::string& block) { return At(Screen("mdi " + block)); }
  // Leaves LinuxCNC to the screen behind it.
  static Result<void> Write(int slot, const machine::LinuxCncOffset& offset) {
    const auto machine = Joined();
    return machine ? machine->WriteOffset(slot, offset, {}) : Fail("not joined");
  }
};

std::string Block(const Vector3d& point) {
  return fmt::format("G0 X{:.6f} Y{:.6f} Z{:.6f}", point.x(), point.y(), point.z());
}

TEST_F(LinuxCncRoundTrip, AWrittenOffsetTakesPartPointsWhereThePartHasThem) {
  const Pose part{{-312.3456, 77.25, -410.5}, {0, 0, -0.4321}};
  const double deg = part.angles_rad.z() * 180 / std::numbers::pi;
  Must(Write(3, {part.translation_mm, deg}));
  Screen("mdi G21 G90 G56");
  for (const Vector3d& point :
       {Vector3d(0, 0, 0), Vector3d(1500, 0, 20), Vector3d(-100, 900, -5)}) {
    const Vector3d miss_mm = Go(Block(point)) - MachineFromPart(part, point);
    EXPECT_LT(miss_mm.norm(), kMicron_mm) << point.transpose() << ": " << miss_mm.transpose();
  }
}

// Given noise-free pictures of a tilted part: shims by the model of the fixture, then the offset.
TEST_F(LinuxCncRoundTrip, FromPicturesToAPartPointWithinAMicron) {
  const test_support::AlignmentWorld world = [] {
    test_support::AlignmentWorld made = test_support::BenchWorld();
    Random random(1);
    test_support::TakePictures(made, 0, random);
    return made;
  }();
  constexpr double kSigma_px = 0.05;
  files::AlignmentInput input;
  input.measurement = part_alignment::MeasurementOf(world, kSigma_px);
  test::WriteWhole(folder_.path() / "seen.json", files::AlignmentFileText(input));
  test::WriteWhole(folder_.path() / "supports.json", R"({"format": 1, "supports": [
    {"id": 1, "part_mm": [-700, -450, -80], "direction": [0, 0, 1]},
    {"id": 2, "part_mm": [700, -450, -80], "direction": [0, 0, 1]},
    {"id": 3, "part_mm": [0, 450, -80], "direction": [0, 0, 1]}]})");
  ASSERT_THAT(test::RunTrammel("align solve seen.json --out result.json", folder_.path()), Ends(0));
  const auto corrected = test::RunTrammel(
      "align correct result.json --supports supports.json --after-shims --json --write session "
      "--joints 4 --c-axis",
      folder_.path());
  ASSERT_THAT(corrected, Notes("read back and equal"));
  const auto json = nlohmann::json::parse(corrected.standard_output);
  fmt::print("remainder after the shims: {} mm at most, tilts {} mm/m\n",
             json["remainder"]["largest_mm"].dump(), json["remainder"]["tilt_mm_per_m"].dump());

  // The true part on the same fixture, moved by the shims that the command printed.
  std::vector<part_alignment::Support> supports = {{"1", {-700, -450, -80}, Vector3d::UnitZ()},
                                                   {"2", {700, -450, -80}, Vector3d::UnitZ()},
                                                   {"3", {0, 450, -80}, Vector3d::UnitZ()}};
  const Pose& truth = world.machine_from_part;
  const auto moved = Must(
      part_alignment::CorrectFixture(truth, supports, {0, 0, truth.angles_rad.z()}, std::nullopt));
  for (std::size_t i = 0; i < supports.size(); ++i) {
    EXPECT_NEAR(json["fixture"]["supports"][i]["shim_mm"], moved.moves[i].shim_mm, 1e-6);
  }
  const double left_mm = json["remainder"]["largest_mm"];
  EXPECT_LT(left_mm, kMicron_mm);
  Screen("mdi G21 G90 G54");
  for (const Vector3d& point : world.targets_mm) {
    const Vector3d miss_mm = Go(Block(point)) - MachineFromPart(moved.machine_from_part, point);
    EXPECT_LT(miss_mm.norm(), kMicron_mm) << point.transpose() << ": " << miss_mm.transpose();
  }
}

TEST_F(LinuxCncRoundTrip, AToolsLengthIsAddedBehindTheRotation) {
  ASSERT_TRUE(Write(1, {{10, 20, 30}, 90}));
  Screen("mdi G21 G90 G54 G43.1 X1 Z5");
  const Vector3d at = Go("G0 X2 Y0 Z0");
  Screen("mdi G49");
  EXPECT_LT((at - Vector3d(11, 22, 35)).norm(), kMicron_mm) << at.transpose();
}

TEST_F(LinuxCncRoundTrip, InchesAreLeftOnAndReadRightly) {
  Screen("mdi G20");
  {
    const auto machine = Joined();
    Must(machine->WriteOffset(4, {{25.4, -50.8, 0}, 1}, {}));
    const auto offsets = Must(machine->ReadOffsets(4, {}));
    EXPECT_FALSE(offsets.metric);
    EXPECT_NEAR(offsets.offset.origin_mm.x(), 25.4, 1e-6);
  }
  Screen("mdi G21");
}

}  // namespace
}  // namespace trammel
