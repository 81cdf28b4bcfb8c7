// The LinuxCNC that runs beside its screen, joined through its Python module, with a screen that
// takes over.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "base/random.h"
#include "linuxcnc_fixture.h"
#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/trammel_process.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using machine::LinuxCnc;
using machine::LinuxCncOptions;
using nlohmann::json;
using test::kMicron_mm;
using ::testing::HasSubstr;

// The ports on which somebody in this network listens.
std::set<std::string> ListeningPorts() {
  constexpr const char* kListen = "0A";
  std::set<std::string> ports;
  for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream file(table);
    std::string line;
    while (std::getline(file, line)) {
      std::istringstream words(line);
      std::string number;
      std::string local;
      std::string remote;
      std::string state;
      words >> number >> local >> remote >> state;
      if (state == kListen) ports.insert(local);
    }
  }
  return ports;
}

class LinuxCncSessionTest : public test::LinuxCncFixture {};

TEST_F(LinuxCncSessionTest, MovesWithoutAPortAndGivesTheModeBack) {
  const std::set<std::string> before = ListeningPorts();
  {
    const auto machine = Joined();
    Must(machine->MoveTo({12.5, -40, 7}, 6000, {}));
    EXPECT_EQ(ListeningPorts(), before);
    EXPECT_LT((At(Screen("look")) - Vector3d(12.5, -40, 7)).norm(), kMicron_mm);
  }
  constexpr int kManual = 1;
  EXPECT_EQ(Screen("look")["mode"], kManual);
}

TEST_F(LinuxCncSessionTest, NothingMovesAfterTheScreenTookOver) {
  static std::uint64_t seed = 11;  // others when repeated
  Random random(seed++);
  for (int i = 0; i < 12; ++i) {
    const auto machine = Joined();
    linuxcnc_->AskScreen(fmt::format("take {}", 1.2 * random.Uniform()));
    const auto start = Must(machine->State({}));
    const double away_mm = start.position_mm.x() > 0 ? -400 : 400;
    const auto moved = machine->MoveTo({away_mm, 0, 0}, 6000, {});
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().kind, ErrorKind::kSafety) << moved.error().message;
    EXPECT_THAT(moved.error().message, HasSubstr("somebody took LinuxCNC over"));
    EXPECT_THAT(machine->MoveTo({0, 0, 0}, 6000, {}), FailsWith("somebody took LinuxCNC over"));
    EXPECT_FALSE(machine->WriteOffset(1, {}, {}));
    const json seen = StatedMachine();
    EXPECT_EQ(seen["went_mm"], 0) << i;
    EXPECT_EQ(seen["manual"], true) << i;
  }
}

// Esc leaves the mode as it is; so does a block that is typed between two of ours.
TEST_F(LinuxCncSessionTest, ACommandFromTheScreenWhileTheMachineStandsEndsItToo) {
  for (const char* command : {"abort", "mdi G0 X1"}) {
    const auto machine = Joined();
    ASSERT_TRUE(machine->MoveTo({20, 0, 0}, 6000, {})) << command;
    const json before = Screen(command);
    const auto moved = machine->MoveTo({40, 0, 0}, 6000, {});
    ASSERT_FALSE(moved) << command;
    EXPECT_EQ(moved.error().kind, ErrorKind::kSafety) << moved.error().message;
    EXPECT_THAT(moved.error().message, HasSubstr("somebody took LinuxCNC over"));
    EXPECT_EQ(Screen("look")["at"], before["at"]) << command;
  }
}

TEST_F(LinuxCncSessionTest, AnOverrideFromTheScreenIsNoTakeOver) {
  const auto machine = Joined();
  ASSERT_TRUE(machine->MoveTo({20, 0, 0}, 6000, {}));
  Screen("feed 0.5");
  const auto moved = machine->MoveTo({60, 0, 0}, 6000, {});
  Screen("feed 1");
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_LT((At(Screen("look")) - Vector3d(60, 0, 0)).norm(), kMicron_mm);
}

TEST_F(LinuxCncSessionTest, ASecondOneIsRefused) {
  const auto first = Joined();
  const auto second = Joined();
  ASSERT_TRUE(first && second);
  ASSERT_TRUE(first->MoveTo({5, 0, 0}, 6000, {}));
  EXPECT_THAT(second->MoveTo({50, 0, 0}, 6000, {}),
              FailsWith(ErrorKind::kSafety, "another trammel"));
}

TEST_F(LinuxCncSessionTest, TheModalCodesComeBack) {
  Screen("mdi G20 G91 G95 F0.25");
  {
    const auto machine = Joined();
    Must(machine->MoveTo({-30, 0, 0}, 6000, {}));
    ASSERT_TRUE(machine->WriteOffset(2, {{1, 2, 3}, 0}, {}));
  }
  const json after = Screen("look");
  Screen("mdi G21 G90 G94");
  for (const int code : {200, 910, 950}) EXPECT_THAT(after["codes"], testing::Contains(code));
  EXPECT_NEAR(after["feed"], 0.25, 1e-6);
}

TEST_F(LinuxCncSessionTest, AKilledMeasurementLeavesTheMachineStandingInManual) {
  ASSERT_THAT(test::RunTrammel("sim spindle --out shop --seed 11", folder_.path()), Ends(0));
  // Slow: the first of its moves takes minutes.
  test::TrammelProcess measuring(
      {"align", "measure", "shop/views.json", "--source", "shop", "--machine", "session",
       "--joints", "4", "--c-axis", "--safe-z", "1500", "--feed", "600"},
      folder_.path());
  const Vector3d start = At(Screen("look"));
  Vector3d at = start;
  for (int i = 0; i < 2000 && (at - start).norm() < 1; ++i) at = At(Screen("look"));
  ASSERT_GE((at - start).norm(), 1);
  measuring.Send(SIGKILL);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const json seen = Screen("look");
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_EQ(Screen("look")["at"], seen["at"]);
  constexpr int kManual = 1;
  EXPECT_EQ(seen["mode"], kManual);
}

TEST_F(LinuxCncSessionTest, DoesNotJoinWhatIsInAutoAndSaysWhereNoneRuns) {
  Screen("run");
  const auto refused = Joined()->MoveTo({0, 0, 0}, 6000, {});
  Screen("manual");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kSafety) << refused.error().message;
  LinuxCncOptions options = Options();
  options.session.helper = {"/nowhere/python3"};
  EXPECT_THAT(LinuxCnc::Connect(options, {}), FailsWith("/nowhere/python3 cannot be started"));
}

TEST_F(LinuxCncSessionTest, InitReadsHowTheMachineIsBuiltAndLeavesItAlone) {
  const json before = Screen("look");
  ASSERT_THAT(test::RunTrammel("sim spindle --out shop --seed 11 --no-pictures", folder_.path()),
              Ends(0));
  const json stated = json::parse(test::ReadWhole(folder_.path() / "shop/observations.json"));
  test::WriteWhole(folder_.path() / "camera.json",
                   json{{"format", 1}, {"camera", stated["camera"]}}.dump());
  test::WriteWhole(folder_.path() / "targets.json",
                   json{{"format", 1}, {"targets", stated["targets"]}}.dump());
  const std::string init =
      "align init job --machine session --camera camera.json --targets targets.json --source shop "
      "--rough 1400,1000,250 --obstacle none ";
  const auto begun = test::RunTrammel(init, folder_.path());
  ASSERT_THAT(begun,
              Notes("axes XYZC, unit 1 mm, X -3000 … 3000, Y -3000 … 3000, Z -3000 … 3000 mm"));
  EXPECT_THAT(begun.standard_output,
              HasSubstr("--machine session --joints 4 --c-axis --safe-z 3000 --travel "
                        "-3000,-3000,-3000,3000,3000,3000"));
  const json after = Screen("look");
  EXPECT_EQ(after["at"], before["at"]);
  EXPECT_EQ(after["mode"], before["mode"]);
  std::filesystem::remove_all(folder_.path() / "job");
  const auto beyond =
      test::RunTrammel(init + "--travel -3000,-3000,-3000,3000,3000,3001", folder_.path());
  EXPECT_EQ(beyond.exit_code, 4) << beyond.output;
  EXPECT_THAT(beyond.standard_error, HasSubstr("beyond LinuxCNC's limits"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "job/views.json"));
}

TEST_F(LinuxCncSessionTest, MeasuresAndCorrectsBesideTheScreen) {
  ASSERT_THAT(test::RunTrammel("sim spindle --out shop --seed 11", folder_.path()), Ends(0));
  const auto views = json::parse(test::ReadWhole(folder_.path() / "shop/views.json"))["views"];
  double safe_z_mm = -1e9;
  for (const auto& view : views) {
    safe_z_mm = std::max(safe_z_mm, double(view["spindle_mm"][2]) + 50);
  }
  const auto measured = Must(test::RunTrammel(
      fmt::format("align measure shop/views.json --source shop --machine session --joints 4 "
                  "--c-axis --safe-z {} --feed 60000",
                  safe_z_mm),
      folder_.path()));
  test::WriteWhole(folder_.path() / "result.json", measured.standard_output);
  ASSERT_THAT(test::RunTrammel("align correct result.json --write session --joints 4 --c-axis",
                               folder_.path()),
              Ends(0));
  const auto result = json::parse(measured.standard_output);
  const json seen = Screen("look");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(seen["g5x"][axis], result["part_mm"][axis], kMicron_mm);
  }
}

}  // namespace
}  // namespace trammel
