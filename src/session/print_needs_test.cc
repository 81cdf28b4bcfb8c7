#include "session/print_needs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "machine/moonraker/client/status.h"
#include "session/fake_printer.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using machine::PrinterFacts;
using settings::FilamentSettings;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A usual printer.
PrinterFacts Usual() {
  PrinterFacts facts;
  facts.kinematics = "corexy";
  facts.reach = {{0, 0, 0}, {250, 250, 250}};
  facts.max_velocity_mm_s = facts.configured_max_velocity_mm_s = 300;
  facts.max_accel_mm_s2 = facts.configured_max_accel_mm_s2 = 5000;
  facts.extruder = "extruder";
  facts.configured = true;
  facts.nozzle_diameter_mm = 0.4;
  facts.filament_diameter_mm = 1.75;
  facts.min_extrude_temp_c = 180;
  facts.nozzle_max_c = 260;
  facts.bed_max_c = 90;
  facts.advance_motors = {"extruder"};
  return facts;
}

/// A usual pattern.
PrintNeeds Pattern() {
  PrintNeeds needs;
  needs.motions = {{150, 3000}};
  needs.filament_diameter_mm = 1.75;
  needs.nozzle_diameter_mm = 0.4;
  needs.bead_mm2 = 0.11;
  needs.pushed_alone_mm = 0.5;
  needs.rectangular_bed = true;
  needs.sets_pressure_advance = true;
  return needs;
}

/// Returns why it is refused; empty if it is not. Every refusal is for safety.
std::string Refusal(const PrinterFacts& facts, const PrintNeeds& needs) {
  const auto failed = FirstFailure(CompareFacts(facts, needs), ErrorKind::kMachine);
  if (failed) return "";
  EXPECT_EQ(failed.error().kind, ErrorKind::kSafety) << failed.error().message;
  return failed.error().message;
}

/// What a printer or a pattern has of its own, and the words of the refusal; none: it is printed.
struct Row {
  void (*given)(PrinterFacts& facts, PrintNeeds& needs);
  std::vector<std::string> words;
};

void ExpectRefusals(const std::vector<Row>& rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE(i);
    PrinterFacts facts = Usual();
    PrintNeeds needs = Pattern();
    rows[i].given(facts, needs);
    const std::string refusal = Refusal(facts, needs);
    if (rows[i].words.empty()) EXPECT_EQ(refusal, "");
    for (const std::string& word : rows[i].words) EXPECT_THAT(refusal, HasSubstr(word));
  }
}

TEST(PrintNeeds, WithoutWhatEveryKlipperStatesNothingIsPrinted) {
  ExpectRefusals({
      {[](auto&, auto&) {}, {}},
      {[](auto& facts, auto&) { facts = {}; }, {"states no [] of its configuration"}},
      {[](auto& facts, auto&) { facts.kinematics.clear(); }, {"no kinematics of [printer]"}},
      {[](auto& facts, auto&) { facts.one_of_several = true; },
       {"does not state which one is active"}},
      {[](auto& facts, auto&) { facts.unreadable = "filament_diameter"; },
       {"no filament_diameter of [extruder]"}},
      {[](auto& facts, auto&) { facts.max_velocity_mm_s = facts.configured_max_velocity_mm_s = 0; },
       {"no max_velocity of [printer]"}},
  });
}

TEST(PrintNeeds, SpeedAndAccelerationStayWithinWhatTheOwnerAllows) {
  ExpectRefusals({
      {[](auto& facts, auto&) { facts.max_velocity_mm_s = facts.max_accel_mm_s2 = 0; }, {}},
      {[](auto& facts, auto&) {
         facts.max_velocity_mm_s = 0;  // not stated in force: the configuration's counts
         facts.configured_max_velocity_mm_s = 60;
       },
       {"max_velocity is 60 mm/s", "raise max_velocity of [printer]"}},
      {[](auto& facts, auto&) { facts.max_velocity_mm_s = 60; },
       {"max_velocity is 60 mm/s", "prints at 150 mm/s", "SET_VELOCITY_LIMIT VELOCITY=300"}},
      {[](auto& facts, auto&) { facts.max_velocity_mm_s = 150; }, {}},
      {[](auto& facts, auto&) { facts.max_accel_mm_s2 = facts.configured_max_accel_mm_s2 = 500; },
       {"max_accel is 500 mm/s2", "prints at 3000 mm/s2",
        "500 mm/s2 go with 61 mm/s instead of 150"}},
      {[](auto& facts, auto& needs) {
         facts.max_accel_mm_s2 = facts.configured_max_accel_mm_s2 = 500;
         needs.motions = {{100, 400}, {100, 501}};
       },
       {"prints at 501 mm/s2"}},
      {[](auto& facts, auto& needs) {
         needs.printed_before = true;
         facts.max_velocity_mm_s = 60;  // since
       },
       {}},
      {[](auto& facts, auto& needs) {
         needs.printed_before = true;
         facts.max_velocity_mm_s = 60;
         facts.configured_max_velocity_mm_s = 100;
       },
       {"max_velocity is 100 mm/s", "is planned at 150"}},
  });
}

TEST(PrintNeeds, AnotherFilamentOrNozzleIsRefusedByBothValues) {
  ExpectRefusals({
      {[](auto& facts, auto&) { facts.filament_diameter_mm = 2.85; },
       {"2.85 mm", "1.75 mm", "2.65 times", "filament_diameter = 2.85"}},
      {[](auto& facts, auto&) { facts.filament_diameter_mm = 1.72; }, {}},
      {[](auto& facts, auto&) { facts.filament_diameter_mm = 1.8; }, {}},
      {[](auto& facts, auto&) { facts.filament_diameter_mm = 1.82; }, {"1.08 times"}},
      {[](auto& facts, auto&) { facts.nozzle_diameter_mm = 0.6; },
       {"0.6 mm", "nozzle_diameter = 0.6"}},
  });
}

TEST(PrintNeeds, WhatKlipperWouldRefuseInTheMiddleOfThePrintIsRefusedBefore) {
  ExpectRefusals({
      {[](auto& facts, auto&) { facts.max_extrude_cross_section_mm2 = 0.1; },
       {"max_extrude_cross_section"}},
      {[](auto& facts, auto&) {
         facts.filament_diameter_mm = 1.79;  // Klipper takes a bead's area by its own filament
         facts.max_extrude_cross_section_mm2 = 0.113;  // above 0.11, below 0.11 (1.79 / 1.75)^2
       },
       {"a bead has 0.115 mm2"}},
      {[](auto& facts, auto&) { facts.max_extrude_only_distance_mm = 0.4; },
       {"max_extrude_only_distance"}},
      {[](auto& facts, auto& needs) {
         needs.pushed_alone_mm_s = 30;
         facts.max_extrude_only_velocity_mm_s = 5;
       },
       {}},
      {[](auto& facts, auto& needs) {
         needs.pushed_alone_mm_s = 30;
         facts.max_extrude_only_velocity_mm_s = 0.4;
       },
       {"1.2 s in place of 0.02 s", "max_extrude_only_velocity"}},
      {[](auto& facts, auto& needs) {
         needs.pushed_alone_mm_s = 30;
         facts.max_extrude_only_velocity_mm_s = 30;
         facts.max_extrude_only_accel_mm_s2 = 1;  // twice the root of 0.5 mm over it
       },
       {"1.4 s in place"}},
      {[](auto& facts, auto&) { facts.instantaneous_corner_velocity_mm_s = 0; },
       {"instantaneous_corner_velocity of [extruder]"}},
      {[](auto& facts, auto&) { facts.instantaneous_corner_velocity_mm_s = 0.1; }, {}},
  });
}

TEST(PrintNeeds, WithoutOneLinearPressureAdvanceOnEveryMotorNothingIsBegun) {
  ExpectRefusals({
      {[](auto& facts, auto&) { facts.pressure_advance_model = "recipr"; },
       {"pressure_advance_model of [extruder] in printer.cfg is recipr"}},
      {[](auto& facts, auto&) {
         facts.no_pressure_advance = true;
         facts.advance_motors.clear();
       },
       {"has no stepper of its own"}},
      {[](auto& facts, auto& needs) {
         facts.no_pressure_advance = true;
         needs.sets_pressure_advance = false;
       },
       {}},
      {[](auto& facts, auto&) {
         facts.advance_motors = {"extruder", "extruder_stepper belted"};
       },
       {"extruder and extruder_stepper belted push"}},
      {[](auto& facts, auto& needs) {
         facts.advance_motors = {"extruder", "extruder_stepper belted"};
         needs.advance_motors = {"extruder", "belted"};
       },
       {}},
      {[](auto&, auto& needs) {
         needs.advance_motors = {"extruder", "belted"};
       },
       {"extruder pushes"}},
      {[](auto& facts, auto&) {
         facts.advance_motors.clear();
         facts.pushes_for = "extruder1";
       },
       {"synchronised with extruder1",
        "SYNC_EXTRUDER_MOTION EXTRUDER=extruder MOTION_QUEUE=extruder"}},
      {[](auto& facts, auto&) {
         facts.smooth_times_s = {{"extruder", 0.06}};
       },
       {}},
      {[](auto& facts, auto& needs) {
         facts.advance_motors = {"extruder", "extruder_stepper belted"};
         needs.advance_motors = {"extruder", "belted"};
         facts.smooth_times_s = {{"extruder", 0.06}, {"extruder_stepper belted", 0.1}};
       },
       {"smooth_time of [extruder_stepper belted] is 0.1 s", "EXTRUDER=belted SMOOTH_TIME=0.04"}},
  });
}

TEST(PrintNeeds, ARoundReachWantsARoundBed) {
  ExpectRefusals({
      {[](auto& facts, auto&) { facts.kinematics = "delta"; },
       {"delta", "bed_shape = \"ellipse\""}},
      {[](auto& facts, auto&) { facts.kinematics = "polar"; },
       {"polar", "bed_shape = \"ellipse\""}},
      {[](auto& facts, auto& needs) {
         facts.kinematics = "delta";
         needs.rectangular_bed = false;
       },
       {}},
  });
}

FilamentSettings Heated(double nozzle_c, double bed_c) {
  FilamentSettings filament;
  filament.nozzle_temperature_c = nozzle_c;
  filament.bed_temperature_c = bed_c;
  return filament;
}

TEST(CompareTemperatures, ANozzleTooColdToExtrudeIsRefusedBeforeItIsHeated) {
  const Check cold = CompareTemperatures(Usual(), Heated(175, 60));
  EXPECT_TRUE(cold.unsafe);
  EXPECT_FALSE(cold.advice);
  EXPECT_THAT(cold.detail,
              Containing("nozzle_temperature = 175", "below", "min_extrude_temp = 180"));
  EXPECT_TRUE(CompareTemperatures(Usual(), Heated(180, 60)).passed);
}

TEST(CompareTemperatures, NozzleAndBedAboveWhatThePrinterMayHaveAreRefused) {
  EXPECT_THAT(CompareTemperatures(Usual(), Heated(275, 60)).detail,
              Containing("nozzle_temperature = 275", "above", "max_temp of the extruder = 260"));
  const Check bed = CompareTemperatures(Usual(), Heated(255, 110));
  EXPECT_TRUE(bed.unsafe);
  EXPECT_THAT(bed.detail, Containing("bed_temperature = 110", "max_temp of the bed = 90"));
  EXPECT_TRUE(CompareTemperatures(Usual(), Heated(260, 90)).passed);
  EXPECT_TRUE(CompareTemperatures(Usual(), Heated(260, 0)).passed);
  EXPECT_TRUE(CompareTemperatures({}, Heated(255, 110)).passed);  // nothing is stated
}

TEST(CompareTemperatures, ABedWithoutAHeaterIsNotHeated) {
  PrinterFacts facts = Usual();
  facts.no_bed_heater = true;
  EXPECT_THAT(CompareTemperatures(facts, Heated(215, 60)).detail,
              Containing("no [heater_bed]", "set bed_temperature = 0"));
  EXPECT_TRUE(CompareTemperatures(facts, Heated(215, 0)).passed);
}

TEST(PrinterFacts, AreReadFromAnExtrudersSection) {
  const nlohmann::json section = {
      {"nozzle_diameter", 0.4},         {"filament_diameter", "1.75"},
      {"max_extrude_only_distance", 0}, {"max_extrude_only_velocity", 12},
      {"max_extrude_only_accel", -1},   {"instantaneous_corner_velocity", 0}};
  const nlohmann::json told = {
      {"configfile",
       {{"settings",
         {{"extruder", section},
          {"printer", {{"kinematics", "polar"}, {"max_angular_velocity", 30}}}}}}}};
  machine::PrinterState state;
  state.active_extruder = "extruder";
  state.pressure_advance["extruder"] = {0.03, 0.12, "extruder1"};
  state.pressure_advance["extruder1"] = {0.03, 0.02, "extruder"};
  const PrinterFacts facts = machine::FactsOf(told, state);
  EXPECT_TRUE(facts.configured);
  EXPECT_EQ(facts.unreadable, "filament_diameter");
  EXPECT_EQ(facts.max_extrude_only_distance_mm, 0);
  EXPECT_EQ(facts.max_extrude_only_velocity_mm_s, 12);
  EXPECT_FALSE(facts.max_extrude_only_accel_mm_s2);
  EXPECT_EQ(facts.instantaneous_corner_velocity_mm_s, 0);
  EXPECT_EQ(facts.max_angular_velocity_rad_s, 30);
  EXPECT_TRUE(facts.no_bed_heater);
  EXPECT_EQ(facts.pushes_for, "extruder1");
  EXPECT_THAT(facts.smooth_times_s,
              ElementsAre(std::pair<const std::string, double>("extruder1", 0.02)));
  EXPECT_FALSE(facts.one_of_several);
  nlohmann::json two = told;
  two["configfile"]["settings"]["extruder1"] = section;
  EXPECT_TRUE(machine::FactsOf(two, {}).one_of_several);
}

TEST(PrinterFacts, TheReachIsThatOfGcodeWithItsOffset) {
  machine::PrinterState state;
  state.active_extruder = "extruder";
  state.axis_minimum_mm = {0, 0, -2};
  state.axis_maximum_mm = {250, 250, 240};
  state.gcode.homing_origin_mm = {20, -10, 0.5, 0};
  const PrinterFacts facts = machine::FactsOf({}, state);
  EXPECT_THAT(facts.reach.minimum_mm, ElementsAre(-20, 10, -2.5));
  EXPECT_THAT(facts.reach.maximum_mm, ElementsAre(230, 260, 239.5));
  EXPECT_THAT(facts.reach.Describe(), HasSubstr("with the G-code offset 20, -10, 0.5 mm"));
  // The offset is the active tool's.
  EXPECT_THAT(machine::FactsOf({}, state, "extruder1").reach.minimum_mm, ElementsAre(0, 0, -2));
}

TEST(PrinterFacts, OfAKinematicsThatNobodyKnowsACircleIsReached) {
  for (const auto& [kinematics, round] : {std::pair{"corexy", false},
                                          {"generic_cartesian", false},
                                          {"hybrid_corexz", false},
                                          {"deltesian", false},
                                          {"delta", true},
                                          {"polar", true},
                                          {"morgan_scara", true},
                                          {"", false}}) {
    nlohmann::json told = {{"configfile", {{"settings", nlohmann::json::object()}}}};
    if (*kinematics != 0) told["configfile"]["settings"]["printer"]["kinematics"] = kinematics;
    EXPECT_EQ(machine::FactsOf(told, {}).reach.round, round) << kinematics;
  }
}

/// Reads the facts of a printer in the shared folder; nothing if there is none.
std::optional<PrinterFacts> Shared(const std::string& file) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  if (data == nullptr) return std::nullopt;
  std::ifstream stream(std::filesystem::path(data) / "field" / file);
  const auto objects = nlohmann::json::parse(stream).at("objects");
  return machine::FactsOf(objects, machine::ReadStatus(objects));
}

TEST(PrinterFacts, OfReportedPrintersAreRefusedByTheTrueCause) {
  struct Case {
    const char* file;
    const char* cause;
  };
  for (const Case& c : {Case{"02/moonraker.json", "extruder and extruder_stepper belted"},
                        Case{"03/moonraker.json",
                             "pressure_advance_model of [extruder] in "
                             "printer.cfg is tanh"},
                        Case{"03/moonraker_stepperless.json", "no stepper of its own"},
                        Case{"08/moonraker.json", "filament_diameter of [extruder]"},
                        Case{"12/moonraker.json", "extruder and extruder1 push"},
                        Case{"14/moonraker.json", "kinematics is delta"}}) {
    const auto facts = Shared(c.file);
    if (!facts) GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with field/";
    const std::string refusal = Refusal(*facts, Pattern());
    EXPECT_THAT(refusal, HasSubstr(c.cause)) << c.file;
  }
  const auto idex = Shared("12/moonraker.json");
  ASSERT_EQ(idex->dual_carriages.size(), 1U);
  EXPECT_EQ(idex->dual_carriages.front().name, "carriage_u");
  EXPECT_EQ(idex->dual_carriages.front().primary, "x");
  EXPECT_THAT(Shared("02/moonraker.json")->advance_names(), ElementsAre("extruder", "belted"));
  EXPECT_THAT(Shared("08/moonraker.json")->advance_names(), IsEmpty());
}

}  // namespace
}  // namespace trammel::procedure
