#include "printer_draws.h"

#include <numbers>

namespace trammel::test {
namespace {

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

}  // namespace

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

json Draw::Told() const {
  json told = ToldBy(printer);
  for (const auto& [place, value] : instead) {
    if (!told.contains(place)) continue;
    if (value.is_null()) {
      told.at(place.parent_pointer()).erase(place.back());
    } else {
      told.at(place) = value.is_string() && value == "null" ? json() : value;
    }
  }
  return told;
}

}  // namespace trammel::test
