// Tool offsets from the printer's screen: the sheet, the scans that its owner uploads, and what is
// set of them, by trammel serve before a virtual tool changer over real sockets.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "image/png_test_support.h"
#include "offset_changer.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;
using sim::VirtualKlipper;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kMachine = 3, kNotTrusted = 2, kUnsafe = 4;
constexpr double kHour_s = 3600;

/// Counts this text in the console, or as a dialog's question. The text also appears on the display
/// and in the dialog, a moment later.
int TimesTold(const VirtualKlipper& klipper, const std::string& text) {
  const bool dialog = text.starts_with("TRAMMEL_ASK") || text.starts_with(" MSG=");
  int times = 0;
  for (const sim::ReadLine& line : klipper.history().lines) {
    times += line.text.starts_with(dialog ? "TRAMMEL_ASK" : "RESPOND TYPE=echo") &&
             line.text.find(text) != std::string::npos;
  }
  return times;
}

double Now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

class OffsetServe : public OffsetChanger {
 protected:
  void Open(const ShopOptions& options = Changer()) {
    shop_ = std::make_unique<MachineShop>(options);
    before_ = shop_->Look();
    Launch();
  }
  void Launch() { service_ = shop_->Serve(); }
  /// Calls a macro, and waits until the printer was told this once more.
  void Ask(const std::string& macro, const std::string& answer) {
    int before = 0;
    shop_->With([&](VirtualKlipper& klipper) { before = TimesTold(klipper, answer); });
    shop_->Script(macro);
    shop_->WaitUntil([&](VirtualKlipper& klipper) { return TimesTold(klipper, answer) > before; },
                     "the printer was told: " + answer, *service_);
  }
  /// Asks for a sheet, presses the dialog's button, and waits until the printer was told this.
  void Print(const std::string& parameters, const std::string& answer) {
    Ask("TRAMMEL_OFFSET" + parameters, "TRAMMEL_ASK BUTTONS=sheet TOKEN=");
    int before = 0;
    shop_->With([&](VirtualKlipper& klipper) { before = TimesTold(klipper, answer); });
    shop_->Confirm();
    shop_->WaitUntil([&](VirtualKlipper& klipper) { return TimesTold(klipper, answer) > before; },
                     "the printer was told: " + answer, *service_);
  }
  /// The folder of the last sheet.
  [[nodiscard]] std::string SheetFolder() const {
    std::string last;
    for (const auto& entry : fs::directory_iterator(shop_->folder() / "recordings")) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("offset_sheet-") && name > last) last = name;
    }
    return "recordings/" + last;
  }
  /// A scan of a sheet.
  [[nodiscard]] std::string ScanOf(const std::string& pattern, int seed) const {
    Scan("scan.png", pattern, seed);
    std::string bytes = ReadWhole(shop_->folder() / "scan.png");
    fs::remove(shop_->folder() / "scan.png");
    return bytes;
  }
  void Store(const std::string& name, const std::string& bytes, double age_s = 0) const {
    shop_->With([&](VirtualKlipper& klipper) {
      klipper.StoreConfigFile("trammel/" + name, bytes, Now_s() - age_s);
    });
  }
  std::unique_ptr<TrammelProcess> service_;
};

TEST_F(OffsetServe, LeadsFromTheDialogToOffsetsThatAreSetOnce) {
  Open();
  Ask("TRAMMEL_OFFSET",
      " MSG=\"Is A5 paper (148 mm along X, 210 along Y) taped flat on "
      "the COLD bed, its middle at X");
  EXPECT_EQ(Moves(), 0U);
  ExpectAllOff();
  Print("", "TRAMMEL_ASK BUTTONS=scan MSG=\"Sheet printed, everything is off.");
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  ExpectAllOff();
  Ask("TRAMMEL_OFFSET_SCAN", "no calibration: there is no scan in the folder trammel");

  const std::string pattern = SheetFolder() + "/pattern.gcode";
  const std::string scan = ScanOf(pattern, 41);
  Store("sheet.png", scan);
  Ask("TRAMMEL_OFFSET_SCAN", "TRAMMEL_ASK BUTTONS=use MSG=\"tool offsets T1 x +0.1");
  ExpectOffsetsUnchanged();
  shop_->With([](VirtualKlipper& klipper) {
    EXPECT_EQ(TimesTold(klipper, "trammel: tool_offset T1 x = +0.1"), 1);
    int pictures = 0;
    for (const auto& [name, file] : klipper.config_files()) {
      pictures += name.starts_with("trammel/offset_scan-") && name.ends_with(".png") &&
                  file.data.starts_with("\x89PNG");
    }
    EXPECT_EQ(pictures, 1);
  });
  Ask("TRAMMEL_APPLY", "until Klipper restarts");
  ExpectOffsetsNew();
  const auto set = Kept();

  // The same once more, by every way to it.
  Ask("TRAMMEL_APPLY", "nothing to apply");
  Ask("TRAMMEL_OFFSET_SCAN", "was measured before");
  Ask("TRAMMEL_OFFSET_SCAN FILE=sheet.png", "TRAMMEL_ASK BUTTONS=use MSG=\"tool offsets T1");
  Ask("TRAMMEL_APPLY", "not applied: ");
  shop_->With([](VirtualKlipper& klipper) {
    EXPECT_EQ(TimesTold(klipper, "trammel: not applied: taking it out twice would move tool 1"), 1);
  });
  Ask("TRAMMEL_DISMISS", "nothing applied");
  // Another scan of the same print says nearly the same, and would move the tool again.
  Store("again.png", ScanOf(pattern, 42));
  Ask("TRAMMEL_OFFSET_SCAN", "TRAMMEL_ASK BUTTONS=use MSG=\"tool offsets T1");
  Ask("TRAMMEL_APPLY", "not applied: tool 1 had an offset of 0.250, -0.500 mm when the sheet was");
  EXPECT_EQ(Kept(), set);
  service_->Send(SIGTERM);
  EXPECT_EQ(service_->Wait().exit_code, 0);
}

TEST_F(OffsetServe, WhatIsNoScanOfThisPrintIsRefusedByItsCause) {
  Open();
  Ask("TRAMMEL_OFFSET_SCAN", "no sheet was printed on localhost");
  Print(" TOOLS=0,1", "TRAMMEL_ASK BUTTONS=scan");
  const std::string pattern = SheetFolder() + "/pattern.gcode";
  const std::string scan = ScanOf(pattern, 51);
  // An earlier print of the same sheet has the same number.
  Store("old.png", scan, kHour_s);
  Ask("TRAMMEL_OFFSET_SCAN",
      "old.png in the folder trammel beside the printer's configuration is "
      "older than the sheet");
  Ask("TRAMMEL_OFFSET_SCAN FILE=old.png", "is older than the sheet that was printed last");
  Ask("TRAMMEL_OFFSET_SCAN FILE=none.png", "none.png is not in the folder trammel");
  Ask("TRAMMEL_OFFSET_SCAN FILE=printer.cfg", "must be the name of a scan or photo");
  Ask("TRAMMEL_OFFSET_SCAN FILE=../printer.png", "must be the name of a scan or photo");
  Store("letter.png", "Dear reader,");
  Ask("TRAMMEL_OFFSET_SCAN", "no calibration: ");
  // Another sheet.
  ASSERT_EQ(shop_
                ->Run({"offset", "pattern", "--out", "other.gcode", "--set", "teeth=10", "--set",
                       "tools=[0,1]"})
                .exit_code,
            0);
  const std::string other = ScanOf("other.gcode", 52);
  Store("letter.png", other);
  Ask("TRAMMEL_OFFSET_SCAN", "the page shows sheet");
  ExpectOffsetsUnchanged();
  Ask("TRAMMEL_APPLY", "nothing to apply");
  // Beside the right one it is left out.
  Store("right.png", scan);
  Ask("TRAMMEL_OFFSET_SCAN", "TRAMMEL_ASK BUTTONS=use MSG=\"tool offsets T1");
  shop_->With(
      [](VirtualKlipper& klipper) { EXPECT_GE(TimesTold(klipper, "left out: picture "), 1); });
  Ask("TRAMMEL_DISMISS", "nothing applied");
  ExpectOffsetsUnchanged();
}

TEST_F(OffsetServe, BeginsNothingOnAWarmBedOrWithOneToolOrASecondTime) {
  ShopOptions options = Changer();
  options.klipper.bed.cool_s = 1e5;
  Open(options);
  shop_->With([](VirtualKlipper& klipper) { klipper.bed.temperature_c = 58; });
  Print("", "wants a cold printer: heater_bed 5");
  Ask("TRAMMEL_OFFSET TOOLS=0,x", "no calibration: TOOLS must be a list of numbers");
  Ask("TRAMMEL_OFFSET TOOLS=0,1 TEMP=9", "no calibration: ");
  Ask("TRAMMEL_OFFSET TOOLS=0,1 TEMP=200", " MSG=\"Is A5 paper");
  EXPECT_EQ(Moves(), 0U);
  ExpectAllOff();
  // A guided start in a terminal has the printer while it asks.
  const auto shell = std::make_unique<TrammelProcess>(
      std::vector<std::string>{"offset", "start", "--printer", shop_->address(), "--out", "rec"},
      shop_->folder(), ProcessLimits{.terminal = true});
  shop_->WaitUntilSaid("[y/N]", *shell);
  shop_->Confirm();
  shop_->WaitUntil(
      [](VirtualKlipper& klipper) {
        return TimesTold(klipper, "no calibration: the printer is taken") > 0;
      },
      "it refused", *service_);
  shell->Type("n");
  (void)shell->Wait();
  service_->Send(SIGTERM);
  (void)service_->Wait();

  options.klipper.tools.clear();
  Open(options);
  Ask("TRAMMEL_OFFSET", "no calibration: the printer has one tool, T0");
  EXPECT_EQ(Moves(), 0U);
}

TEST_F(OffsetServe, KilledWhileItPrintsAllIsColdAndWhatWasPrintedIsNotMeasured) {
  ShopOptions options = Changer();
  options.hurry = 20;
  Open(options);
  Ask("TRAMMEL_OFFSET", "TRAMMEL_ASK BUTTONS=sheet TOKEN=");
  shop_->Confirm();
  shop_->WaitUntilPrinting(*service_);
  EXPECT_THAT(shop_->Run({"offset", "start", "--yes", "move,paper", "--out", "other", "--printer",
                          shop_->address()}),
              Ends(kMachine));
  service_->Send(SIGKILL);
  EXPECT_EQ(service_->Wait().signal, SIGKILL);
  EXPECT_THAT(shop_->Faulty(before_, kEnough_s), IsEmpty());
  ExpectAllOff();
  Launch();
  Store("sheet.png", ScanOf(SheetFolder() + "/pattern.gcode", 61));
  Ask("TRAMMEL_OFFSET_SCAN", "does not say that it was printed to its end: print another one");
  ExpectOffsetsUnchanged();
}

TEST_F(OffsetServe, WhereNobodyKeepsOffsetsTheAnswerIsShownAndNothingIsOffered) {
  ShopOptions options = Changer();
  options.klipper.tools.clear();
  options.klipper.extruders = 2;
  Open(options);
  Ask("TRAMMEL_OFFSET", "no calibration: the printer has several extruders");
  Print(" TOOLS=0,1", "TRAMMEL_ASK BUTTONS=scan");
  Store("sheet.png", ScanOf(SheetFolder() + "/pattern.gcode", 71));
  Ask("TRAMMEL_OFFSET_SCAN", "TRAMMEL_ASK BUTTONS=close MSG=\"tool offsets T1");
  Ask("TRAMMEL_APPLY", "nothing to apply");
}

/// The same without a service.
class OffsetMeasure : public OffsetServe {
 protected:
  [[nodiscard]] std::vector<std::string> Words(std::vector<std::string> words) const {
    words.insert(words.end(), {"--printer", shop_->address()});
    return words;
  }
};

TEST_F(OffsetMeasure, WhereTheRunWasKilledAndThePrintWentOnItsScanIsMeasured) {
  ShopOptions options = Changer();
  options.hurry = 20;
  options.klipper.macros.clear();  // neither a LASER_OFF nor klipper/trammel.cfg
  shop_ = std::make_unique<MachineShop>(options);
  {
    TrammelProcess run(Words({"offset", "start", "--print-only", "--yes", "move,paper", "--out",
                              "recordings/offset_sheet-1"}),
                       shop_->folder());
    shop_->WaitUntilPrinting(run);
    run.Send(SIGKILL);
    (void)run.Wait();
  }
  TrammelProcess waits({"sim", "printer", "--port", "0", "--for", "200"}, shop_->folder());
  shop_->WaitUntil([](VirtualKlipper& klipper) { return klipper.print.state == "complete"; },
                   "the print ended", waits);
  Store("sheet.png", ScanOf(SheetFolder() + "/pattern.gcode", 81));
  const ProcessEnd measured =
      shop_->Run(Words({"offset", "measure", "--out", "recordings/measured"}));
  ASSERT_EQ(measured.exit_code, 0) << measured.standard_error;
  EXPECT_THAT(
      measured.standard_output,
      Containing("X offset  0.250  ->", "trammel offset apply recordings/measured --apply"));
  for (const char* file :
       {"scan.png", "pattern.gcode", "start.json", "result.json", "answer.png", "report.html"}) {
    EXPECT_TRUE(fs::exists(shop_->folder() / "recordings/measured" / file)) << file;
  }
  // Set by hand meanwhile, it is not what was measured; and of the reference tool neither.
  for (const int tool : {1, 0}) {
    shop_->Script(fmt::format("SET_TOOL_PARAMETER T={} PARAMETER=gcode_x_offset VALUE=0.3", tool));
    EXPECT_THAT(shop_->Run(Words({"offset", "apply", "recordings/measured", "--apply"})),
                Fails(kUnsafe, fmt::format("tool {} had an offset of", tool)));
    shop_->Script(fmt::format("SET_TOOL_PARAMETER T={} PARAMETER=gcode_x_offset VALUE={}", tool,
                              tool == 1 ? kKept_x_mm : 0));
  }
  EXPECT_EQ(shop_->Run(Words({"offset", "apply", "recordings/measured", "--apply"})).exit_code, 0);
  ExpectOffsetsNew();
}

TEST_F(OffsetMeasure, WhatCannotBeReadLeavesNoFolderBehind) {
  shop_ = std::make_unique<MachineShop>(Changer());
  ASSERT_THAT(shop_->Run(Words({"offset", "start", "--print-only", "--yes", "move,paper", "--out",
                                "recordings/offset_sheet-1"})),
              Prints(0, "offset start --continue recordings/offset_sheet-1",
                     Not(HasSubstr("nothing applied"))));
  Page blank;  // no sheet on it
  blank.width = blank.height = 1000;
  blank.samples.assign(1'000'000, 0xF0);
  Store("empty.png", image::PngOf(blank));
  EXPECT_THAT(shop_->Run(Words({"offset", "measure", "--out", "recordings/none"})),
              Ends(kNotTrusted));
  EXPECT_FALSE(fs::exists(shop_->folder() / "recordings/none"));
  Store("big.pdf", std::string(16, 'x'));
  EXPECT_THAT(
      shop_->Run(Words({"offset", "measure", "--file", "big.pdf", "--out", "recordings/none"})),
      Ends(1));
  EXPECT_FALSE(fs::exists(shop_->folder() / "recordings/none"));
}

}  // namespace
}  // namespace trammel::test
