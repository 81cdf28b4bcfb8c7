// A heater with its sensor, and Klipper's watch over it.
#pragma once

#include "sim/klipper/config.h"

namespace trammel::sim {

/// Temperatures in °C.
struct Heater {
  HeaterConfig config;
  double temperature_c = 25;
  double target_c = 0;
  bool powered = true;           ///< false after a shutdown, whatever the target
  double highest_reach_c = 1e9;  ///< a weak heater's limit
  double watch_until_s = 0;      ///< verify_heater: by then it must have gained
  double watch_goal_c = 0;
};

/// Moves the temperature on by a short time (<= 0.1 s).
void HeatFor(Heater& heater, double seconds, double room_c);

/// Whether a wait for the target has to go on. A target of 0 is never waited for.
[[nodiscard]] bool Busy(const Heater& heater);

/// 0 … 1
[[nodiscard]] double PowerOf(const Heater& heater);

/// False once the heater has not risen as a working one does; call at least every second.
[[nodiscard]] bool HeatsAsExpected(Heater& heater, double now_s);

}  // namespace trammel::sim
