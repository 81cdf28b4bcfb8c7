// trammel align measure on pictures of the virtual spindle, with a scripted
// LinuxCNC.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <tuple>

#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/scripted_linuxcnc.h"
#include "support/trammel_process.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::CommandResult;
using test::ReadWhole;
using test::ScriptedLinuxCnc;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

class AlignMeasure : public testing::Test {
 protected:
  // One part, photographed once for all tests.
  static void SetUpTestSuite() {
    shop_ = new test::TemporaryFolder;
    ASSERT_THAT(test::RunTrammel("sim spindle --out shop --seed 11", shop_->path()), Ends(0));
    fs::create_directory(shop_->path() / "pictures");
    for (const fs::directory_entry& entry : fs::directory_iterator(shop_->path() / "shop")) {
      if (entry.path().extension() == ".png") {
        fs::copy(entry.path(), shop_->path() / "pictures" / entry.path().filename());
      }
    }
  }
  static void TearDownTestSuite() {
    delete shop_;
    shop_ = nullptr;
  }
  static fs::path At(const std::string& name) { return shop_->path() / name; }
  static json Truth() { return json::parse(ReadWhole(At("shop/truth.json"))); }
  static json Plan() { return json::parse(ReadWhole(At("shop/views.json"))); }
  // The highest place of a view, from which the plan's own descents are short.
  static double SafeZ() {
    double highest_mm = -1e9;
    const json plan = Plan();
    for (const json& view : plan["views"]) {
      highest_mm = std::max(highest_mm, double(view["spindle_mm"][2]));
    }
    return highest_mm + 50;
  }
  [[nodiscard]] std::string Arguments(const std::string& more) const {
    return fmt::format("align measure {} --source {} {}", At("shop/views.json").string(),
                       At("pictures").string(), more);
  }
  [[nodiscard]] CommandResult Measure(const std::string& more = "") const {
    return test::RunTrammel(Arguments(more), folder_.path());
  }
  [[nodiscard]] std::string Machine(const ScriptedLinuxCnc& server) const {
    return fmt::format(
        "--machine session:{} --spindle-locked --safe-z {} "
        "--feed 100000 --settle 0",
        server.helper(), SafeZ());
  }
  // Everything else as in the plan.
  [[nodiscard]] CommandResult MeasureBy(const json& plan, const fs::path& pictures,
                                        const std::string& more = "") const {
    test::WriteWhole(folder_.path() / "plan.json", plan.dump());
    return test::RunTrammel(
        fmt::format("align measure plan.json --source {} {}", pictures.string(), more),
        folder_.path());
  }
  // The first views of the plan only, with their pictures in a folder "some".
  [[nodiscard]] json FirstViews(std::size_t count) const {
    json plan = Plan();
    const json views = plan["views"];
    plan["views"] = json::array();
    fs::remove_all(Some());
    fs::create_directory(Some());
    for (std::size_t i = 0; i < count; ++i) {
      plan["views"].push_back(views[i]);
      const std::string name = fmt::format("view-{:02}.png", i + 1);
      fs::copy(At("pictures") / name, Some() / name);
    }
    return plan;
  }
  [[nodiscard]] fs::path Some() const { return folder_.path() / "some"; }
  // The same part photographed with other options; the pictures of a folder of its own.
  [[nodiscard]] fs::path Photographed(const std::string& options) const {
    EXPECT_THAT(test::RunTrammel("sim spindle --out other --seed 11 " + options, folder_.path()),
                Ends(0));
    return folder_.path() / "other";
  }
  [[nodiscard]] fs::path PrintError() const {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_.path())) {
      if (entry.path().filename().string().starts_with("part_alignment-")) return entry.path();
    }
    return {};
  }

  static inline test::TemporaryFolder* shop_ = nullptr;
  test::TemporaryFolder folder_;
};

TEST_F(AlignMeasure, FindsThePartInPicturesAndLeavesADatedReport) {
  const auto measured = Must(Measure());
  const json result = json::parse(measured.standard_output);
  const json truth = Truth();
  for (std::size_t i = 0; i < 3; ++i) {
    // The clamping is 5 um beside the axis, which no residual shows.
    EXPECT_NEAR(result["part_mm"][i], double(truth["part_mm"][i]), 0.02) << i;
    EXPECT_NEAR(result["part_angles_rad"][i], double(truth["part_angles_rad"][i]), 2e-5) << i;
  }
  const fs::path report = PrintError();
  ASSERT_FALSE(report.empty());
  const json kept_result = json::parse(ReadWhole(report / "result.json"));
  EXPECT_EQ(kept_result["instrument"], "part_alignment");
  EXPECT_EQ(kept_result["details"], result);
  for (const char* name :
       {"report.txt", "report.html", "view-01_residuals.png", "view-08_residuals.png"}) {
    EXPECT_TRUE(fs::exists(report / name)) << name;
  }
  EXPECT_EQ(ReadWhole(report / "view-01.png"), ReadWhole(At("pictures/view-01.png")));
  EXPECT_FALSE(fs::exists(report / "stopped.txt"));
  // The stored observations suffice for solve, and its report is the same.
  const std::string kept = (report / "observations.json").string();
  const CommandResult again = test::RunTrammel("align solve --report r " + kept, folder_.path());
  EXPECT_EQ(json::parse(again.standard_output)["part_mm"], result["part_mm"]);
  EXPECT_EQ(ReadWhole(folder_.path() / "r" / "view-04_residuals.png"),
            ReadWhole(report / "view-04_residuals.png"));
}

TEST_F(AlignMeasure, DrivesUpAcrossAndDownThroughEveryView) {
  ScriptedLinuxCnc server;
  server.SetHurry(20);
  const auto measured = Must(Measure(Machine(server)));
  const json plan = Plan();
  const std::vector<std::string> requests = server.requests();
  for (const json& view : plan["views"]) {
    const std::string place =
        fmt::format("X{:.6f} Y{:.6f} Z{:.6f}", double(view["spindle_mm"][0]),
                    double(view["spindle_mm"][1]), double(view["spindle_mm"][2]));
    EXPECT_THAT(requests, testing::Contains(HasSubstr(place)));
  }
  EXPECT_THAT(requests, Each(AllOf(Not(HasSubstr("M3")), Not(HasSubstr("M4")))));
  EXPECT_FALSE(server.moving());
  EXPECT_NEAR(server.position()[2], SafeZ(), 1e-3);  // up again at the end
  EXPECT_THAT(measured.standard_error, HasSubstr("no --obstacle was given"));
}

TEST_F(AlignMeasure, RefusesObstaclesAndTheEndOfTravelBeforeAnythingMoves) {
  ScriptedLinuxCnc server;
  EXPECT_THAT(Measure(Machine(server) + " --obstacle -5000,-5000,-5000,5000,5000,5000"),
              Fails(4, "obstacle 1"));
  const CommandResult outside = Measure(Machine(server) + " --travel 0,0,0,1,1,1");
  EXPECT_EQ(outside.exit_code, 4) << outside.output;
  EXPECT_THAT(outside.standard_error, HasSubstr("outside the travel"));
  const CommandResult nowhere = Measure(Machine(server) + " --out nowhere");
  EXPECT_EQ(nowhere.exit_code, 1) << nowhere.output;
  EXPECT_THAT(nowhere.standard_error, HasSubstr("nowhere is no folder"));
  for (const char* number :
       {"--settle", "--extra-sigma-px", "--disc-radius", "--feed", "--camera-radius", "--safe-z"}) {
    EXPECT_THAT(Measure(fmt::format("{} nan", number)), Fails(1, number, "nan is no number"))
        << number;
  }
  EXPECT_EQ(Measure(Machine(server) + " --normal 0,0,0").exit_code, 1);
  EXPECT_EQ(Measure(Machine(server) + " --normal nan,0,1").exit_code, 1);
  EXPECT_THAT(server.requests(), Each(Not(HasSubstr("G53"))));
  EXPECT_EQ(Measure(Machine(server) + " --obstacle 1,2,3").exit_code, 1);
  EXPECT_TRUE(PrintError().empty());
}

TEST_F(AlignMeasure, RefusesASpindleThatTurnsIsNotHeldOrNotOriented) {
  const std::string held = "--spindle-locked";
  for (const auto& [name, value, holds, words] :
       {std::tuple{"spindle_stopped", json(false), held, "the spindle turns"},
        std::tuple{"c", json(37), std::string("--c-axis --joints 4"), "axis C stands at 37.0"},
        std::tuple{"c", json(0), std::string(), "nothing says that the spindle is held"},
        std::tuple{"estop", json(true), held, "emergency stop"},
        std::tuple{"homed", json({1, 0, 1, 0}), held, "homed"}}) {
    ScriptedLinuxCnc server;
    server.Answer(name, value);
    std::string machine = Machine(server);
    machine.replace(machine.find(held), held.size(), holds);
    EXPECT_THAT(Measure(machine), Fails(4, words));
    EXPECT_THAT(server.requests(), Each(Not(HasSubstr("G53"))));
  }
}

TEST_F(AlignMeasure, CtrlCLeavesNoMotionRunningAndWhatWasTaken) {
  ScriptedLinuxCnc server;
  server.SetHurry(20);
  test::TrammelProcess measuring(Arguments(Machine(server)), folder_.path());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  const auto kept = [this] { return fs::exists(PrintError() / "observations.json"); };
  while (!kept() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_TRUE(kept());
  server.SetHurry(0.2);  // speeds up the moves from now on
  while (!server.moving() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  measuring.Send(SIGINT);
  EXPECT_EQ(measuring.Wait(30).exit_code, 130) << measuring.StandardErrorSoFar();
  EXPECT_FALSE(server.moving());
  EXPECT_THAT(measuring.StandardErrorSoFar(), Containing("the machine stands at", "are kept in"));
  const json seen = json::parse(ReadWhole(PrintError() / "observations.json"));
  ASSERT_GE(seen["views"].size(), 1U);
  EXPECT_GE(seen["views"][0]["observations"].size(), 1U);
  EXPECT_TRUE(fs::exists(PrintError() / std::string(seen["views"][0]["picture"])));
  EXPECT_TRUE(fs::exists(PrintError() / "stopped.txt"));
}

TEST_F(AlignMeasure, ALineThatBreaksDuringAMoveEndsTheMotionAndKeepsWhatWasTaken) {
  enum class Step { kWait, kMoves, kDropped };
  std::atomic step = Step::kWait;  // the server's thread writes it
  ScriptedLinuxCnc server([&](const std::string& request) {
    if (step == Step::kWait && request.find("G53 G1") != std::string::npos &&
        fs::exists(PrintError() / "view-02.png")) {
      step = Step::kMoves;
    } else if (step == Step::kMoves) {
      step = Step::kDropped;
      return ScriptedLinuxCnc::Fault::kDrop;
    }
    return ScriptedLinuxCnc::Fault::kNone;
  });
  server.SetHurry(5);
  const CommandResult measured = Measure(Machine(server));
  EXPECT_EQ(measured.exit_code, 3) << measured.output;
  EXPECT_EQ(step.load(), Step::kDropped);
  EXPECT_THAT(measured.standard_error,
              Containing("it has ended", "the machine stands at", "taken (2)"));
  EXPECT_THAT(server.requests(), testing::Contains(HasSubstr("orphaned")));  // by another helper
  EXPECT_FALSE(server.moving());
  EXPECT_EQ(json::parse(ReadWhole(PrintError() / "observations.json"))["views"].size(), 2U);
}

TEST_F(AlignMeasure, ARefusedMoveEndsTheMotionAndKeepsWhatWasTaken) {
  ScriptedLinuxCnc server([this](const std::string& request) {
    const bool refuse =
        request.find("G53 G1") != std::string::npos && fs::exists(PrintError() / "view-02.png");
    return refuse ? ScriptedLinuxCnc::Fault::kRefuse : ScriptedLinuxCnc::Fault::kNone;
  });
  server.SetHurry(20);
  EXPECT_THAT(Measure(Machine(server)),
              Fails(3, "refused by the script", "the machine stands at", "taken (2)"));
  EXPECT_FALSE(server.moving());
  EXPECT_EQ(json::parse(ReadWhole(PrintError() / "observations.json"))["views"].size(), 2U);
}

TEST_F(AlignMeasure, PicturesThatDoNotFitThePlanAreNamed) {
  json plan = Plan();
  EXPECT_THAT(MeasureBy(plan, At("pictures"), "--bits 12"), Fails(2, "no picture shows a target"));
  const CommandResult nobody = MeasureBy(plan, "nowhere");
  EXPECT_THAT(nobody.exit_code, testing::AnyOf(1, 2));
  plan["views"].push_back(plan["views"][0]);
  EXPECT_THAT(MeasureBy(plan, At("pictures")), Fails(2, "view 9: there is no further picture"));
  plan = FirstViews(1);
  EXPECT_THAT(MeasureBy(plan, At("pictures")).standard_error, HasSubstr("more pictures than"));
  plan["camera"]["image_px"] = {640, 480};
  EXPECT_THAT(MeasureBy(plan, At("pictures")), Fails(2, "the picture has 2592 x 1944 px"));
}

TEST_F(AlignMeasure, IdsThatNoCodeHasAreNamedBeforeAnythingMoves) {
  json plan = Plan();
  plan["targets"][2]["id"] = 46;
  EXPECT_THAT(MeasureBy(plan, At("pictures")),
              Fails(1, "target 46 of the plan is none of the 14-bit book"));
  EXPECT_TRUE(PrintError().empty());
  // Another code than the part has: its target is not found, and what is there is named.
  plan = FirstViews(6);
  plan["targets"][2]["id"] = 44;
  const std::string text = MeasureBy(plan, Some()).standard_error;
  EXPECT_THAT(text, Containing("is none of the part's and was left out",
                               "no target of the part was found"));
}

TEST_F(AlignMeasure, BlurredPicturesAreAnErrorAndAreKept) {
  EXPECT_THAT(MeasureBy(Plan(), Photographed("--set blur-px=12")),
              Fails(2, "look at focus", "taken (8)"));
  EXPECT_TRUE(fs::exists(PrintError() / "view-08.png"));
}

}  // namespace
}  // namespace trammel
