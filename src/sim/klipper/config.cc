#include "sim/klipper/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace trammel::sim {

KlipperConfig DefaultKlipperConfig(double laser_limit_s, double heater_limit_s) {
  KlipperConfig config;
  config.macros["_LASER_ON"].lines = {
      "SET_PIN PIN=LASER VALUE=1",
      fmt::format("UPDATE_DELAYED_GCODE ID=LASER_LIMIT DURATION={:.3f}", laser_limit_s)};
  config.macros["LASER_OFF"].lines = {"SET_PIN PIN=LASER VALUE=0",
                                      "UPDATE_DELAYED_GCODE ID=LASER_LIMIT DURATION=0"};
  config.macros["LIGHTS_ON"].lines = {"SET_PIN PIN=LIGHTS VALUE=1"};
  config.macros["LIGHTS_OFF"].lines = {"SET_PIN PIN=LIGHTS VALUE=0"};
  config.macros["_TRAMMEL_KEEP_ALIVE"].lines = {
      fmt::format("UPDATE_DELAYED_GCODE ID=TRAMMEL_LIMIT DURATION={:.3f}", heater_limit_s)};
  config.macros["_TRAMMEL_KEEP_ALIVE"].owner = OwnerRule::kTake;
  config.macros["_TRAMMEL_RELEASE"].lines = {"LASER_OFF",
                                             "UPDATE_DELAYED_GCODE ID=TRAMMEL_LIMIT DURATION=0"};
  config.macros["_TRAMMEL_RELEASE"].owner = OwnerRule::kGive;
  config.macros["_TRAMMEL_KEEP_SETTINGS"].settings = SettingsRule::kKeep;
  config.macros["_TRAMMEL_BRING_BACK_SETTINGS"].settings = SettingsRule::kBringBack;
  config.macros["_TRAMMEL_RUN"].variables["owner"] = "";
  for (const auto& [macro, method] : {std::pair{"TRAMMEL_PA", "trammel_offer"},
                                      std::pair{"TRAMMEL_PA_PATTERN", "trammel_offer_pattern"},
                                      std::pair{"TRAMMEL_PA_PHOTO", "trammel_photo"}}) {
    config.macros[macro].remote_method = method;
    config.macros[macro].remote_arguments = {{"filament", "FILAMENT", "", false}};
  }
  config.macros["_TRAMMEL_START"].remote_method = "trammel_start";
  config.macros["_TRAMMEL_START"].remote_arguments = {{"token", "TOKEN", "", false}};
  config.macros["TRAMMEL_PA_PHOTO"].remote_arguments.push_back({"file", "FILE", "", false});
  config.macros["TRAMMEL_OFFSET"].remote_method = "trammel_offer_sheet";
  config.macros["TRAMMEL_OFFSET"].remote_arguments = {{"tools", "TOOLS", "", false},
                                                      {"temp", "TEMP", "", false}};
  config.macros["TRAMMEL_OFFSET_SCAN"].remote_method = "trammel_offset_scan";
  config.macros["TRAMMEL_OFFSET_SCAN"].remote_arguments = {{"file", "FILE", "", false}};
  config.macros["TRAMMEL_APPLY"].remote_method = "trammel_apply";
  config.macros["TRAMMEL_DISMISS"].remote_method = "trammel_dismiss";
  config.macros["TRAMMEL_ASK"].lines = {"RESPOND TYPE=command MSG=\"action:prompt_begin trammel\"",
                                        "RESPOND TYPE=command MSG=\"action:prompt_text {MSG|}\"",
                                        "RESPOND TYPE=command MSG=\"action:prompt_show\""};
  config.macros["_TRAMMEL_CLOSE"].lines = {"RESPOND TYPE=command MSG=\"action:prompt_end\""};
  MacroConfig& agent = config.macros["CALL_AGENT"];
  agent.remote_method = "calib_agent_event";
  agent.remote_arguments = {{"what", "WHAT", "ping", false}, {"t", "T", "0", true}};
  config.delayed_gcode["LASER_LIMIT"] = {"SET_PIN PIN=LASER VALUE=0"};
  config.delayed_gcode["TRAMMEL_LIMIT"] = {
      "LASER_OFF", "TURN_OFF_HEATERS",
      "SET_GCODE_VARIABLE MACRO=_TRAMMEL_RUN VARIABLE=owner VALUE=\"''\""};
  return config;
}

void AddTapMacros(KlipperConfig& config, double answer_s) {
  config.macros["_TRAMMEL_TAP"].lines = {"PROBE {rawparams} SAMPLES=1",
                                         "_TRAMMEL_TAP_RISE {rawparams}",
                                         "_TRAMMEL_TAP_ASK SINCE={print_time}"};
  config.macros["_TRAMMEL_TAP_RISE"].lines = {
      "SAVE_GCODE_STATE NAME=_trammel_tap",    "M220 S100", "G91",
      "G1 Z{RISE|0.2} F{RISE_SPEED|0.32|60}",  "G4 P400",   "G1 Z{LIFT|2} F{LIFT_SPEED|5|60}",
      "RESTORE_GCODE_STATE NAME=_trammel_tap", "M400"};
  MacroConfig& ask = config.macros["_TRAMMEL_TAP_ASK"];
  ask.remote_method = "trammel_tap";
  ask.remote_arguments = {{"since", "SINCE", "0", true}};
  ask.lines = {fmt::format("UPDATE_DELAYED_GCODE ID=_TRAMMEL_NO_TAP DURATION={:.3f}", answer_s)};
  MacroConfig& result = config.macros["TRAMMEL_TAP_RESULT"];
  result.keeps = {"VERDICT", "REASON", "Z", "U"};
  result.lines = {"UPDATE_DELAYED_GCODE ID=_TRAMMEL_NO_TAP DURATION=0", "TRAMMEL_TAP_DONE"};
  config.macros["TRAMMEL_TAP_DONE"].guard =
      MacroGuard{"TRAMMEL_TAP_RESULT", "VERDICT", "good", "REASON"};
  config.delayed_gcode["_TRAMMEL_NO_TAP"] = {"TRAMMEL_TAP_RESULT VERDICT=refused REASON=no_answer"};
}

namespace {

constexpr double kHysteresisC = 5;  // verify_heater's defaults
constexpr double kGainC = 2;

bool Heating(const Heater& heater) { return heater.powered && heater.target_c > 0; }

}  // namespace

void HeatFor(Heater& heater, double seconds, double room_c) {
  const double cooling_c_s = (room_c - heater.temperature_c) / heater.config.cool_s;
  double rate_c_s = cooling_c_s;
  const double goal_c = std::min(heater.target_c, heater.highest_reach_c);
  if (Heating(heater) && goal_c > heater.temperature_c) {
    rate_c_s =
        std::min(heater.config.rate_c_s, (goal_c - heater.temperature_c) / heater.config.settle_s);
  } else if (Heating(heater)) {
    rate_c_s = std::max(cooling_c_s, (goal_c - heater.temperature_c) / heater.config.settle_s);
  }
  heater.temperature_c += rate_c_s * seconds;
}

bool Busy(const Heater& heater) {
  return heater.target_c > 0 &&
         std::abs(heater.temperature_c - heater.target_c) > heater.config.tolerance_c;
}

double PowerOf(const Heater& heater) {
  if (!Heating(heater) || heater.temperature_c > heater.target_c + 0.5) return 0;
  return std::clamp(0.2 + (heater.target_c - heater.temperature_c) / 20, 0.0, 1.0);
}

bool HeatsAsExpected(Heater& heater, double now_s) {
  if (!Heating(heater) || heater.temperature_c >= heater.target_c - kHysteresisC) {
    heater.watch_until_s = 0;
    return true;
  }
  if (heater.watch_until_s == 0 || heater.temperature_c >= heater.watch_goal_c) {
    heater.watch_until_s = now_s + heater.config.gain_window_s;
    heater.watch_goal_c = heater.temperature_c + kGainC;
    return true;
  }
  return now_s < heater.watch_until_s;
}

}  // namespace trammel::sim
