#include "sim/klipper/heater.h"

#include <algorithm>
#include <cmath>

namespace trammel::sim {
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
