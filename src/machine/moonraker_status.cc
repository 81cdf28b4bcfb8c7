#include "machine/moonraker_status.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

#include "machine/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

bool IsHeater(std::string_view object) {
  return object.starts_with("extruder") || object == "heater_bed" ||
         object.starts_with("heater_generic ");
}

bool IsPin(std::string_view object) {
  return object.starts_with("output_pin ") || object.starts_with("pwm_tool ") ||
         object.starts_with("pwm_cycle_time ");
}

bool IsLight(std::string_view object) {
  for (const std::string_view kind : {"led ", "neopixel ", "dotstar ", "pca9533 ", "pca9632 "}) {
    if (object.starts_with(kind)) {
      return true;
    }
  }
  return false;
}

/// As many numbers as there are, up to N; false where the member is no list of numbers.
template <std::size_t N>
bool ReadList(const json& object, std::string_view name, std::array<double, N>& into) {
  const json* list = Member(object, name);
  if (list == nullptr || !list->is_array() || list->size() < std::min<std::size_t>(N, 3)) {
    return false;
  }
  for (std::size_t i = 0; i < std::min(N, list->size()); ++i) {
    if (!(*list)[i].is_number()) {
      return false;
    }
    into[i] = (*list)[i].get<double>();
  }
  return true;
}

PrinterReadiness ReadReadiness(const json& webhooks) {
  const std::string state = TextOr(webhooks, "state", "");
  for (const PrinterReadiness readiness : {PrinterReadiness::kReady, PrinterReadiness::kStartup,
                                           PrinterReadiness::kShutdown, PrinterReadiness::kError}) {
    if (state == ToString(readiness)) {
      return readiness;
    }
  }
  return PrinterReadiness::kDisconnected;
}

void ReadMotion(const json& known, PrinterState& state) {
  const json& toolhead = ObjectOr(known, "toolhead");
  state.homed_axes = TextOr(toolhead, "homed_axes", "");
  ReadList(toolhead, "position", state.position_mm);
  ReadList(toolhead, "axis_minimum", state.axis_minimum_mm);
  ReadList(toolhead, "axis_maximum", state.axis_maximum_mm);
  state.limits.max_velocity_mm_s = NumberOr(toolhead, "max_velocity", 0);
  state.limits.max_accel_mm_s2 = NumberOr(toolhead, "max_accel", 0);
  state.limits.minimum_cruise_ratio = Number(toolhead, "minimum_cruise_ratio");
  state.limits.square_corner_velocity_mm_s = NumberOr(toolhead, "square_corner_velocity", 0);
  state.active_extruder = TextOr(toolhead, "extruder", "");
  const json& report = ObjectOr(known, "motion_report");
  ReadList(report, "live_position", state.live_position_mm);
  state.live_velocity_mm_s = NumberOr(report, "live_velocity", 0);
  const json& extruder = ObjectOr(known, state.active_extruder);
  state.pressure_advance_s = Number(extruder, "pressure_advance");
  state.smooth_time_s = Number(extruder, "smooth_time");
}

void ReadGcode(const json& known, GcodeModes& modes) {
  const json& move = ObjectOr(known, "gcode_move");
  modes.absolute_coordinates = BoolOr(move, "absolute_coordinates", true);
  modes.absolute_extrude = BoolOr(move, "absolute_extrude", true);
  modes.speed_mm_min = NumberOr(move, "speed", 0);
  modes.speed_factor = NumberOr(move, "speed_factor", 1);
  modes.extrude_factor = NumberOr(move, "extrude_factor", 1);
  ReadList(move, "homing_origin", modes.homing_origin_mm);
  ReadList(move, "gcode_position", modes.gcode_position_mm);
}

void ReadDevices(const json& known, PrinterState& state) {
  for (const auto& [name, object] : known.items()) {
    if (IsHeater(name) && Number(object, "temperature")) {
      Heater& heater = state.heaters[name];
      heater.temperature_c = NumberOr(object, "temperature", 0);
      heater.target_c = NumberOr(object, "target", 0);
      if (const json* can = Member(object, "can_extrude"); can != nullptr && can->is_boolean()) {
        heater.can_extrude = can->get<bool>();
      }
    } else if (IsPin(name) && Number(object, "value")) {
      state.pins[name] = NumberOr(object, "value", 0);
    } else if (IsLight(name)) {
      const json* colors = Member(object, "color_data");
      if (colors != nullptr && colors->is_array()) {
        for (const json& color : *colors) {
          std::array<double, 4> rgbw{};
          ReadList(json{{"color", color}}, "color", rgbw);
          state.lights[name].push_back(rgbw);
        }
      }
    }
  }
}

}  // namespace

json WantedObjects(const std::vector<std::string>& available) {
  json wanted = {{"webhooks", nullptr}};
  const auto want = [&wanted](const std::string& object, std::vector<std::string> fields) {
    wanted[object] = std::move(fields);
  };
  for (const std::string& object : available) {
    if (object == "toolhead") {
      want(object, {"homed_axes", "position", "print_time", "estimated_print_time", "axis_minimum",
                    "axis_maximum", "max_velocity", "max_accel", "minimum_cruise_ratio",
                    "square_corner_velocity", "extruder"});
    } else if (object == "motion_report") {
      want(object, {"live_position", "live_velocity"});
    } else if (object == "gcode_move") {
      want(object, {"absolute_coordinates", "absolute_extrude", "speed", "speed_factor",
                    "extrude_factor", "homing_origin", "gcode_position"});
    } else if (object == "print_stats") {
      want(object, {"state", "filename", "message"});
    } else if (object == "virtual_sdcard") {
      want(object, {"progress", "is_active"});
    } else if (object == "idle_timeout") {
      want(object, {"state"});
    } else if (object == "pause_resume") {
      want(object, {"is_paused"});
    } else if (IsHeater(object)) {
      want(object, {"temperature", "target", "pressure_advance", "smooth_time", "can_extrude"});
    } else if (IsPin(object)) {
      want(object, {"value"});
    } else if (IsLight(object)) {
      want(object, {"color_data"});
    }
  }
  return wanted;
}

void MergeStatus(json& known, const json& update) {
  if (!known.is_object()) {
    known = json::object();
  }
  if (!update.is_object()) {
    return;
  }
  for (const auto& [name, fields] : update.items()) {
    if (!fields.is_object()) {
      continue;
    }
    json& object = known[name];
    if (!object.is_object()) {
      object = json::object();
    }
    object.update(fields);
  }
}

PrinterState ReadStatus(const json& known, double eventtime_s) {
  PrinterState state;
  state.eventtime_s = eventtime_s;
  const json& webhooks = ObjectOr(known, "webhooks");
  state.readiness = ReadReadiness(webhooks);
  state.message = TextOr(webhooks, "state_message", "");
  ReadMotion(known, state);
  ReadGcode(known, state.gcode);
  ReadDevices(known, state);
  const json& print = ObjectOr(known, "print_stats");
  state.print_state = TextOr(print, "state", "");
  state.print_file = TextOr(print, "filename", "");
  state.print_message = TextOr(print, "message", "");
  state.print_progress =
      std::clamp(NumberOr(ObjectOr(known, "virtual_sdcard"), "progress", 0), 0.0, 1.0);
  state.idle_state = TextOr(ObjectOr(known, "idle_timeout"), "state", "");
  state.paused = BoolOr(ObjectOr(known, "pause_resume"), "is_paused", false);
  return state;
}

}  // namespace trammel::machine
