// From pictures to a part point under the tool, with LinuxCNC itself as the controller.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "machine/linuxcnc/linuxcnc.h"
#include "machine/net/host_clock.h"
#include "part_alignment/correction/part_correction.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/alignment_world_test_support.h"
#include "real_linuxcnc.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using machine::LinuxCnc;
using machine::LinuxCncOptions;
using machine::LinuxCncShell;
using part_alignment::MachineFromPart;
using test::RealLinuxCnc;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kMicron_mm = 1e-3;

LinuxCncOptions Options() {
  LinuxCncOptions options;
  options.joints = 4;
  options.c_holds_spindle = true;
  options.address.time_limit_s = 20;
  return options;
}

void WaitFor(const std::function<bool()>& what) {
  const double end_s = machine::HostNow() + 20;
  while (!what() && machine::HostNow() < end_s) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

class LinuxCncRoundTrip : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    // Before anything else: the port is surely free in a network of our own.
    const bool own = RealLinuxCnc::EnterOwnNetwork();
    why_not_ = RealLinuxCnc::WhyNot();
    if (!why_not_.empty()) return;
    if (!own)
      fmt::print(stderr, "no network of its own: LinuxCNC's shell is open to the network\n");
    linuxcnc_ = new RealLinuxCnc;
  }
  static void TearDownTestSuite() {
    delete linuxcnc_;
    linuxcnc_ = nullptr;
  }
  void SetUp() override {
    if (!why_not_.empty()) {
      fmt::print(stderr, "\n*** SKIPPED, NOT TESTED against LinuxCNC: {}\n\n", why_not_);
      GTEST_SKIP() << why_not_;
    }
    ASSERT_TRUE(linuxcnc_->up()) << linuxcnc_->log();
    auto shell = LinuxCncShell::Connect(Options().address, {});
    ASSERT_TRUE(shell) << shell.error().message;
    shell_.emplace(std::move(*shell));
    // Acknowledged is not done: on a busy computer the next one is refused for a while.
    for (const auto& [name, state] : {std::pair{"estop", "OFF"}, std::pair{"machine", "ON"}}) {
      WaitFor([&] {
        (void)shell_->Set(fmt::format("{} {}", name, state), {});
        return shell_->Get(name, {}) == state;
      });
    }
    const auto homed = [this] { return shell_->Get("joint_homed", {}) == "YES YES YES YES NO NO"; };
    if (!homed()) {
      WaitFor([this] { return shell_->Set("mode manual", {}).has_value(); });
      ASSERT_TRUE(shell_->Set("home -1", {}));
      WaitFor(homed);
    }
    ASSERT_TRUE(shell_->Set("mode mdi", {}));
    WaitFor([this] { return shell_->Get("mode", {}) == "MDI"; });
    WaitFor([this] { return shell_->Get("error", {}) == "OK"; });
  }

  // A block as a program has it. Takes control, which the last one who asked has: a LinuxCnc that
  // was made before is of no more use then.
  void Mdi(const std::string& block) {
    ASSERT_TRUE(shell_->Set("enable EMCTOO", {}));
    const auto set = shell_->Set("mdi " + block, {});
    ASSERT_TRUE(set) << set.error().message;
  }
  [[nodiscard]] Vector3d Position() {
    std::istringstream text(shell_->Get("abs_act_pos", {}).value_or(""));
    Vector3d at = Vector3d::Constant(NAN);
    text >> at.x() >> at.y() >> at.z();
    return at;
  }
  // Where the machine comes to rest behind a block.
  [[nodiscard]] Vector3d Go(const std::string& block) {
    Mdi(block);
    Vector3d last = Vector3d::Constant(NAN);
    int still = 0;
    WaitFor([&] {
      const Vector3d now = Position();
      still = (now - last).norm() < 1e-7 ? still + 1 : 0;
      last = now;
      return still >= 10 && shell_->Get("program_status", {}) == "IDLE";
    });
    EXPECT_EQ(shell_->Get("error", {}), "OK") << block;
    return last;
  }
  [[nodiscard]] std::unique_ptr<LinuxCnc> Machine() const {
    auto machine = LinuxCnc::Connect(Options(), {});
    EXPECT_TRUE(machine) << machine.error().message;
    return machine ? std::move(*machine) : nullptr;
  }

  static inline std::string why_not_;
  static inline RealLinuxCnc* linuxcnc_ = nullptr;
  std::optional<LinuxCncShell> shell_;
  test::TemporaryFolder folder_;
};

std::string Block(const Vector3d& point) {
  return fmt::format("G0 X{:.6f} Y{:.6f} Z{:.6f}", point.x(), point.y(), point.z());
}

TEST_F(LinuxCncRoundTrip, AWrittenOffsetTakesPartPointsWhereThePartHasThem) {
  const Pose part{{-312.3456, 77.25, -410.5}, {0, 0, -0.4321}};
  const auto machine = Machine();
  ASSERT_TRUE(machine);
  const double deg = part.angles_rad.z() * 180 / std::numbers::pi;
  const auto written = machine->WriteOffset(3, {part.translation_mm, deg}, {});
  ASSERT_TRUE(written) << written.error().message;
  Mdi("G21 G90 G56");
  for (const Vector3d& point :
       {Vector3d(0, 0, 0), Vector3d(1500, 0, 20), Vector3d(-100, 900, -5)}) {
    const Vector3d miss_mm = Go(Block(point)) - MachineFromPart(part, point);
    EXPECT_LT(miss_mm.norm(), kMicron_mm) << point.transpose() << ": " << miss_mm.transpose();
  }
}

// From noise-free pictures of a tilted part: shims by the model of the fixture, then the offset.
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
  const auto solved = test::RunTrammel("align solve seen.json --out result.json", folder_.path());
  ASSERT_EQ(solved.exit_code, 0) << solved.output;
  const auto corrected = test::RunTrammel(
      "align correct result.json --supports supports.json --after-shims --json --write 127.0.0.1 "
      "--joints 4 --c-axis",
      folder_.path());
  ASSERT_EQ(corrected.exit_code, 0) << corrected.output;
  EXPECT_THAT(corrected.standard_error, HasSubstr("read back and equal"));
  const auto json = nlohmann::json::parse(corrected.standard_output);
  fmt::print("remainder after the shims: {} mm at most, tilts {} mm/m\n",
             json["remainder"]["largest_mm"].dump(), json["remainder"]["tilt_mm_per_m"].dump());

  // The true part on the same fixture, moved by the shims that the command printed.
  std::vector<part_alignment::Support> supports = {{"1", {-700, -450, -80}, Vector3d::UnitZ()},
                                                   {"2", {700, -450, -80}, Vector3d::UnitZ()},
                                                   {"3", {0, 450, -80}, Vector3d::UnitZ()}};
  const Pose& truth = world.machine_from_part;
  const auto moved =
      part_alignment::CorrectFixture(truth, supports, {0, 0, truth.angles_rad.z()}, std::nullopt);
  ASSERT_TRUE(moved);
  for (std::size_t i = 0; i < supports.size(); ++i) {
    EXPECT_NEAR(json["fixture"]["supports"][i]["shim_mm"], moved->moves[i].shim_mm, 1e-6);
  }
  const double left_mm = json["remainder"]["largest_mm"];
  EXPECT_LT(left_mm, kMicron_mm);
  Mdi("G21 G90 G54");
  for (const Vector3d& point : world.targets_mm) {
    const Vector3d miss_mm = Go(Block(point)) - MachineFromPart(moved->machine_from_part, point);
    EXPECT_LT(miss_mm.norm(), kMicron_mm) << point.transpose() << ": " << miss_mm.transpose();
  }
}

// The virtual spindle's pictures in a folder; the controller drives through the places at which
// they were taken, and G10 sets what they say.
TEST_F(LinuxCncRoundTrip, MeasureDrivesThroughEveryViewAndItsOffsetIsSet) {
  const auto made = test::RunTrammel("sim spindle --out shop --seed 11", folder_.path());
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const auto views =
      nlohmann::json::parse(test::ReadWhole(folder_.path() / "shop/views.json"))["views"];
  double safe_z_mm = -1e9;
  for (const auto& view : views) {
    safe_z_mm = std::max(safe_z_mm, double(view["spindle_mm"][2]) + 50);
  }
  const auto measured = test::RunTrammel(
      fmt::format("align measure shop/views.json --source shop --machine 127.0.0.1 "
                  "--joints 4 --c-axis --safe-z {} --feed 60000",
                  safe_z_mm),
      folder_.path());
  ASSERT_EQ(measured.exit_code, 0) << measured.output;
  // Up again behind the last view.
  EXPECT_LT((Position() -
             Vector3d(views.back()["spindle_mm"][0], views.back()["spindle_mm"][1], safe_z_mm))
                .norm(),
            kMicron_mm);
  test::WriteWhole(folder_.path() / "result.json", measured.standard_output);
  const auto corrected = test::RunTrammel(
      "align correct result.json --write 127.0.0.1 --joints 4 --c-axis", folder_.path());
  ASSERT_EQ(corrected.exit_code, 0) << corrected.output;
  const auto result = nlohmann::json::parse(measured.standard_output);
  const Vector3d part_mm(result["part_mm"][0], result["part_mm"][1], result["part_mm"][2]);
  Mdi("G21 G90 G54");
  EXPECT_LT((Go("G0 X0 Y0 Z0") - part_mm).norm(), kMicron_mm);
}

TEST_F(LinuxCncRoundTrip, WithoutShimsThePointMissesByTheRemainderThatWasPrinted) {
  const Pose part{{100, 200, -300}, {0.004, -0.003, 0.2}};
  const auto machine = Machine();
  ASSERT_TRUE(machine);
  const std::vector<part_alignment::PartTarget> points = {{"far", {900, 700, 40}}};
  const auto correction = part_alignment::CorrectWorkOffset(part, points);
  const auto written = machine->WriteOffset(
      1, {correction.offset.origin_mm, correction.offset.rotation_z_rad * 180 / std::numbers::pi},
      {});
  ASSERT_TRUE(written) << written.error().message;
  Mdi("G21 G90 G54");
  const Vector3d miss_mm =
      Go(Block(points[0].ideal_mm)) - MachineFromPart(part, points[0].ideal_mm);
  EXPECT_GT(miss_mm.norm(), 1);
  EXPECT_LT((miss_mm - correction.remainder[0].error_mm).norm(), kMicron_mm);
}

TEST_F(LinuxCncRoundTrip, AToolsLengthIsAddedBehindTheRotation) {
  const auto machine = Machine();
  ASSERT_TRUE(machine);
  ASSERT_TRUE(machine->WriteOffset(1, {{10, 20, 30}, 90}, {}));
  Mdi("G21 G90 G54 G43.1 X1 Z5");
  const Vector3d at = Go("G0 X2 Y0 Z0");
  Mdi("G49");
  EXPECT_LT((at - Vector3d(11, 22, 35)).norm(), kMicron_mm) << at.transpose();
}

TEST_F(LinuxCncRoundTrip, InchesAreLeftOnAndReadRightly) {
  Mdi("G20");
  const auto machine = Machine();
  ASSERT_TRUE(machine);
  const auto written = machine->WriteOffset(4, {{25.4, -50.8, 0}, 1}, {});
  ASSERT_TRUE(written) << written.error().message;
  const auto offsets = machine->ReadOffsets(4, {});
  ASSERT_TRUE(offsets);
  EXPECT_FALSE(offsets->metric);
  EXPECT_NEAR(offsets->offset.origin_mm.x(), 25.4, 1e-6);
  Mdi("G21");
}

TEST_F(LinuxCncRoundTrip, MovesArriveStopAndAreRefusedBeyondItsLimits) {
  const auto machine = Machine();
  ASSERT_TRUE(machine);
  const auto moved = machine->MoveTo({120, -60, 15}, 20'000, {});
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_LT((Position() - Vector3d(120, -60, 15)).norm(), kMicron_mm);

  std::stop_source source;
  std::thread stopper([&source] {
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    source.request_stop();
  });
  const auto stopped = machine->MoveTo({2500, -60, 15}, 1200, source.get_token());
  stopper.join();
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::kInterrupted);
  EXPECT_THAT(stopped.error().message, HasSubstr("the machine stands at X"));
  const Vector3d at = Position();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(Position(), at);

  const auto beyond = machine->MoveTo({at.x(), at.y(), 3001}, 100'000, {});
  ASSERT_FALSE(beyond);
  EXPECT_THAT(beyond.error().message, HasSubstr("Z 3001 lies outside the travel"));
}

TEST_F(LinuxCncRoundTrip, ItsAxisCTurnsByHalfATurnAndBackAndNothingElseMoves) {
  const auto machine = Machine();
  ASSERT_TRUE(machine);
  ASSERT_TRUE(machine->MoveTo({30, -20, 5}, 20'000, {}));
  for (const double c_deg : {180.0, 0.0}) {
    const auto turned = machine->TurnTo(c_deg, 7200, {});
    ASSERT_TRUE(turned) << turned.error().message;
    const auto state = machine->State({});
    ASSERT_TRUE(state);
    EXPECT_NEAR(state->c_deg, c_deg, 1e-3);
    EXPECT_LT((state->position_mm - Vector3d(30, -20, 5)).norm(), kMicron_mm);
  }
  const auto travel = machine->Travel({});
  ASSERT_TRUE(travel) << travel.error().message;
  EXPECT_EQ(travel->low_mm, Vector3d::Constant(-3000));
}

TEST_F(LinuxCncRoundTrip, AnEmergencyStopInAMoveEndsItAndIsNamed) {
  const auto machine = Machine();
  ASSERT_TRUE(machine);
  std::thread presser([] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    auto shell = LinuxCncShell::Connect(Options().address, {});
    EXPECT_TRUE(shell && shell->Set("estop on", {}));
  });
  const auto moved = machine->MoveTo({2500, 0, 0}, 6000, {});
  presser.join();
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(moved.error().message, HasSubstr("emergency stop"));
  const Vector3d at = Position();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(Position(), at);
}

TEST_F(LinuxCncRoundTrip, RefusesWhileTheSpindleTurnsAndWhileG92IsActive) {
  Mdi("M3 S100");
  WaitFor([this] { return shell_->Get("spindle 0", {}) == "0 FORWARD"; });
  const auto turning = Machine()->MoveTo({0, 0, 0}, 6000, {});
  Mdi("M5");
  WaitFor([this] { return shell_->Get("spindle 0", {}) == "0 OFF"; });
  ASSERT_FALSE(turning);
  EXPECT_EQ(turning.error().kind, ErrorKind::kSafety);
  Mdi("G92 X5");
  const auto shifted = Machine()->WriteOffset(1, {{0, 0, 0}, 0}, {});
  Mdi("G92.1");
  ASSERT_FALSE(shifted);
  EXPECT_THAT(shifted.error().message, HasSubstr("G92"));
  EXPECT_TRUE(Machine()->WriteOffset(1, {{0, 0, 0}, 0}, {}));
}

}  // namespace
}  // namespace trammel
