#include "tool_offset/commands/offset_job.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "session/fake_printer.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

using service::Arguments;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

service::PrinterPlace PlaceWithPla() {
  service::PrinterPlace place;
  place.material = "pla";
  return place;
}

TEST(OffsetJob, HandsOnTheToolsAndTheTemperatureOfThisRun) {
  const auto offer =
      Must(OffsetSheetJob().check(PlaceWithPla(), {{"tools", "0,2"}, {"temp", "210"}}, nullptr));
  EXPECT_THAT(offer.question, HasSubstr("COLD bed"));
  // The dialog after the print measures: it has no use for tools or temperature.
  EXPECT_TRUE(offer.start.empty());
}

/// A printer with two extruders, as the settings of its configuration have them.
nlohmann::json TwoExtruders() {
  const auto empty = nlohmann::json::object();
  return {{"configfile", {{"settings", {{"extruder", empty}, {"extruder1", empty}}}}}};
}

TEST(OffsetJob, ToolsAndTemperaturesThatMakeNoSenseAreRefused) {
  for (const char* tools : {"a", "0,", ",1", "0 1", "0,1;M112", "0.1"}) {
    EXPECT_FALSE(OffsetSheetJob().check(PlaceWithPla(), {{"tools", tools}}, nullptr)) << tools;
  }
  for (const char* temp : {"1e3", "nan", "-5", "240 M112"}) {
    EXPECT_FALSE(OffsetSheetJob().check(PlaceWithPla(), {{"temp", temp}}, nullptr)) << temp;
  }
  EXPECT_FALSE(OffsetSheetJob().check({}, {}, nullptr));  // nothing says what is loaded
  procedure::testing::FakePrinter printer;
  printer.told = TwoExtruders();
  for (const auto& [name, value] : {std::pair{"tools", "0"},
                                    {"tools", "0,0"},
                                    {"tools", "0,40"},
                                    {"tools", "-1,0"},
                                    {"tools", "0,1,2,3,4,5,6,7,8"},
                                    {"temp", "90"},
                                    {"temp", "900"}}) {
    Arguments arguments{{"tools", "0,1"}};
    arguments[name] = value;
    EXPECT_FALSE(OffsetSheetJob().check(PlaceWithPla(), arguments, &printer)) << name << value;
  }
}

TEST(OffsetJob, NothingIsSaidOfPaperWhereThePrinterHasOneTool) {
  procedure::testing::FakePrinter printer;
  printer.told = {{"configfile", {{"settings", {{"extruder", nlohmann::json::object()}}}}}};
  EXPECT_THAT(OffsetSheetJob().check(PlaceWithPla(), {}, &printer), FailsWith("one tool, T0"));
}

TEST(OffsetJob, SaysWhereThePaperIsToLie) {
  procedure::testing::FakePrinter printer;
  printer.told = TwoExtruders();
  const auto offer = Must(OffsetSheetJob().check(PlaceWithPla(), {{"tools", "0,1"}}, &printer));
  constexpr std::size_t kMax = 240;  // limit of a dialog
  EXPECT_THAT(offer.question,
              Containing("A5 paper (148 mm along X, 210 along Y)", "T0, T1 ready", "nozzle "));
  EXPECT_LE(offer.question.size(), kMax);
}

constexpr const char* kStart = R"({"format": 1, "stage": "analysed", "printer": "voron",
  "run": "r", "started": "s", "printed_s": 1700000000, "tools": [{"tool": 0, "x_mm": 0, "y_mm": 0},
  {"tool": 1%s}, {"tool": 2, "x_mm": 0, "y_mm": 0}]})";

std::string Value(const char* name, const char* verdict, double value) {
  const std::string numbers =
      std::string(verdict) == "good"
          ? fmt::format(R"("value": {}, "standard_uncertainty": 0.001, "interval95": [{}, {}])",
                        value, value - 0.002, value + 0.002)
          : R"("value": null, "standard_uncertainty": null, "interval95": null)";
  return fmt::format(R"({{"name": "{}", "unit": "mm", "verdict": "{}", "reason": "{}", {}}})", name,
                     verdict, std::string(verdict) == "good" ? "" : "it did not print", numbers);
}

void WriteAnswer(const test::TemporaryFolder& folder, const char* kept) {
  test::WriteWhole(folder.path() / "start.json",
                   std::string(kStart).replace(std::string(kStart).find("%s"), 2, kept));
  test::WriteWhole(
      folder.path() / "result.json",
      fmt::format(R"({{"format": 1, "instrument": "tool_offset", "program": "trammel 9",
    "utc": "2026", "sources": [], "verdict": "refused", "reason": "it did not print",
    "notices": [], "answers": [{}, {}, {}, {}]}})",
                  Value("tool_1_dx", "good", 0.1), Value("tool_1_dy", "good", -0.05),
                  Value("tool_2_dx", "refused", 0), Value("tool_2_dy", "refused", 0)));
}

TEST(OffsetJob, SaysEachToolInALineAndAllInOne) {
  const test::TemporaryFolder folder;
  WriteAnswer(folder, R"(, "x_mm": 0.25, "y_mm": -0.5)");
  const auto answer = Must(OffsetScanJob().answer(folder.path().string()));
  EXPECT_EQ(answer.verdict, Verdict::kGood);
  EXPECT_THAT(answer.lines,
              ElementsAre("tool_offset T1 x = +0.1000 mm (95 %: +0.0980 to +0.1020 mm), y = "
                          "-0.0500 mm (95 %: -0.0520 to -0.0480 mm)",
                          "tool_offset tool 2: refused: it did not print"));
  EXPECT_EQ(answer.words,
            "tool offsets T1 x +0.100, y -0.050 mm (95 %: within 0.0020 mm); 1 without a value");
  EXPECT_EQ(answer.why_not_set, "");
}

TEST(OffsetJob, OfferNothingToSetWhereKlipperKeepsNoOffset) {
  const test::TemporaryFolder folder;
  WriteAnswer(folder, "");
  const auto answer = Must(OffsetScanJob().answer(folder.path().string()));
  EXPECT_THAT(answer.why_not_set, HasSubstr("klipper-gcode-offset"));
  EXPECT_FALSE(OffsetScanJob().answer(folder.path().string() + "/nowhere"));
  EXPECT_THAT(OffsetScanJob().apply("rec", {}), SizeIs(5));
}

}  // namespace
}  // namespace trammel::app
