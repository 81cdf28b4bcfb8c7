// trammel pa calibrate against the virtual printer, over real sockets: what it answers and how it
// leaves the machine when nothing goes wrong.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "fault_scenario.h"
#include "frame_truth.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/files/recording.h"
#include "sim/moonraker/spoolman.h"
#include "support/analyze_result.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// At the paper's speed, and as the default pattern is swept: to and fro, five lines into one video.
TEST(Calibrate, FindsTheTruthAndLeavesThePrinterAsItWas) {
  struct Row {
    std::vector<std::string> arguments;
    double place_mm;
    std::size_t min_frames;
    bool at_once;
  };
  for (const Row& row :
       {Row{{"--json", "--set", "speed=6.6667", "--set", "fps=30"}, 0.05, 100, false},
        Row{{"--json", "--config", "default.toml"}, 0.15, 250, true}}) {
    SCOPED_TRACE(row.at_once);
    ShopOptions options;
    options.camera.latency_jitter_s = 0.05;
    options.camera.frames_per_s = 30;
    MachineShop shop(options);
    WriteWhole(shop.folder() / "default.toml",
               "[filament]\nnozzle_temperature = 190\nidle_nozzle_temperature = 170\n"
               "bed_temperature = 40\n[printer]\nz_speed = 50\n");
    if (!row.at_once) shop.Script(kWorkedWith);
    const PrinterLook before = shop.Look();
    const ProcessEnd end = shop.Calibrate(row.arguments)->Wait();
    ASSERT_EQ(end.exit_code, 0) << "signal " << end.signal << "\n"
                                << end.standard_error << end.standard_output;
    const auto answer = nlohmann::json::parse(end.standard_output);
    ASSERT_EQ(answer["verdict"], "good");
    const double sigma_s = answer["standard_uncertainty_s"].get<double>();
    // Four standard uncertainties: once in 16,000 worlds by chance; and never coarse.
    EXPECT_NEAR(answer["pressure_advance_s"].get<double>(), 0.03, 4 * sigma_s);
    EXPECT_LT(sigma_s, 0.002);
    EXPECT_THAT(shop.Faulty(before), IsEmpty());
    shop.With([](sim::VirtualKlipper& klipper) {
      EXPECT_TRUE(klipper.files().empty()) << "an upload was left";
    });
    const auto scan = Must(files::ReadScan(shop.folder() / "rec"));
    for (std::size_t line = 0; row.at_once && line < 10; ++line) {
      EXPECT_EQ(scan.lines.at(line).video.substr(0, 5), line < 5 ? "line0" : "line5");
    }
    const auto again = AnalyzeToJson("rec", shop.folder());
    EXPECT_EQ(again["pressure_advance_s"], answer["pressure_advance_s"]);
    const PlacedFrames placed = CompareWithTruth(shop.folder() / "rec", shop.camera().truth());
    EXPECT_EQ(placed.unmatched, 0);
    ASSERT_GT(placed.error_mm.size(), row.min_frames);
    EXPECT_LT(MedianPlaceError_mm(placed), row.place_mm);
  }
}

/// Gives the share of a recording's lines that each pattern has, by scan.json.
std::map<int, int> LinesOfPatterns(const std::filesystem::path& recording) {
  const auto scan = files::ReadScan(recording);
  std::map<int, int> lines;
  EXPECT_TRUE(scan) << scan.error().message;
  if (!scan) return lines;
  for (const auto& line : scan->lines) ++lines[line.pattern];
  return lines;
}

TEST(Calibrate, RepeatsThePatternAndSaysWhatEachSaysAlone) {
  MachineShop shop;
  shop.Script(kWorkedWith);
  const PrinterLook before = shop.Look();
  const ProcessEnd end = shop.Calibrate({"--json", "--repeat", "2"})->Wait();
  ASSERT_EQ(end.exit_code, 0) << end.standard_error << end.standard_output;
  const auto answer = nlohmann::json::parse(end.standard_output);
  ASSERT_EQ(answer["verdict"], "good");
  const auto& repeat = answer["repeat"];
  ASSERT_EQ(repeat["patterns"].size(), 2U);
  double mean_s = 0;
  for (const auto& pattern : repeat["patterns"]) {
    ASSERT_EQ(pattern["verdict"], "good");
    mean_s += pattern["pressure_advance_s"].get<double>() / 2;
  }
  const double sigma_s = answer["standard_uncertainty_s"].get<double>();
  EXPECT_NEAR(answer["pressure_advance_s"].get<double>(), mean_s, sigma_s);
  EXPECT_NEAR(answer["pressure_advance_s"].get<double>(), 0.03, 4 * sigma_s);
  EXPECT_GT(repeat["scatter_s"].get<double>(), 0);
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
  const auto lines = LinesOfPatterns(shop.folder() / "rec");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines.at(0), lines.at(1));
  EXPECT_EQ(AnalyzeToJson("rec", shop.folder())["repeat"], repeat);
  const ProcessEnd text = shop.Run({"pa", "analyze", "rec"});
  EXPECT_THAT(text.standard_output, Containing("pattern 2", "from pattern to pattern"));
}

TEST(Calibrate, RefusesMorePatternsThanFitBeforeAnythingMoves) {
  MachineShop shop;
  const PrinterLook before = shop.Look();
  EXPECT_THAT(shop.Calibrate({"--repeat", "9", "--set", "line_spacing=40"})->Wait(),
              Fails(4, "do not fit beside one another"));
  EXPECT_FALSE(std::filesystem::exists(shop.folder() / "rec"));
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
  for (const char* count : {"0", "1", "10", "-1", "nan"}) {
    EXPECT_EQ(shop.Calibrate({"--repeat", count})->Wait().exit_code, 1) << count;
  }
}

TEST(Calibrate, MakesTheTableOfSeveralSpeedsOnOnePlate) {
  // Half a step of the list: the virtual printer's law has another truth at each speed.
  constexpr double kNear_s = 0.005;
  MachineShop shop;
  shop.Script(kWorkedWith);
  const PrinterLook before = shop.Look();
  const ProcessEnd end = shop.Calibrate({"--json", "--speeds", "75,150"})->Wait();
  ASSERT_EQ(end.exit_code, 0) << end.standard_error << end.standard_output;
  const auto answer = nlohmann::json::parse(end.standard_output);
  ASSERT_EQ(answer["patterns"].size(), 2U);
  for (const auto& pattern : answer["patterns"]) {
    const auto& value = pattern["pressure_advance_s"];
    ASSERT_EQ(value["verdict"], "good") << pattern;
    EXPECT_NEAR(value["value"].get<double>(), 0.03, kNear_s);
    EXPECT_THAT(LinesOfPatterns(shop.folder() / pattern["folder"].get<std::string>()),
                ::testing::ElementsAre(::testing::Pair(0, 5)));
  }
  ASSERT_EQ(answer["table"]["rows"].size(), 2U);
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
  shop.With([](sim::VirtualKlipper& klipper) {
    EXPECT_TRUE(klipper.files().empty()) << "an upload was left";
  });
  // Each is a recording that other commands read.
  const ProcessEnd table =
      shop.Run({"pa", "table", "rec/75mm_s-3000mm_s2", "rec/150mm_s-3000mm_s2", "--json"});
  ASSERT_EQ(table.exit_code, 0) << table.standard_error;
  EXPECT_EQ(nlohmann::json::parse(table.standard_output), answer["table"]);
  EXPECT_EQ(
      shop.Run({"pa", "apply", "rec/75mm_s-3000mm_s2", "--dry-run", "--printer", shop.address()})
          .exit_code,
      0);
}

TEST(Calibrate, ThatIsStoppedInItsSecondPatternKeepsTheFirstAndIsLeftSafe) {
  MachineShop shop;
  shop.Script(kWorkedWith);
  const PrinterLook before = shop.Look();
  const auto process = shop.Calibrate({"--speeds", "75,150"});
  shop.WaitUntilSweeping(7, *process);  // five lines each
  process->Send(SIGINT);
  EXPECT_THAT(process->Wait(), Ends(130));
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
  EXPECT_EQ(AnalyzeToJson("rec/75mm_s-3000mm_s2", shop.folder())["verdict"], "good");
}

TEST(Calibrate, RefusesSpeedsThatThePrinterIsNotAllowedBeforeAnythingMoves) {
  MachineShop shop;
  shop.Script("SET_VELOCITY_LIMIT VELOCITY=100");
  const PrinterLook before = shop.Look();
  EXPECT_THAT(shop.Calibrate({"--speeds", "75,150"})->Wait(), Fails(4, "max_velocity is 100"));
  EXPECT_FALSE(std::filesystem::exists(shop.folder() / "rec"));
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
}

TEST(Calibrate, AppliesOnlyWhatItIsToldToApply) {
  MachineShop shop;
  shop.Script(kWorkedWith);
  PrinterLook wanted = shop.Look();
  ASSERT_THAT(shop.Calibrate({"--apply"})->Wait(), Ends(0));
  const double answer_s = AnalyzeToJson("rec", shop.folder())["pressure_advance_s"].get<double>();
  constexpr double kDigits_s = 0.00005;  // four decimals are sent
  EXPECT_NEAR(shop.Look().settings.at("pressure advance"), answer_s, kDigits_s);
  wanted.settings["pressure advance"] = shop.Look().settings.at("pressure advance");
  EXPECT_THAT(shop.Faulty(wanted), IsEmpty());
  shop.Script("SET_PRESSURE_ADVANCE ADVANCE=0.077");
  const ProcessEnd applied =
      shop.Run({"pa", "apply", "rec", "--filament", "Generic PLA", "--printer", shop.address()});
  EXPECT_EQ(applied.exit_code, 0) << applied.standard_error;
  EXPECT_NEAR(shop.Look().settings.at("pressure advance"), answer_s, kDigits_s);
  EXPECT_THAT(applied.standard_output, HasSubstr("TRAMMEL_FILAMENT FILAMENT=generic_pla"));
  shop.With([&](sim::VirtualKlipper& klipper) {
    const auto kept = nlohmann::json::parse(klipper.saved_variables["trammel_pa"], nullptr, false);
    const nlohmann::json::json_pointer place("/generic_pla/extruder~10.40");
    ASSERT_TRUE(kept.is_object() && kept.contains(place)) << kept;
    EXPECT_NEAR(kept.at(place).get<double>(), answer_s, kDigits_s);
  });
}

// The pattern was printed with the spool that was there then; what is registered later is not it.
TEST(Calibrate, OfASpoolThatIsChangedMeanwhileTheFirstOneIsListedAndItIsSaid) {
  ShopOptions options;
  options.spoolman = std::make_shared<sim::VirtualSpoolman>();
  MachineShop shop(options);
  const int first = options.spoolman->AddSpool("Prusament", "PETG Jet", "PETG");
  const int second = options.spoolman->AddSpool("", "Galaxy", "PLA");
  options.spoolman->Activate(first);
  const auto process = shop.Calibrate();
  shop.WaitUntilSweeping(1, *process);
  options.spoolman->Activate(second);
  ASSERT_THAT(process->Wait(),
              Prints(0, "changed meanwhile, from 1 (Prusament PETG Jet) to 2 (Galaxy)"));
  const auto kept = Must(files::ReadOutcome(shop.folder() / "rec" / files::kResultFile));
  EXPECT_EQ(kept.subject.spool, "1");
  EXPECT_EQ(kept.subject.filament, "Prusament PETG Jet");
  // Use it: set, and kept on no spool; nothing is analysed again for it.
  const ProcessEnd applied = shop.Run({"pa", "apply", "rec", "--printer", shop.address(), "--set",
                                       "moonraker.keep_in_spoolman=true"});
  EXPECT_THAT(applied, Prints(0, "in Spoolman: the result is of"));
  EXPECT_EQ(options.spoolman->Extra("filament", second, "pressure_advance"), std::nullopt);
  EXPECT_THAT(applied.standard_error, Not(HasSubstr("analysing again")));
}

/// Gives the bytes that a frame takes on average in the videos that are read. A line that a busy
/// computer had to sweep again leaves another one beside them, which stays whole.
double BytesPerFrame(const std::filesystem::path& recording) {
  const auto scan = Must(files::ReadScan(recording));
  std::uintmax_t bytes = 0;
  std::size_t frames = 0;
  for (const auto& line : scan.lines) {
    bytes += std::filesystem::file_size(recording / line.video);
    frames += line.frame_positions_mm.size();
  }
  return static_cast<double>(bytes) / static_cast<double>(frames);
}

TEST(Calibrate, CutsItsRecordingWithoutChangingABitOfTheAnswer) {
  double bytes[2] = {};
  for (const bool keep_full : {false, true}) {
    ShopOptions options;
    options.camera.view.frame_width_px = 480;
    options.camera.view.frame_height_px = 360;
    MachineShop shop(options);
    std::vector<std::string> arguments = {"--json"};
    if (keep_full) arguments.emplace_back("--keep-full");
    const ProcessEnd end = shop.Calibrate(arguments)->Wait();
    ASSERT_EQ(end.exit_code, 0) << end.standard_error;
    EXPECT_EQ(end.standard_error.find("keeps its whole frames"), std::string::npos)
        << end.standard_error;
    // The answer is of videos that were cut meanwhile, the other one of cut videos alone.
    auto answer = nlohmann::json::parse(end.standard_output);
    auto again = AnalyzeToJson("rec", shop.folder());
    answer.erase("report");
    again.erase("report");
    EXPECT_EQ(again, answer);
    bytes[keep_full ? 1 : 0] = BytesPerFrame(shop.folder() / "rec");
  }
  EXPECT_GT(bytes[0], 0);
  EXPECT_LT(bytes[0], bytes[1] / 4);
  std::printf("%.0f bytes per frame, whole %.0f\n", bytes[0], bytes[1]);
}

TEST(Validate, SaysWhatAPressureAdvanceImproves) {
  MachineShop shop;
  shop.Script(kWorkedWith);
  const PrinterLook before = shop.Look();
  const ProcessEnd end =
      shop.Run({"pa", "validate", "0.03", "--json", "--printer", shop.address(), "--out", "rec"});
  ASSERT_EQ(end.exit_code, 0) << end.standard_error << end.standard_output;
  const auto answer = nlohmann::json::parse(end.standard_output);
  for (const char* group : {"control", "calibrated"}) EXPECT_EQ(answer[group]["lines"], 5) << group;
  EXPECT_GT(answer["improvement"]["interval95"][0], 0) << end.standard_output;
  // The printer's own lag is 0.03 s; a fifth of the surplus is 6 ms.
  constexpr double kLeft = 0.2;
  EXPECT_NEAR(answer["surplus_left"]["value"].get<double>(), 0, kLeft) << end.standard_output;
  EXPECT_TRUE(std::filesystem::exists(shop.folder() / "rec/validation.json"));
  EXPECT_THAT(shop.Faulty(before), IsEmpty());
}

// The scan's own settings do not matter.
TEST(Scan, IsOfTheLastPatternThatWasPrintedOnThatPrinter) {
  MachineShop shop;
  EXPECT_THAT(shop.Run({"pa", "scan", "--printer", shop.address()}),
              Fails(1, "cannot tell which pattern lies on the bed", "--plan FILE"));
  ASSERT_THAT(shop.Run({"pa", "print", "--printer", shop.address(), "--out", "printed", "--set",
                        "pressure_advances=[0.01, 0.02, 0.03, 0.04, 0.05]"}),
              Ends(0));
  const ProcessEnd scanned =
      shop.Run({"pa", "scan", "--printer", shop.address(), "--out", "scanned"});
  EXPECT_THAT(scanned.standard_error, testing::HasSubstr("printed): 5 lines, 0.01 to 0.05 s"));
  const auto scan = nlohmann::json::parse(ReadWhole(shop.folder() / "scanned/scan.json"));
  ASSERT_EQ(scan.at("lines").size(), 5U) << scanned.standard_error;
  std::filesystem::remove(shop.folder() / "printed/pattern.plan.json");
  EXPECT_THAT(shop.Run({"pa", "scan", "--printer", shop.address()}),
              Fails(1, "print the pattern anew, or name the plan"));
}

}  // namespace
}  // namespace trammel::test
