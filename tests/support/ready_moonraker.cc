#include "support/ready_moonraker.h"

namespace trammel::test {

using nlohmann::json;

json SmallPrinterStatus(const std::string& klippy_state) {
  return {{"webhooks", {{"state", klippy_state}, {"state_message", "Printer is " + klippy_state}}},
          {"toolhead",
           {{"homed_axes", "xyz"},
            {"position", {10.0, 20.0, 5.0, 0.0}},
            {"axis_minimum", {-2.0, -2.0, -5.0, 0.0}},
            {"axis_maximum", {235.0, 235.0, 250.0, 0.0}},
            {"max_velocity", 300.0},
            {"max_accel", 10000.0},
            {"minimum_cruise_ratio", 0.5},
            {"square_corner_velocity", 5.0},
            {"estimated_print_time", 87.5},
            {"extruder", "extruder"}}},
          {"motion_report", {{"live_position", {10.0, 20.0, 5.0, 0.0}}, {"live_velocity", 0.0}}},
          {"extruder",
           {{"temperature", 25.0},
            {"target", 0.0},
            {"can_extrude", false},
            {"pressure_advance", 0.04},
            {"smooth_time", 0.03}}},
          {"heater_bed", {{"temperature", 24.0}, {"target", 60.0}}},
          {"output_pin LASER", {{"value", 0.0}}},
          {"gcode_move",
           {{"absolute_coordinates", true},
            {"absolute_extrude", false},
            {"speed", 1500.0},
            {"speed_factor", 1.0},
            {"extrude_factor", 0.95},
            {"homing_origin", {0.0, 0.0, -0.05, 0.0}},
            {"gcode_position", {10.0, 20.0, 5.05, 0.0}}}},
          {"print_stats", {{"state", "standby"}, {"filename", ""}, {"message", ""}}},
          {"virtual_sdcard", {{"progress", 0.0}, {"is_active", false}}},
          {"idle_timeout", {{"state", "Ready"}}},
          {"pause_resume", {{"is_paused", false}}}};
}

json StatusUpdate(const json& objects, double eventtime_s) {
  return {{"jsonrpc", "2.0"},
          {"method", "notify_status_update"},
          {"params", json::array({objects, eventtime_s})}};
}

json Notification(const std::string& method) { return {{"jsonrpc", "2.0"}, {"method", method}}; }

void AnswerLikeMoonraker(ScriptedMoonraker& server, const std::string& klippy_state) {
  server.Answer("server.connection.identify", {{"connection_id", 1730367696}});
  server.Answer("server.info", {{"klippy_connected", klippy_state != "disconnected"},
                                {"klippy_state", klippy_state},
                                {"api_version", {1, 5, 0}}});
  server.Answer("printer.info",
                {{"state", klippy_state}, {"state_message", "Printer is " + klippy_state}});
  json objects = json::array({"gcode_macro LASER_ON"});
  const json status = SmallPrinterStatus(klippy_state);
  for (const auto& [name, fields] : status.items()) {
    objects.push_back(name);
  }
  server.Answer("printer.objects.list", {{"objects", objects}});
  for (const char* method : {"printer.objects.subscribe", "printer.objects.query"}) {
    server.Answer(method, {{"eventtime", 3045.4}, {"status", status}});
  }
  server.Answer("printer.gcode.script", "ok");
  server.Answer("connection.register_remote_method", "ok");
  server.Answer("printer.motion_report.dump_trapq", {{"header", {"time", "duration"}}});
}

}  // namespace trammel::test
