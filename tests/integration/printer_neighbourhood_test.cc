// What trammel prints on the printers that people have, and on those at the ends of what its
// settings assume. Klipper's own rules decide (klipper_model.h): a print is refused by the name of
// the fact that does not fit, or it is right.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "app/stated_settings.h"
#include "klipper_model.h"
#include "machine/moonraker/client/status.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "session/fake_printer.h"

namespace trammel::test {
namespace {

using files::Config;
using nlohmann::json;

ModelPrinter Usual(const std::string& name, const std::string& kinematics, double size_mm) {
  ModelPrinter printer;
  printer.name = name;
  printer.kinematics = kinematics;
  printer.maximum_mm = {size_mm, size_mm, size_mm};
  return printer;
}

json SettingsOf(const ModelPrinter& printer) {
  json settings = {{"printer",
                    {{"kinematics", printer.kinematics},
                     {"max_velocity", printer.configured_max_velocity_mm_s},
                     {"max_accel", printer.configured_max_accel_mm_s2},
                     {"max_z_velocity", printer.max_z_velocity_mm_s},
                     {"square_corner_velocity", printer.square_corner_velocity_mm_s}}}};
  if (printer.max_angular_velocity_rad_s) {
    settings["printer"]["max_angular_velocity"] = *printer.max_angular_velocity_rad_s;
  }
  for (const auto& [name, extruder] : printer.extruders) {
    json section = {{"nozzle_diameter", extruder.nozzle_diameter_mm},
                    {"filament_diameter", extruder.filament_diameter_mm},
                    {"min_temp", extruder.min_temp_c},
                    {"max_temp", extruder.max_temp_c},
                    {"min_extrude_temp", extruder.min_extrude_temp_c},
                    {"max_extrude_only_distance", extruder.max_extrude_only_distance_mm},
                    {"instantaneous_corner_velocity", extruder.instantaneous_corner_velocity_mm_s}};
    const double usual_mm2 = 4 * extruder.nozzle_diameter_mm * extruder.nozzle_diameter_mm;
    section["max_extrude_cross_section"] =
        extruder.max_extrude_cross_section_mm2.value_or(usual_mm2);
    const double ratio = usual_mm2 / (std::numbers::pi / 4 * extruder.filament_diameter_mm *
                                      extruder.filament_diameter_mm);
    section["max_extrude_only_velocity"] = extruder.max_extrude_only_velocity_mm_s.value_or(
        printer.configured_max_velocity_mm_s * ratio);
    section["max_extrude_only_accel"] =
        extruder.max_extrude_only_accel_mm_s2.value_or(printer.configured_max_accel_mm_s2 * ratio);
    if (!extruder.pressure_advance_model.empty()) {
      section["pressure_advance_model"] = extruder.pressure_advance_model;
    }
    settings[name] = section;
  }
  if (printer.bed_max_temp_c) settings["heater_bed"] = {{"max_temp", *printer.bed_max_temp_c}};
  for (const std::string& section : printer.other_sections) settings[section] = json::object();
  return settings;
}

std::vector<ModelPrinter> UsualPrinters() {
  ModelPrinter corexy = Usual("corexy 250", "corexy", 250);
  ModelPrinter large = Usual("corexy 350, negative ends", "corexy", 355);
  large.minimum_mm = {-3, -8, -2};
  ModelPrinter slinger = Usual("bed slinger 235", "cartesian", 235);
  slinger.minimum_mm = {-5, -5, -2};
  slinger.max_accel_mm_s2 = slinger.configured_max_accel_mm_s2 = 3000;
  slinger.before_2024 = true;
  ModelPrinter small = Usual("small 120, unheated bed", "cartesian", 120);
  small.bed_max_temp_c.reset();
  ModelPrinter delta = Usual("delta 240", "delta", 120);
  delta.minimum_mm = {-120, -120, -5};
  ModelPrinter centred = Usual("corexy, origin in the middle", "corexy", 175);
  centred.minimum_mm = {-175, -175, -5};
  ModelPrinter idex = Usual("two carriages", "hybrid_corexy", 300);
  idex.minimum_mm = {-60, 0, -3};
  idex.extruders["extruder1"] = {};
  idex.motors["extruder1"] = {"extruder1"};
  idex.other_sections = {"dual_carriage"};
  ModelPrinter changer = Usual("tool changer", "generic_cartesian", 320);
  changer.extruders["extruder1"] = {};
  changer.extruders["extruder1"].nozzle_diameter_mm = 0.6;
  changer.motors["extruder1"] = {"extruder1"};
  ModelPrinter polar = Usual("polar", "polar", 150);
  polar.minimum_mm = {-150, -150, 0};
  ModelPrinter thick = Usual("2.85 mm, 0.8 mm nozzle", "cartesian", 400);
  thick.extruders["extruder"].filament_diameter_mm = 2.85;
  thick.extruders["extruder"].nozzle_diameter_mm = 0.8;
  return {corexy, large, slinger, small, delta, centred, idex, changer, polar, thick};
}

json ToldBy(const ModelPrinter& printer) {
  json told = {
      {"webhooks", {{"state", "ready"}}},
      {"print_stats", {{"state", "standby"}}},
      {"idle_timeout", {{"state", "Idle"}}},
      {"configfile", {{"settings", SettingsOf(printer)}}},
      {"toolhead",
       {{"axis_minimum", printer.minimum_mm},
        {"axis_maximum", printer.maximum_mm},
        {"max_velocity", printer.max_velocity_mm_s},
        {"max_accel", printer.max_accel_mm_s2},
        {"square_corner_velocity", printer.square_corner_velocity_mm_s},
        {"extruder", printer.active},
        {"homed_axes", "xyz"}}},
      {"gcode_move",
       {{"speed_factor", printer.speed_factor},
        {"extrude_factor", printer.extrude_factor},
        {"absolute_coordinates", printer.absolute_coordinates},
        {"absolute_extrude", printer.absolute_extrude},
        {"homing_origin", {printer.origin_mm[0], printer.origin_mm[1], printer.origin_mm[2], 0}}}}};
  if (printer.before_2024) {
    told["toolhead"]["max_accel_to_decel"] =
        printer.max_accel_mm_s2 * (1 - printer.minimum_cruise_ratio);
  } else {
    told["toolhead"]["minimum_cruise_ratio"] = printer.minimum_cruise_ratio;
  }
  for (const auto& [name, extruder] : printer.extruders) {
    told[name] = {{"temperature", 25}, {"target", 0}, {"can_extrude", false}};
  }
  if (printer.bed_max_temp_c) told["heater_bed"] = {{"temperature", 25}, {"target", 0}};
  for (const auto& [section, motor] : printer.motors) {
    told[section]["pressure_advance"] = motor.pressure_advance_s;
    told[section]["smooth_time"] = motor.smooth_time_s;
    const bool never = section == motor.queue && !motor.synchronised;
    told[section]["motion_queue"] = never || motor.queue.empty() ? json() : json(motor.queue);
  }
  return told;
}

/// What `pa print --photo` does before anything moves.
struct Asked {
  std::string refusal;  ///< empty: it prints
  Config config;
};

Asked AskForPrint(const json& told, const std::string& setting = {}) {
  Asked asked;
  asked.config = files::DefaultConfig();
  EXPECT_TRUE(files::OverrideConfig("material=pla", asked.config));
  if (!setting.empty()) EXPECT_TRUE(files::OverrideConfig(setting, asked.config)) << setting;
  procedure::testing::FakePrinter printer;
  printer.state = machine::ReadStatus(told, &asked.refusal);
  if (!asked.refusal.empty()) return asked;
  printer.told = told;
  const procedure::Session session{printer, {}, {}};
  if (const auto fitted = app::FitPattern(session, asked.config); !fitted) {
    asked.refusal = fitted.error().message;
    return asked;
  }
  const auto checked =
      FirstFailure(CheckForPrint(session, {asked.config.pattern}), ErrorKind::kMachine);
  if (!checked) asked.refusal = checked.error().message;
  return asked;
}

/// The speed that a line is planned at, at a place: as fast as its segments, its ends and its
/// acceleration allow.
double PlannedSpeed_mm_s(const pressure_advance::PatternConfig& config, double at_mm) {
  const double length_mm = config.line_length_mm;
  const double twice = 2 * config.acceleration_mm_s2;
  double speed2 = std::min(twice * at_mm, twice * (length_mm - at_mm));
  double from_mm = 0;
  for (const auto& segment : config.segments) {
    const double to_mm = from_mm + segment.fraction * length_mm;
    const double away_mm = std::max({0.0, from_mm - at_mm, at_mm - to_mm});
    speed2 = std::min(speed2, segment.speed_mm_s * segment.speed_mm_s + twice * away_mm);
    from_mm = to_mm;
  }
  return std::sqrt(std::max(0.0, speed2));
}

/// A caliper's value that a user sets holds where filament of the printer's diameter may have it.
double TrueFilament_mm(const ModelExtruder& extruder, const Config& config) {
  constexpr double kTolerance_mm = 0.05;  // of filament, as it is sold
  const double set_mm = config.pattern.filament_diameter_mm;
  const bool measured = config.IsSet("filament.filament_diameter") &&
                        std::abs(set_mm - extruder.filament_diameter_mm) <= kTolerance_mm + 1e-9;
  return measured ? set_mm : extruder.filament_diameter_mm;
}

std::string FindWrongSpeed(const ModelLine& line, const pressure_advance::PatternConfig& config) {
  constexpr double kShare = 2e-4;         // of the square of a speed: limits have four digits
  constexpr double kRounding_mm = 0.002;  // of the place: a file has three digits
  if (std::abs(line.Length_mm() - config.line_length_mm) > 0.01) {
    return fmt::format("a line of {:.3f} mm", line.Length_mm());
  }
  for (int i = 1; i < 100; ++i) {
    const double at_mm = config.line_length_mm * i / 100;
    const double is = line.SpeedAt_mm_s(at_mm), planned = PlannedSpeed_mm_s(config, at_mm);
    if (std::abs(is * is - planned * planned) >
        kShare * planned * planned + 2 * config.acceleration_mm_s2 * kRounding_mm) {
      return fmt::format("{:.1f} mm/s instead of {:.1f} at {:.1f} mm", is, planned, at_mm);
    }
  }
  return "";
}

std::string FindWrongFilament(const ModelLine& line, const ModelExtruder& extruder,
                              const Config& config) {
  const auto& pattern = config.pattern;
  const double filament_mm = TrueFilament_mm(extruder, config);
  const double laid_mm3 = line.filament_mm * std::numbers::pi / 4 * filament_mm * filament_mm;
  // A bead is a rectangle with round sides.
  const double height_mm = pattern.layer_height_mm;
  const double bead_mm2 = (pattern.line_width_mm - height_mm) * height_mm +
                          std::numbers::pi / 4 * height_mm * height_mm;
  const double share = laid_mm3 / (bead_mm2 * pattern.line_length_mm);
  return std::abs(share - 1) > 0.02 ? fmt::format("{:.3f} times the filament", share) : "";
}

std::string FindWrongAdvance(const ModelLine& line, const ModelPrinter& printer, double planned_s) {
  int pushing = 0;
  for (const auto& [section, motor] : printer.motors) {
    if (motor.queue != printer.active) continue;
    ++pushing;
    if (std::abs(line.pressure_advance_s.at(section) - planned_s) > 1e-6) {
      return fmt::format("{} has a pressure advance of {} instead of {}", section,
                         line.pressure_advance_s.at(section), planned_s);
    }
    constexpr double kLongest_s = 0.06;  // longer ones make answers too high
    if (motor.smooth_time_s > kLongest_s + 1e-9) {
      return fmt::format("{} smooths over {:.3f} s", section, motor.smooth_time_s);
    }
  }
  return pushing > 0 ? "" : "no motor pushes the filament";
}

/// What is wrong with a print of these settings; empty: nothing.
std::string FindWrong(const ModelPrinter& printer, const Config& config) {
  const auto& pattern = config.pattern;
  const ModelExtruder& extruder = printer.extruders.at(printer.active);
  const auto layout = LayOut(pattern);
  const ModelPrint print = PrintOn(printer, WriteGcode(layout, pattern));
  if (!print.refusal.empty()) return "Klipper: " + print.refusal;
  for (int i = 0; i < PatternCount(pattern); ++i) {
    if (SettingsOf(pattern, i).acceleration_mm_s2 > 1.000001 * printer.max_accel_mm_s2) {
      return "accelerates faster than the printer's owner allows";
    }
  }
  if (print.lines.size() != layout.lines.size()) return "lines are missing";
  for (std::size_t i = 0; i < print.lines.size(); ++i) {
    const auto one = SettingsOf(pattern, layout.lines[i].pattern);
    for (const std::string& wrong :
         {FindWrongSpeed(print.lines[i], one), FindWrongFilament(print.lines[i], extruder, config),
          FindWrongAdvance(print.lines[i], printer, layout.lines[i].pressure_advance_s)}) {
      if (!wrong.empty()) return fmt::format("line {}: {}", i, wrong);
    }
  }
  const std::string& model = extruder.pressure_advance_model;
  if (!model.empty() && model != "linear" && model != "Linear") return "no linear advance";
  // trammel heats the bed by name before it prints.
  if (!printer.bed_max_temp_c && pattern.bed_temperature_c.value_or(60) > 0) {
    return "a bed is heated that the printer does not have";
  }
  const double nozzle_mm = extruder.nozzle_diameter_mm;
  if (std::abs(pattern.nozzle_diameter_mm - nozzle_mm) > 0.0101) return "another nozzle";
  constexpr double kOozes_s = 1;
  const double asked_s = 1.5 * std::max(pattern.retract_length_mm, pattern.prime_length_mm) /
                         pattern.retract_speed_mm_s;
  if (print.longest_filament_move_s > std::max(kOozes_s, asked_s)) {
    return fmt::format("retracts for {:.1f} s", print.longest_filament_move_s);
  }
  return "";
}

TEST(PrinterNeighbourhood, AUsualPrinterPrintsThePatternAsItIsPlanned) {
  for (const ModelPrinter& printer : UsualPrinters()) {
    const Asked asked = AskForPrint(ToldBy(printer));
    EXPECT_EQ(asked.refusal, "") << printer.name;
    EXPECT_EQ(FindWrong(printer, asked.config), "") << printer.name;
  }
}

TEST(PrinterNeighbourhood, APrintIsRefusedByTheFactsNameOrRight) {
  struct Row {
    void (*change)(ModelPrinter& printer, ModelExtruder& extruder);
    const char* word;  ///< of the refusal; empty: it prints
    const char* setting = "";
  };
  const Row rows[] = {
      {[](auto& p, auto&) { p.max_velocity_mm_s = 40; }, "max_velocity"},
      {[](auto& p, auto&) { p.max_velocity_mm_s = p.configured_max_velocity_mm_s = 1e4; }, ""},
      {[](auto& p, auto&) { p.max_accel_mm_s2 = 500; }, "max_accel"},
      {[](auto& p, auto&) { p.max_accel_mm_s2 = p.configured_max_accel_mm_s2 = 1e5; }, ""},
      {[](auto& p, auto&) { p.minimum_cruise_ratio = 0.95; }, ""},
      {[](auto& p, auto&) { p.before_2024 = true; }, ""},
      {[](auto& p, auto&) { p.square_corner_velocity_mm_s = 0.1; }, ""},
      {[](auto& p, auto&) { p.max_z_velocity_mm_s = 0.5; }, ""},
      {[](auto&, auto& e) { e.filament_diameter_mm = 2.85; }, ""},
      {[](auto&, auto& e) { e.filament_diameter_mm = 2.85; }, "filament_diameter",
       "filament_diameter=1.75"},
      {[](auto&, auto& e) { e.nozzle_diameter_mm = 0.6; }, ""},
      {[](auto&, auto& e) { e.nozzle_diameter_mm = 0.6; }, "nozzle_diameter",
       "nozzle_diameter=0.4"},
      {[](auto&, auto& e) { e.max_extrude_cross_section_mm2 = 0.05; }, "max_extrude_cross_section"},
      {[](auto&, auto& e) { e.max_extrude_only_distance_mm = 0.1; }, "max_extrude_only_distance"},
      {[](auto&, auto& e) { e.max_extrude_only_velocity_mm_s = 0.1; }, "max_extrude_only_velocity"},
      {[](auto&, auto& e) { e.max_extrude_only_accel_mm_s2 = 0.1; }, "max_extrude_only_accel"},
      {[](auto&, auto& e) { e.max_temp_c = 200; }, "max_temp"},
      {[](auto&, auto& e) { e.min_extrude_temp_c = 240; }, "min_extrude_temp"},
      {[](auto& p, auto&) { p.bed_max_temp_c = 50; }, "max_temp of the bed"},
      {[](auto&, auto& e) { e.pressure_advance_model = "recipr"; }, "pressure_advance_model"},
      {[](auto& p, auto&) { p.motors["extruder"].smooth_time_s = 0.1; }, "smooth_time"},
      {[](auto& p, auto&) { p.motors["extruder"].queue = "extruder1"; }, "extruder1"},
      {[](auto& p, auto&) { p.motors["extruder_stepper belted"] = {"extruder"}; }, ""},
      {[](auto& p, auto&) { p.speed_factor = 0.5; }, ""},
      {[](auto& p, auto&) { p.extrude_factor = 1.2; }, ""},
      {[](auto& p, auto&) { p.absolute_coordinates = p.absolute_extrude = false; }, ""},
  };
  for (std::size_t i = 0; i < std::size(rows); ++i) {
    SCOPED_TRACE(i);
    ModelPrinter printer = UsualPrinters().front();
    rows[i].change(printer, printer.extruders.at("extruder"));
    const Asked asked = AskForPrint(ToldBy(printer), rows[i].setting);
    if (*rows[i].word == 0) {
      EXPECT_EQ(asked.refusal, "");
      EXPECT_EQ(FindWrong(printer, asked.config), "");
    } else {
      EXPECT_NE(asked.refusal.find(rows[i].word), std::string::npos)
          << rows[i].word << ": " << asked.refusal;
    }
  }
}

}  // namespace
}  // namespace trammel::test
