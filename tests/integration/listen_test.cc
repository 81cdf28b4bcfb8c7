// The dialogs of trammel serve over real sockets: what the printer's own screen asks for, hears and
// gets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>

#include "fault_scenario.h"
#include "machine_shop.h"

namespace trammel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kClosed = "that dialog is closed, and nothing was started";

ShopOptions WithMacros() {
  ShopOptions options;
  auto& macros = options.klipper.macros;
  macros["_TRAMMEL_KEEP_ALIVE"].lines = {"LIGHTS_ON"};  // anything: that it was called counts
  macros["_TRAMMEL_RELEASE"].lines = {"LASER_OFF"};
  return options;
}

class Listen : public testing::Test {
 protected:
  void Start(ShopOptions options) {
    shop_ = std::make_unique<MachineShop>(std::move(options));
    shop_->Script(kWorkedWith);
    before_ = shop_->Look();
    process_ = shop_->Serve();
  }

  // Asks, and waits until the printer's console holds the answer.
  void Ask(const std::string& macro, const std::string& answer) {
    int before = 0;
    shop_->With([&](sim::VirtualKlipper& klipper) { before = TimesRead(klipper, answer); });
    shop_->Script(macro);
    WaitUntilAnswered(answer, before);
  }

  // Asks for a calibration and presses the dialog's button.
  void Calibrate(const std::string& answer, const std::string& parameters = "") {
    int before = 0;
    shop_->With([&](sim::VirtualKlipper& klipper) { before = TimesRead(klipper, answer); });
    Ask("TRAMMEL_PA" + parameters, "TRAMMEL_ASK BUTTONS=start");
    shop_->Confirm();
    WaitUntilAnswered(answer, before);
  }

  void WaitUntilAnswered(const std::string& answer, int more_often_than = 0) {
    shop_->WaitUntil(
        [&](sim::VirtualKlipper& klipper) { return TimesRead(klipper, answer) > more_often_than; },
        "the printer was told: " + answer, *process_);
  }

  // True if the running calibration ends with an answer; an overloaded computer may capture too few
  // frames for one, and the user presses the button again.
  bool HasAnswer() {
    const auto times = [this](const std::string& text) {
      int found = 0;
      shop_->With([&](sim::VirtualKlipper& klipper) { found = TimesRead(klipper, text); });
      return found;
    };
    const int answers = times(kAnswer);
    const int refusals = times(kNoAnswer);
    shop_->WaitUntil(
        [&](sim::VirtualKlipper& klipper) {
          return TimesRead(klipper, kAnswer) > answers || TimesRead(klipper, kNoAnswer) > refusals;
        },
        "the printer was told the answer", *process_);
    return times(kAnswer) > answers;
  }

  static constexpr const char* kAnswer = "TRAMMEL_APPLY sets it";
  static constexpr const char* kNoAnswer = "TRAMMEL_ASK BUTTONS=close";

  std::unique_ptr<MachineShop> shop_;
  PrinterLook before_;
  std::unique_ptr<TrammelProcess> process_;
};

TEST_F(Listen, CalibratesWhenAskedAndAppliesOnlyWhenTold) {
  Start(WithMacros());
  Ask("TRAMMEL_APPLY", "nothing to apply");
  // A click on any macro begins nothing, and neither does the button of a dialog that is closed.
  Ask("_TRAMMEL_START", kClosed);
  Ask("_TRAMMEL_START TOKEN=20260102T030405Z-1", kClosed);
  Ask("TRAMMEL_PA FILAMENT=\"PLA+ 50%\"", "TRAMMEL_ASK BUTTONS=start TOKEN=");
  EXPECT_EQ(shop_->Look().bed_target_c, before_.bed_target_c);
  const std::string filament = " FILAMENT=\"PLA+ 50%\"";
  Calibrate("_TRAMMEL_KEEP_ALIVE", filament);
  WaitUntilAnswered("heating");
  shop_->Confirm();  // a second press
  WaitUntilAnswered("already at work");
  Ask("TRAMMEL_APPLY", "still calibrating");
  WaitUntilAnswered("M117 scanning line 1");
  int asked = 1;
  constexpr int kMaxTimes = 3;
  while (!HasAnswer()) {
    ASSERT_LT(asked, kMaxTimes) << process_->StandardErrorSoFar();
    Ask("TRAMMEL_APPLY", "nothing to apply");
    Calibrate("_TRAMMEL_KEEP_ALIVE", filament);
    ++asked;
  }
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  WaitUntilAnswered("TRAMMEL_ASK BUTTONS=use MSG=\"pressure_advance = 0.0");
  Ask("TRAMMEL_APPLY", "kept for pla__2b_50__25 on extruder/0.40");
  shop_->With([](sim::VirtualKlipper& klipper) {
    EXPECT_THAT(klipper.saved_variables["trammel_pa"],
                HasSubstr("{\"pla__2b_50__25\":{\"extruder/0.40\":0.0"));
  });
  // Four times the uncertainty that a quick calibration states.
  EXPECT_NEAR(shop_->Look().settings.at("pressure advance"), 0.03, 0.008);
  process_->Send(SIGTERM);
  const ProcessEnd end = process_->Wait();
  EXPECT_EQ(end.exit_code, 0) << end.standard_error;
  int reports = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(shop_->folder() / "recordings")) {
    reports += entry.path().filename() == "report.html";
  }
  EXPECT_EQ(reports, asked);
}

TEST_F(Listen, SaysWhyThereIsNoAnswerAndListensOnThroughARestart) {
  ShopOptions options = WithMacros();
  options.with_camera = false;
  Start(options);
  Calibrate("no calibration: camera");
  shop_->Script("FIRMWARE_RESTART");
  shop_->WaitUntil(
      [](sim::VirtualKlipper& klipper) {
        int ready = 0;
        for (const sim::StateEntry& entry : klipper.history().states) {
          ready += entry.state == "ready";
        }
        return ready >= 2;
      },
      "the printer was back", *process_);
  // The methods are registered anew some moments after the printer is ready: whoever presses the
  // button meanwhile presses it again.
  bool heard = false;
  for (int attempt = 0; attempt < 10 * kEnough_s && !heard; ++attempt) {
    ASSERT_TRUE(process_->Running()) << process_->StandardErrorSoFar();
    if (attempt % 10 == 0) shop_->Script("TRAMMEL_PA");
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    shop_->With(
        [&](sim::VirtualKlipper& klipper) { heard = TimesRead(klipper, "BUTTONS=start") >= 2; });
  }
  EXPECT_TRUE(heard);
}

TEST_F(Listen, HeatsNothingWhereTheSettingsNameNoMaterial) {
  Start(WithMacros());
  const auto file = shop_->folder() / "trammel.toml";
  std::string settings = ReadWhole(file);
  const std::size_t at = settings.find("bed_temperature");
  ASSERT_NE(at, std::string::npos);
  settings.erase(at, settings.find('\n', at) - at);
  WriteWhole(file, settings);
  const auto heated = [this] {
    int times = 0;
    shop_->With([&](sim::VirtualKlipper& klipper) {
      times = TimesRead(klipper, "SET_HEATER_TEMPERATURE") + TimesRead(klipper, "G28");
    });
    return times;
  };
  const int before = heated();
  Ask("TRAMMEL_PA", "no calibration");
  EXPECT_THAT(process_->StandardErrorSoFar(), HasSubstr("[filament] bed_temperature"));
  EXPECT_EQ(heated(), before);
}

TEST_F(Listen, ATermInTheMiddleOfASweepLeavesThePrinterAsItWas) {
  Start(WithMacros());
  Calibrate("_TRAMMEL_KEEP_ALIVE");
  shop_->WaitUntilSweeping(1, *process_);
  process_->Send(SIGTERM);
  const ProcessEnd end = process_->Wait();
  EXPECT_EQ(end.exit_code, 130) << end.standard_error;
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  EXPECT_THAT(end.standard_error, HasSubstr("what was recorded so far is in"));
}

}  // namespace
}  // namespace trammel::test
