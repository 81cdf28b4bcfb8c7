// Path from a printed board under a virtual mill to a camera file, by one command of a user.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "machine/linuxcnc/linuxcnc.h"
#include "part_alignment/files/camera_file.h"
#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/trammel_process.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class BoardMachine : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_THAT(
        test::RunTrammel("align targets --count 40 --radius 3 --out sheet.pdf --layout sheet.json",
                         folder_.path()),
        Ends(0));
  }
  // The mill with its camera, small pictures and quick axes.
  void Start(const std::string& more = "") {
    mill_.emplace(
        "sim mill --sheet sheet.json --seed 1001 --frame 972x729 --hurry 20 --truth "
        "truth.json " +
            more,
        folder_.path());
    machine_ = mill_->WaitForLine("machine ");
    camera_ = mill_->WaitForLine("camera ");
    ASSERT_FALSE(camera_.empty()) << mill_->StandardErrorSoFar();
  }
  [[nodiscard]] std::string Arguments(const std::string& more) const {
    return fmt::format(
        "align board run --machine '{}' --source {} --sheet sheet.json --settle 0.1 --feed 100000 "
        "--turn-speed 30000 --yes move {}",
        machine_, camera_, more);
  }
  [[nodiscard]] test::CommandResult Board(const std::string& more) const {
    return test::RunTrammel(Arguments(more), folder_.path());
  }
  [[nodiscard]] json ReadJson(const std::string& name) const {
    return json::parse(test::ReadWhole(folder_.path() / name));
  }
  // Returns the notes of an operator who touched four marks with a tool.
  [[nodiscard]] std::string Touches() const {
    const json truth = ReadJson("truth.json");
    std::string options;
    for (const json& touch : truth["touches"]) {
      const json& at = touch["spindle_mm"];
      options += fmt::format(" --touch {},{},{},{},{}", int(touch["mark"]), double(at[0]),
                             double(at[1]), double(at[2]), double(truth["tool_length_mm"]));
    }
    return options;
  }
  // Returns the machine's position, read twice.
  [[nodiscard]] Eigen::Vector3d Stands() const {
    machine::LinuxCncOptions options;
    std::istringstream words(machine_.substr(machine_.find(':') + 1));
    for (std::string word; words >> word;) options.session.helper.push_back(word);
    auto linuxcnc = machine::LinuxCnc::Connect(options, {});
    if (!linuxcnc) return Eigen::Vector3d::Constant(NAN);
    const auto first = (*linuxcnc)->State({});
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const auto second = (*linuxcnc)->State({});
    if (!first || !second || first->position_mm != second->position_mm) {
      return Eigen::Vector3d::Constant(NAN);
    }
    return second->position_mm;
  }

  static inline const Eigen::Vector3d kStart_mm{600, 400, 520};
  test::TemporaryFolder folder_;
  std::optional<test::TrammelProcess> mill_;
  std::string machine_;
  std::string camera_;
};

constexpr const char* kByC = "--c-axis --joints 4 --half-turn --pictures 20";
constexpr const char* kLocked = "--spindle-locked --pictures 16";
constexpr const char* kPlaced = " --place -2,0,-320 --place-sigma 1,1,0.5";

TEST_F(BoardMachine, WithoutACameraFileTheMachineCalibratesItsCamera) {
  Start();
  const double pitch_mm = ReadJson("truth.json")["camera"]["pixel_pitch_mm"];
  ASSERT_THAT(Board(kByC + Touches() + fmt::format(" --pixel-pitch-mm {}", pitch_mm)), Ends(0));
  const auto found = Must(files::ReadCameraFile(folder_.path() / "run/camera.json"));
  test::WriteWhole(folder_.path() / "true.json",
                   json{{"format", 1}, {"camera", ReadJson("truth.json")["camera"]}}.dump());
  const auto truth = Must(files::ReadCameraFile(folder_.path() / "true.json"));
  part_alignment::CameraVector error =
      part_alignment::ParametersOf(found.camera) - part_alignment::ParametersOf(truth.camera);
  for (int i = 10; i < part_alignment::kCameraParameters; ++i) {
    error[i] = std::remainder(error[i], 2 * std::numbers::pi);
  }
  const double nees = geometry::SquaredMahalanobisDistance(*found.calibration->covariance, error);
  EXPECT_LT(nees, ChiSquareQuantile(0.999, part_alignment::kCameraParameters));
  EXPECT_LT(std::abs(error[0]) / found.camera.pixel_pitch_mm, 0.5);  // px of 1055
  EXPECT_LT(error.segment<3>(7).norm(), 0.05);                       // mm
  EXPECT_EQ(Stands(), kStart_mm);
  // The folder is what is taken by hand, too.
  const auto again = Must(
      test::RunTrammel("align calibrate --board run/board.json --observations run/seen.json --json",
                       folder_.path()));
  EXPECT_EQ(json::parse(again.standard_output)["parameters"]["focal_length_mm"]["value"],
            found.camera.focal_length_mm);
  EXPECT_THAT(test::RunTrammel("align calibrate --board run/board.json --json", folder_.path()),
              Ends(0));
  // It is what the next commands take.
  EXPECT_THAT(test::RunTrammel("align camera run/camera.json --model "
                               "brown_ideal_to_distorted --most-error-px 1",
                               folder_.path()),
              Ends(0));
}

void Replace(const std::string& what, const std::string& by, std::string& text) {
  const std::size_t at = text.find(what);
  if (at != std::string::npos) text.replace(at, what.size(), by);
}

// Runs the commands as in the manual, but for free ports, smaller and fewer pictures, and quick
// axes.
TEST_F(BoardMachine, TheManualsCommandsRunInTheirOrder) {
  std::istringstream lines(
      test::ReadWhole(fs::path(TRAMMEL_SOURCE) / "docs/howto/spindle-camera.md"));
  constexpr std::string_view kPrompt = "    trammel ";
  constexpr std::string_view kSimPrompt = "    trammel-sim ";
  int count = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kSimPrompt)) line.replace(0, kSimPrompt.size(), "    trammel sim ");
    if (!line.starts_with(kPrompt)) continue;
    std::string command = line.substr(kPrompt.size());
    ++count;
    if (command.starts_with("sim mill ")) {
      Replace("--port 5107 --camera-port 5108", "--frame 972x729 --hurry 20", command);
      mill_.emplace(command, folder_.path());
      machine_ = mill_->WaitForLine("machine ");
      camera_ = mill_->WaitForLine("camera ");
      continue;
    }
    if (command.starts_with("align targets ")) command += " --force";  // replaces SetUp's
    if (command.starts_with("align board ")) {
      Replace("session:trammel-sim mill --join 5107", machine_, command);
      Replace("http://127.0.0.1:5108/stream", camera_, command);
      command += " --pictures 16 --settle 0.1 --feed 100000 --turn-speed 30000 --yes move";
    }
    EXPECT_THAT(test::RunTrammel(command, folder_.path()), Ends(0)) << command;
  }
  EXPECT_EQ(count, 4) << "the page has lost its commands";
  EXPECT_TRUE(files::ReadCameraFile(folder_.path() / "camera.json"));
}

TEST_F(BoardMachine, WithoutTouchesItKeepsThePicturesAndSaysWhatIsMissing) {
  Start();
  EXPECT_THAT(Board(kLocked),
              Fails(2, "without --touch", "without --half-turn",
                    "next      mend board.json, then: trammel align calibrate --board "));
  EXPECT_FALSE(fs::exists(folder_.path() / "run/camera.json"));
  json board = ReadJson("run/board.json");
  board["place"] = {{"at_mm", {-2, 0, -320}}, {"sigma_mm", {1, 1, 0.5}}};
  test::WriteWhole(folder_.path() / "run/board.json", board.dump());
  EXPECT_THAT(
      test::RunTrammel(
          "align calibrate --board run/board.json --observations run/seen.json --out camera.json",
          folder_.path()),
      Ends(0));
}

TEST_F(BoardMachine, CtrlCInTheMiddleLeavesTheMachineStandingAndThePicturesKept) {
  Start();
  test::TrammelProcess run(Arguments(std::string(kLocked) + kPlaced), folder_.path());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!fs::exists(folder_.path() / "run/view-08.jpg") &&
         std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  run.Send(SIGINT);
  EXPECT_EQ(run.Wait().exit_code, 130) << run.StandardErrorSoFar();
  EXPECT_THAT(run.StandardErrorSoFar(), HasSubstr("are kept in"));
  EXPECT_TRUE(Stands().allFinite());
  EXPECT_GE(ReadJson("run/board.json")["views"].size(), 7U);
  EXPECT_GE(ReadJson("run/seen.json")["pictures"].size(), 7U);
  EXPECT_FALSE(fs::exists(folder_.path() / "run/camera.json"));
}

TEST_F(BoardMachine, NothingMovesOnAMachineThatIsNotReady) {
  for (const auto& [fault, words] :
       {std::pair{"not-homed", "are homed"}, std::pair{"spindle-turns", "the spindle turns"}}) {
    fs::remove(folder_.path() / "truth.json");
    Start(fmt::format("--fault {}=1", fault));
    EXPECT_THAT(Board(std::string(kLocked) + kPlaced), Fails(4, words));
    EXPECT_EQ(Stands(), kStart_mm) << fault;
    EXPECT_FALSE(fs::exists(folder_.path() / "run")) << "a refusal leaves nothing behind";
  }
}

TEST_F(BoardMachine, NothingMovesWithoutAYesALimitOrAHeldSpindle) {
  Start();
  std::string unasked = Arguments(std::string(kLocked) + kPlaced);
  unasked.erase(unasked.find("--yes move"), 10);
  EXPECT_THAT(test::RunTrammel(unasked, folder_.path()), Fails(1, "say --yes move"));
  const auto held = Board("--pictures 16");
  EXPECT_EQ(held.exit_code, 4) << held.output;
  EXPECT_THAT(held.standard_error, HasSubstr("nothing says that the spindle is held"));
  EXPECT_THAT(Board("--spindle-locked --half-turn"), Fails(1, "run it in a terminal"));
  EXPECT_THAT(Board(std::string(kLocked) + " --safe-z 500"), Fails(4, "above the safe height"));
  const auto mark = Board(std::string(kLocked) + " --touch 41,1,2,3,120");
  EXPECT_EQ(mark.exit_code, 1) << mark.output;
  EXPECT_THAT(mark.standard_error, HasSubstr("has no mark 41"));
  EXPECT_EQ(Stands(), kStart_mm);
}

TEST_F(BoardMachine, AnEmergencyStopEndsItAndIsNamed) {
  Start("--fault estop-at-move=40");
  EXPECT_THAT(Board(std::string(kLocked) + kPlaced), Fails(4, "emergency stop", "are kept in"));
  EXPECT_TRUE(Stands().allFinite());
}

TEST_F(BoardMachine, ALinkThatDiesEndsItAndKeepsThePictures) {
  Start("--fault silent-at-move=40");
  EXPECT_THAT(Board(std::string(kLocked) + kPlaced),
              Fails(3, "it ends by itself with the piece that was sent", "are kept in",
                    Not(HasSubstr("back where it stood"))));
  EXPECT_GE(ReadJson("run/board.json")["views"].size(), 5U);
}

TEST_F(BoardMachine, AMoveThatTheControllerRefusesEndsIt) {
  Start("--fault refused-at-move=40");
  EXPECT_THAT(Board(std::string(kLocked) + kPlaced),
              Fails(3, "LinuxCNC refuses it", "the machine stands at"));
  EXPECT_TRUE(Stands().allFinite());
}

}  // namespace
}  // namespace trammel
