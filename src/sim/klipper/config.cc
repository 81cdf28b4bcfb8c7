#include "sim/klipper/config.h"

#include <fmt/format.h>

namespace trammel::sim {

KlipperConfig DefaultKlipperConfig(double laser_limit_s) {
  KlipperConfig config;
  config.macros["LASER_ON"].lines = {
      "SET_PIN PIN=LASER VALUE=1",
      fmt::format("UPDATE_DELAYED_GCODE ID=LASER_LIMIT DURATION={:.3f}", laser_limit_s)};
  config.macros["LASER_OFF"].lines = {"SET_PIN PIN=LASER VALUE=0",
                                      "UPDATE_DELAYED_GCODE ID=LASER_LIMIT DURATION=0"};
  config.macros["LIGHTS_ON"].lines = {"SET_PIN PIN=LIGHTS VALUE=1"};
  config.macros["LIGHTS_OFF"].lines = {"SET_PIN PIN=LIGHTS VALUE=0"};
  MacroConfig& agent = config.macros["CALL_AGENT"];
  agent.remote_method = "calib_agent_event";
  agent.remote_arguments = {{"what", "WHAT", "ping", false}, {"t", "T", "0", true}};
  config.delayed_gcode["LASER_LIMIT"] = {"SET_PIN PIN=LASER VALUE=0"};
  return config;
}

}  // namespace trammel::sim
