// trammel pa table, on recordings' answers and plans.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "measurement/outcome_file.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

using test::CommandResult;
using test::ReadWhole;
using test::RunTrammel;
using test::TemporaryFolder;
using test::WriteWhole;
using ::testing::HasSubstr;
using ::testing::Not;

class TableCommand : public testing::Test {
 protected:
  void Calibrated(const std::string& name, int speed_mm_s, int acceleration_mm_s2, double value_s,
                  const std::string& filament = "PLA", double layer_height_mm = 0.25) const {
    const auto recording = folder_.path() / name;
    std::filesystem::create_directory(recording);
    ASSERT_THAT(
        RunTrammel(
            fmt::format(
                "pa pattern --material pla --set "
                "'segments=[{{fraction=0.25,speed=5}},{{fraction=0.5,speed={}}},{{fraction=0."
                "25,speed=5}}]' --set acceleration={} --set layer_height={} --out "
                "{}/pattern.gcode",
                speed_mm_s, acceleration_mm_s2, layer_height_mm, name),
            folder_.path()),
        Ends(0));
    measurement::Outcome outcome;
    outcome.provenance = {
        measurement::Instrument::kPressureAdvance, "trammel", "2026-01-02T03:04:05Z", {name}};
    outcome.answers = {{"pressure_advance", "s",
                        Measured::Good({value_s, 0.0005, {value_s - 0.00098, value_s + 0.00098}})}};
    outcome.subject = {"printer.local", "0.40", filament};
    ASSERT_TRUE(files::KeepOutcome(recording, outcome));
  }
  [[nodiscard]] CommandResult Run(const std::string& words) const {
    return RunTrammel("pa table " + words, folder_.path());
  }

  TemporaryFolder folder_;
};

TEST_F(TableCommand, PutsCalibrationsBesideOneAnotherAndIntoASlicersProfile) {
  Calibrated("a", 50, 3000, 0.050);
  Calibrated("b", 150, 3000, 0.040);
  Calibrated("c", 150, 6000, 0.036);
  EXPECT_THAT(Run("a b c"),
              Says(0, "one value         0.04200 s", "misses a row's own by up to 0.0080 s",
                   "over acceleration -0.00400 s for each doubling"));
  WriteWhole(folder_.path() / "pla.json", R"({"filament_settings_id": ["mine"]})");
  EXPECT_THAT(Run("a b c --orca pla.json -o out.json"),
              Says(0, "2 rows of 3 (an acceleration with one flow is left out)"));
  const auto profile = nlohmann::json::parse(ReadWhole(folder_.path() / "out.json"));
  EXPECT_EQ(profile["adaptive_pressure_advance_model"][0], "0.0500,5.52,3000\n0.0400,16.55,3000");
  EXPECT_EQ(Run("a b c --orca pla.json -o out.json").exit_code, 1);  // it is there
  EXPECT_THAT(Run("b c --orca pla.json -o other.json"), Says(1, "two flows at least"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "other.json"));
}

// Given storage that grows as the square root of flow: K = c / (sqrt(fast) + sqrt(slow)).
TEST_F(TableCommand, SaysTheLawOfFlowAndWhatFirmwareWithSuchALawIsToBeTold) {
  Calibrated("a", 60, 3000, 0.05220);
  Calibrated("b", 100, 3000, 0.04257);
  Calibrated("c", 150, 3000, 0.03597);
  ASSERT_THAT(Run("a b c"),
              Says(0,
                   "law of flow       filament stored as flow to the power "
                   "of 0.50",
                   "\npressure_advance_model: ", "\nnonlinear_offset: 0.", "1.75 mm filament"));
  const auto table = nlohmann::json::parse(Run("a b c --json").output);
  EXPECT_TRUE(table["bends"]);
  EXPECT_NEAR(table["exponent"]["value"].get<double>(), 0.5, 0.01);
  const auto& law = table["firmware_law"];
  // Parameters of Kalico's extruder, in mm of another filament: thicker, so that it moves slower.
  EXPECT_GT(law["offset_mm3"].get<double>(), 0);
  const double area_mm2 = 2.85 * 2.85 * 0.7853982;
  EXPECT_THAT(Run("a b c --filament-diameter 2.85").output,
              Containing(fmt::format("\nnonlinear_offset: {:.4f}\n",
                                     law["offset_mm3"].get<double>() / area_mm2),
                         fmt::format("\nlinearization_velocity: {:.3f}\n",
                                     law["knee_mm3_s"].get<double>() / area_mm2)));
  EXPECT_EQ(Run("a b c --filament-diameter 0").exit_code, 1);
  const CommandResult two = Run("a c");
  EXPECT_THAT(
      two.output,
      Containing("to the power of 0.50", ": the faster, the less pressure advance\n",
                 "a third fast speed would tell", Not(HasSubstr("pressure_advance_model"))));
  EXPECT_THAT(Run("a").output, HasSubstr("law of flow       not known: it takes two flows"));
}

TEST_F(TableCommand, ShowsEachLayerHeightAndMixesNoneIntoASlicersProfile) {
  Calibrated("a", 50, 3000, 0.050);
  Calibrated("b", 150, 3000, 0.040);
  Calibrated("c", 50, 3000, 0.056, "PLA", 0.2);
  Calibrated("d", 150, 3000, 0.045, "PLA", 0.2);
  const CommandResult run = Run("a b c d");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(run.output, AllOf(HasSubstr(" 4.52 mm3/s    3000 mm/s2   0.2 mm   0.05600 s"),
                                HasSubstr(" 5.52 mm3/s    3000 mm/s2   0.25 mm  0.05000 s"),
                                HasSubstr("the layers are 0.2 and 0.25 mm high")));
  const auto json = nlohmann::json::parse(Run("a b c d --json").output);
  ASSERT_EQ(json["rows"].size(), 4u);
  EXPECT_EQ(json["rows"][0]["layer_height_mm"], 0.2);
  EXPECT_EQ(json["rows"][3]["layer_height_mm"], 0.25);
  EXPECT_FALSE(json["law_layer_height_mm"].is_null());
  WriteWhole(folder_.path() / "pla.json", R"({"filament_settings_id": ["mine"]})");
  const CommandResult mixed = Run("a b c d --orca pla.json -o out.json");
  EXPECT_EQ(mixed.exit_code, 1);
  EXPECT_THAT(mixed.output, AllOf(HasSubstr("layers of 0.2 and 0.25 mm"),
                                  HasSubstr("choose one by --layer-height")));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out.json"));
  const CommandResult one = Run("a b c d --layer-height 0.2 --orca pla.json -o out.json");
  ASSERT_EQ(one.exit_code, 0) << one.output;
  EXPECT_THAT(one.output, AllOf(HasSubstr("for layers of 0.2 mm"), Not(HasSubstr("0.25 mm"))));
  const auto profile = nlohmann::json::parse(ReadWhole(folder_.path() / "out.json"));
  EXPECT_EQ(profile["adaptive_pressure_advance_model"][0], "0.0560,4.52,3000\n0.0450,13.56,3000");
  const CommandResult none = Run("a b c d --layer-height 0.3");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.output,
              HasSubstr("--layer-height 0.3: the calibrations are of layers of 0.2 and"));
}

TEST_F(TableCommand, RefusesWhatDoesNotBelongTogether) {
  Calibrated("a", 50, 3000, 0.050);
  Calibrated("b", 150, 3000, 0.040, "PETG");
  EXPECT_THAT(Run("a b"), Says(1, "a table is of one filament"));
  std::filesystem::remove(folder_.path() / "b" / "pattern.plan.json");
  EXPECT_THAT(Run("b").output, HasSubstr("pattern.plan.json: there is no such file"));
  EXPECT_THAT(Run("a --orca pla.json").output, HasSubstr("go together"));
  EXPECT_THAT(Run("a ./a/"), Says(1, "is the same calibration as a"));
  Calibrated("unnamed", 100, 3000, 0.045, "");  // says nothing, and does not hide the others' names
  Calibrated("c", 150, 3000, 0.040, "PETG");
  EXPECT_THAT(Run("unnamed a c").output, HasSubstr("a table is of one filament"));
}

}  // namespace
}  // namespace trammel
