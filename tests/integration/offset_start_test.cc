// trammel offset start against a virtual tool changer, over real sockets and at a terminal of its
// own: the whole way to offsets that are set and taken back, and every way out of it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include "offset_changer.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;
using sim::VirtualKlipper;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kInput = 1, kMachine = 3, kUnsafe = 4, kInterrupted = 130;
constexpr const char* kMove = "park it high above the back of the bed";
constexpr const char* kTape = "Now tape";
constexpr const char* kScanIt = "the sheet is printed";
constexpr const char* kSetThem = "set the new offsets of T1";
constexpr const char* kKeepThem = "keep them beyond a restart";
class OffsetStart : public OffsetChanger {
 protected:
  void Open(const ShopOptions& options = Changer()) {
    shop_ = std::make_unique<MachineShop>(options);
    shop_->Script(
        "SET_PRESSURE_ADVANCE ADVANCE=0.055\nSET_VELOCITY_LIMIT ACCEL=7777\nG91\nM221 S97");
    before_ = shop_->Look();
  }
  [[nodiscard]] std::unique_ptr<TrammelProcess> Start(std::vector<std::string> more = {},
                                                      ProcessLimits limits = {.terminal = true}) {
    std::vector<std::string> words = {"offset", "start", "--printer", shop_->address()};
    words.insert(words.end(), more.begin(), more.end());
    return std::make_unique<TrammelProcess>(words, shop_->folder(), limits);
  }
  [[nodiscard]] std::unique_ptr<TrammelProcess> StartNew(std::vector<std::string> more = {},
                                                         ProcessLimits limits = {
                                                             .terminal = true}) {
    more.insert(more.begin(), {"--out", "rec"});
    return Start(std::move(more), limits);
  }
  void Await(const std::string& words, TrammelProcess& process) {
    shop_->WaitUntil(
        [&](VirtualKlipper&) {
          return process.StandardErrorSoFar().find(words, said_) != std::string::npos;
        },
        "it said: " + words, process);
    said_ = process.StandardErrorSoFar().find(words, said_) + words.size();
  }
  void Answer(const std::string& question, const std::string& answer, TrammelProcess& process) {
    Await(question, process);
    Await("[y/N]", process);
    process.Type(answer);
  }
  void Print(TrammelProcess& process) {
    Answer(kMove, "y", process);
    Answer(kTape, "y", process);
    Await(kScanIt, process);
  }

  std::size_t said_ = 0;
};

TEST_F(OffsetStart, LeadsFromTheToolsToOffsetsThatAreKeptAndTakenBack) {
  Open();
  const auto process = StartNew();
  Print(*process);
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  ExpectAllOff();
  ExpectOffsetsUnchanged();
  Scan("rec/scan/sheet.png");
  Answer(kSetThem, "y", *process);
  Answer(kKeepThem, "yes", *process);
  ASSERT_THAT(process->Wait(), Prints(0, "tool 1     extruder1, keeps 0.250, -0.500 mm",
                                      "heated to", "paper      A5", "T0 -> T1",
                                      "X offset  0.250  ->", "offset apply --undo --save"));
  ExpectOffsetsNew();
  for (const char* file : {"pattern.gcode", "pattern.png", "pattern.svg", "start.json",
                           "result.json", "report.html", "scan/sheet.png"}) {
    EXPECT_TRUE(fs::exists(shop_->folder() / "rec" / file)) << file;
  }
  const auto result = nlohmann::json::parse(ReadWhole(shop_->folder() / "rec" / "result.json"));
  EXPECT_EQ(result["subject"]["printer"], "localhost:" + std::to_string(shop_->server().port()));
  const std::string page = ReadWhole(shop_->folder() / "rec" / "report.html");
  EXPECT_THAT(page, HasSubstr("Where each tool lands"));
  // It outlived the restart of SAVE_CONFIG, and goes back: until the next one, and beyond.
  ASSERT_THAT(shop_->Run({"offset", "apply", "--undo", "--printer", shop_->address()}),
              Prints(0, "unless offset apply --undo --save keeps this"));
  ASSERT_THAT(shop_->Run({"offset", "apply", "--undo", "--save", "--printer", shop_->address()}),
              Ends(0));
  ExpectOffsetsUnchanged();
  shop_->With([](VirtualKlipper& klipper) { EXPECT_TRUE(klipper.files().empty()); });
}

TEST_F(OffsetStart, AsksForPaperOnlyOverAColdBedWithTheHeadHighBehindItAndStandsStillMeanwhile) {
  ShopOptions options = Changer();
  options.klipper.idle_timeout_s = 1e6;
  Open(options);
  shop_->Script("M140 S60\nM104 T1 S150");
  shop_->With([](VirtualKlipper& klipper) {
    klipper.bed.temperature_c = 60;
    for (sim::Heater& heater : klipper.more_nozzles) heater.temperature_c = 150;
  });
  const auto process = StartNew();
  Await("what is on now goes off and stays off (extruder1 150 degC, heater_bed 60 degC)", *process);
  EXPECT_EQ(Moves(), 0U);
  Answer("", "y", *process);
  Await(kTape, *process);
  Await("[y/N]", *process);
  double print_s = 0;
  shop_->With([&](VirtualKlipper& klipper) {
    EXPECT_LE(klipper.bed.temperature_c, 40);
    for (const sim::Heater& heater : klipper.more_nozzles) EXPECT_LE(heater.temperature_c, 50);
    const auto head = klipper.TrueHead(klipper.now_s()).position;
    EXPECT_GE(klipper.commanded_mm[2], 50);
    EXPECT_NEAR(klipper.commanded_mm[1], 245, 0.01);
    EXPECT_NEAR(head.z_mm, klipper.commanded_mm[2] + klipper.physical_offset_mm[2], 0.01);
    print_s = klipper.now_s();
  });
  ExpectAllOff();
  const std::size_t moves = Moves();
  shop_->WaitUntil([&](VirtualKlipper& klipper) { return klipper.now_s() > print_s + 3; },
                   "three seconds went by", *process);
  EXPECT_EQ(Moves(), moves);
  process->Type("n");
  EXPECT_THAT(process->Wait(),
              Fails(kInterrupted, "nothing was heated or printed, as you answered"));
  EXPECT_EQ(Moves(), moves);
  ExpectAllOff();
  EXPECT_FALSE(fs::exists(shop_->folder() / "rec"));
}

TEST_F(OffsetStart, WhatWasTypedBeforeAQuestionAnswersNothing) {
  Open();
  const auto process = StartNew();
  process->Type("y\ny\ny");
  Await(kMove, *process);
  process->Type("perhaps");
  Await("y or n?", *process);
  EXPECT_EQ(Moves(), 0U);
  process->Type("");
  EXPECT_EQ(process->Wait().exit_code, kInterrupted);
  EXPECT_EQ(Moves(), 0U);
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
}

TEST_F(OffsetStart, WithoutATerminalItSaysWhatToGiveAndMovesNothing) {
  Open();
  for (const auto& [given, wanted] : {std::pair{"", "--yes move"}, {"move", "--yes paper"}}) {
    std::vector<std::string> more;
    if (*given != '\0') more = {"--yes", given};
    EXPECT_THAT(StartNew(more, {})->Wait(), Fails(kInput, wanted));
  }
  EXPECT_EQ(Moves(), 0U);
  EXPECT_FALSE(fs::exists(shop_->folder() / "rec"));
}

TEST_F(OffsetStart, WithoutATerminalItDoesWhatIsNamedAndNoMore) {
  Open();
  fs::create_directory(shop_->folder() / "in");
  const auto process = StartNew({"--yes", "move,paper", "--watch", "in"}, {});
  Await(kScanIt, *process);
  Scan("in/sheet.png");
  ASSERT_THAT(process->Wait(), Prints(0, "nothing applied   trammel offset apply rec --apply"));
  EXPECT_TRUE(fs::exists(shop_->folder() / "rec" / "scan.png"));
  ExpectOffsetsUnchanged();
  // The answer stays, and may be applied by its folder.
  ASSERT_THAT(Start({"--continue", "rec", "--yes", "apply"}, {})->Wait(), Ends(0));
  ExpectOffsetsNew();
}

struct WayOut {
  const char* name;
  int exit_code;
  const char* said;
  void (*strike)(MachineShop&, TrammelProcess&);
  bool restarts = false;
};

void PrintTo(const WayOut& way, std::ostream* out) { *out << way.name; }

void Other(MachineShop& shop) {
  shop.With([](VirtualKlipper& klipper) {
    std::string gcode = "M104 S151\nG90\nG1 Z60 F600\n";
    for (int i = 0; i < 2000; ++i) gcode += "G1 X200 Y50 F1500\nG1 X50 Y200 F1500\n";
    klipper.files()["vase.gcode"] = gcode;
    klipper.RunScript("SDCARD_PRINT_FILE FILENAME=vase.gcode");
  });
}

const WayOut kWaysOut[] = {
    {"CtrlC", kInterrupted, "stopped", [](MachineShop&, TrammelProcess& p) { p.Send(SIGINT); }},
    {"Terminate", kInterrupted, "stopped",
     [](MachineShop&, TrammelProcess& p) { p.Send(SIGTERM); }},
    {"HangUp", kInterrupted, "", [](MachineShop&, TrammelProcess& p) { p.HangUp(); }},
    {"EndOfInput", kInterrupted, "nobody is at the terminal",
     [](MachineShop&, TrammelProcess& p) { p.Type("\x04"); }},
    {"MotorsOff", kMachine, "no longer knows where its x axis is",
     [](MachineShop& s, TrammelProcess&) { s.Script("M84"); }},
    {"HeaterOn", kMachine, "somebody switched a heater on",
     [](MachineShop& s, TrammelProcess&) { s.Script("M140 S45"); }},
    {"EmergencyStop", kMachine, "went to \"shutdown\"",
     [](MachineShop& s, TrammelProcess&) { s.With([](VirtualKlipper& k) { k.EmergencyStop(); }); }},
    {"Restart", kMachine, "", [](MachineShop& s, TrammelProcess&) { s.Script("FIRMWARE_RESTART"); },
     true},
    {"LostLink", kMachine, "went to \"disconnected\"",
     [](MachineShop& s, TrammelProcess&) {
       sim::ServerFaults faults;
       faults.close_at_s = 0;
       faults.refuse_for_s = 4;
       s.server().Inject(faults);
     }},
};

class OffsetStartWhileItAsksForPaper : public OffsetStart,
                                       public testing::WithParamInterface<WayOut> {};

TEST_P(OffsetStartWhileItAsksForPaper, EndsColdWithOffsetsAsTheyWere) {
  Open();
  const auto process = StartNew();
  Answer(kMove, "y", *process);
  Await(kTape, *process);
  Await("[y/N]", *process);
  const std::size_t moves = Moves();
  GetParam().strike(*shop_, *process);
  EXPECT_THAT(process->Wait(), Fails(GetParam().exit_code, GetParam().said));
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  if (shop_->Look().state == "ready") ExpectAllOff();
  if (!GetParam().restarts) EXPECT_EQ(Moves(), moves);
  ExpectOffsetsUnchanged();
  EXPECT_FALSE(fs::exists(shop_->folder() / "rec" / "start.json"));
  // Nothing keeps the next one from beginning.
  EXPECT_THAT(StartNew({"--yes", "move"}, {})->Wait().standard_error,
              Not(HasSubstr("another trammel")));
}

INSTANTIATE_TEST_SUITE_P(All, OffsetStartWhileItAsksForPaper, testing::ValuesIn(kWaysOut),
                         [](const auto& info) { return std::string(info.param.name); });

TEST_F(OffsetStart, AnothersPrintThatBeginsMeanwhileIsLeftAlone) {
  Open();
  const auto process = StartNew();
  Answer(kMove, "y", *process);
  Await(kTape, *process);
  Other(*shop_);
  EXPECT_THAT(process->Wait(), Fails(kMachine, "somebody else's job has the printer"));
  shop_->With([](VirtualKlipper& klipper) {
    EXPECT_EQ(klipper.print.state, "printing");
    EXPECT_EQ(klipper.nozzle.target_c, 151);
  });
  ExpectOffsetsUnchanged();
}

TEST_F(OffsetStart, AStopWhileTheSecondToolDrawsLeavesItsOffsetInForceAndAllColdAndParked) {
  ShopOptions options = Changer();
  options.hurry = 20;
  Open(options);
  const auto process = StartNew();
  Answer(kMove, "y", *process);
  Answer(kTape, "y", *process);
  shop_->WaitUntil(
      [](VirtualKlipper& klipper) {
        return klipper.active_tool == 1 && klipper.print.running &&
               klipper.TrueHead(klipper.now_s()).filament_speed_mm_s > 0;
      },
      "T1 drew", *process);
  process->Send(SIGINT);
  const ProcessEnd end = process->Wait();
  EXPECT_EQ(end.exit_code, kInterrupted) << end.standard_error;
  PrinterLook wanted = before_;
  wanted.gcode["offset x"] = kKept_x_mm;  // T1's own: T0's would be wrong for it
  wanted.gcode["offset y"] = kKept_y_mm;
  EXPECT_THAT(shop_->Faulty(wanted), IsEmpty()) << end.standard_error;
  ExpectAllOff();
  ExpectOffsetsUnchanged();
  shop_->With([](VirtualKlipper& klipper) {
    EXPECT_EQ(klipper.active_extruder, "extruder1");
    EXPECT_GT(klipper.commanded_mm[2], 40);
    EXPECT_TRUE(klipper.files().empty());
  });
  // An interrupted print cannot be continued.
  EXPECT_THAT(
      Start({"--continue", "rec"}, {})->Wait(),
      Fails(kMachine, "begin again", "trammel offset analyze SCAN --pattern rec/pattern.gcode"));
}

TEST_F(OffsetStart, AStopWhileItHeatsEndsColdAtOnce) {
  ShopOptions options = Changer();
  options.hurry = 1;
  options.klipper.bed.rate_c_s = 1;
  options.klipper.bed.gain_window_s = 60;
  Open(options);
  const auto process = StartNew();
  Answer(kMove, "y", *process);
  Answer(kTape, "y", *process);
  Await("heating heater_bed", *process);
  process->Send(SIGTERM);
  EXPECT_EQ(process->Wait().exit_code, kInterrupted);
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  ExpectAllOff();
  // Nothing was printed of it: it is not the sheet whose scan is waited for.
  EXPECT_FALSE(fs::exists(shop_->folder() / "rec"));
}

TEST_F(OffsetStart, KilledBetweenPrintAndScanTheNextOneGoesOn) {
  Open();
  {
    const auto process = StartNew();
    Print(*process);
    process->Send(SIGKILL);
    (void)process->Wait();
  }
  said_ = 0;
  Scan("elsewhere.png");
  const auto process = Start({"--continue", "rec"});
  Await(kScanIt, *process);
  fs::copy_file(shop_->folder() / "elsewhere.png", shop_->folder() / "rec" / "scan" / "sheet.png");
  Answer(kSetThem, "y", *process);
  Answer(kKeepThem, "n", *process);
  const ProcessEnd end = process->Wait();
  ASSERT_EQ(end.exit_code, 0) << end.standard_error;
  ExpectOffsetsNew();
  EXPECT_THAT(end.standard_output, HasSubstr("to undo it        trammel offset apply --undo"));
  // Applied once more it is refused: it was taken out already.
  EXPECT_THAT(Start({"--continue", "rec", "--yes", "apply"}, {})->Wait(), Ends(kUnsafe));
  ExpectOffsetsNew();
}

TEST_F(OffsetStart, KilledWhileItPrintsTheNextOneEndsThatPrint) {
  ShopOptions options = Changer();
  options.hurry = 20;
  options.klipper.macros.clear();  // neither a LASER_OFF nor klipper/trammel.cfg
  Open(options);
  {
    const auto process = StartNew();
    Answer(kMove, "y", *process);
    Answer(kTape, "y", *process);
    shop_->WaitUntilPrinting(*process);
    process->Send(SIGKILL);
    (void)process->Wait();
  }
  const auto next = Start({"--out", "next"});
  said_ = 0;
  Await("its print is still under way", *next);
  Answer(kMove, "n", *next);
  EXPECT_EQ(next->Wait().exit_code, kInterrupted);
  ExpectAllOff();
  ExpectOffsetsUnchanged();
}

TEST_F(OffsetStart, BadFilesAreNamedAndItGoesOnWaiting) {
  Open();
  const auto process = StartNew();
  Print(*process);
  const fs::path in = shop_->folder() / "rec" / "scan";
  WriteWhole(in / "letter.png", "Dear reader,");
  Await("letter.png", *process);
  Await("waiting for another", *process);
  // Half a file, then the rest of it, slowly.
  Scan("whole.png");
  const std::string bytes = ReadWhole(shop_->folder() / "whole.png");
  WriteWhole(in / "slow.png", bytes.substr(0, bytes.size() / 2));
  Await("slow.png", *process);
  Await("waiting for another", *process);
  std::ofstream(in / "slow.png", std::ios::binary | std::ios::app)
      << bytes.substr(bytes.size() / 2);
  Answer(kSetThem, "", *process);
  EXPECT_THAT(process->Wait(), Prints(0, "nothing applied"));
  ExpectOffsetsUnchanged();
}

TEST_F(OffsetStart, AFullDiskIsSaidBeforeAnythingMovesAndALaterOneLosesNothing) {
  Open();
  EXPECT_THAT(StartNew({"--yes", "move,paper"}, {.file_bytes = 50'000})->Wait(), Ends(kInput));
  EXPECT_EQ(Moves(), 0U);
  EXPECT_FALSE(fs::exists(shop_->folder() / "rec"));
  const auto process = StartNew({"--yes", "move,paper", "--watch", "."}, {});
  Await(kScanIt, *process);
  process->Limit(RLIMIT_FSIZE, 10'000);
  Scan("sheet.png");
  Await("cannot be kept as rec/scan.png", *process);
  EXPECT_FALSE(fs::exists(shop_->folder() / "rec" / "scan.png"));
  process->Send(SIGINT);
  EXPECT_THAT(process->Wait(), Fails(kInterrupted, "trammel offset start --continue rec"));
  EXPECT_THAT(Start({"--continue", "rec", "--scan", "sheet.png"}, {})->Wait(), Ends(0));
}

TEST_F(OffsetStart, NothingHeatsWithoutAMaterialAndAPlaceBeyondReachIsRefused) {
  ShopOptions options = Changer();
  Open(options);
  WriteWhole(shop_->folder() / "bare.toml", "[tool_offset_pattern]\nteeth = 9\n");
  EXPECT_THAT(StartNew({"--yes", "move,paper", "--config", "bare.toml"}, {})->Wait(),
              Fails(kInput, "material"));
  EXPECT_THAT(
      StartNew({"--yes", "move,paper", "--set", "bed_size_x=400", "--set", "position_x=330"}, {})
          ->Wait(),
      Fails(kUnsafe, "the nozzle reaches X -2.0 ... 255.0"));
  EXPECT_THAT(
      StartNew({"--yes", "move,paper", "--set", "nozzle_temperatures=[190, 350]"}, {})->Wait(),
      Ends(kUnsafe));
  EXPECT_EQ(Moves(), 0U);
  // A terminal shows a prompt.
  const auto process = StartNew({"--config", "bare.toml"});
  Await("which material is loaded", *process);
  process->Type("chewing gum");
  Await("which material is loaded", *process);
  process->Type("petg");
  Answer(kMove, "n", *process);
  EXPECT_THAT(process->Wait().standard_output, HasSubstr("petg: nozzle"));
}

/// The commands of the manual's guided way, without remarks: without `trammel`, `sim` for
/// `trammel-sim`.
std::vector<std::vector<std::string>> ManualsCommands(const std::string& address) {
  std::istringstream lines(ReadWhole(fs::path(TRAMMEL_DOCS_DIR) / "howto/tool-offset.md"));
  std::vector<std::vector<std::string>> commands;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## ")) inside = line.starts_with("## Guided");
    constexpr std::string_view kPrompt = "    trammel ", kSimPrompt = "    trammel-sim ";
    if (line.starts_with(kSimPrompt)) line.replace(0, kSimPrompt.size(), "    trammel sim ");
    if (!inside || !line.starts_with(kPrompt)) continue;
    std::istringstream words(line.substr(kPrompt.size(), line.find("  #") - kPrompt.size()));
    std::vector<std::string>& command = commands.emplace_back();
    for (std::string word; words >> word;) command.push_back(word == "localhost" ? address : word);
  }
  return commands;
}

TEST_F(OffsetStart, TheManualsCommandsRunInTheirOrder) {
  Open();
  const auto commands = ManualsCommands(shop_->address());
  ASSERT_EQ(commands.size(), 4U);
  EXPECT_THAT(commands[0], AllOf(Contains("printer"), Contains("1:0.25,-0.5")));  // the shop is it
  const auto process = std::make_unique<TrammelProcess>(commands[1], shop_->folder(),
                                                        ProcessLimits{.terminal = true});
  Print(*process);
  ASSERT_EQ(shop_->Run(commands[2]).exit_code, 0);
  Answer(kSetThem, "y", *process);
  Answer(kKeepThem, "n", *process);
  ASSERT_EQ(process->Wait().exit_code, 0);
  ExpectOffsetsNew();
  ASSERT_EQ(shop_->Run(commands[3]).exit_code, 0);
  ExpectOffsetsUnchanged();
}

}  // namespace
}  // namespace trammel::test
