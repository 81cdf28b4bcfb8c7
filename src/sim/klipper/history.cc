#include "sim/klipper/history.h"

#include <fmt/format.h>

#include <cmath>

namespace trammel::sim {

double ValueAt(const History& history, const std::string& name, double time_s, double before) {
  for (auto change = history.changes.rbegin(); change != history.changes.rend(); ++change) {
    if (change->time_s <= time_s && change->name == name) return change->value;
  }
  return before;
}

namespace {

struct Settings {
  double pressure_advance_s = -1;
  double smooth_time_s = -1;
  double acceleration_mm_s2 = -1;
  double corner_velocity_mm_s = -1;
  double minimum_cruise_ratio = -1;
};

void AppendSettings(const Move& move, Settings& held, std::string& text) {
  if (move.pressure_advance_s != held.pressure_advance_s ||
      move.smooth_time_s != held.smooth_time_s) {
    text += fmt::format("SET_PRESSURE_ADVANCE ADVANCE={:.9g} SMOOTH_TIME={:.9g}\n",
                        move.pressure_advance_s, move.smooth_time_s);
    held.pressure_advance_s = move.pressure_advance_s;
    held.smooth_time_s = move.smooth_time_s;
  }
  if (move.acceleration_mm_s2 != held.acceleration_mm_s2 ||
      move.corner_velocity_mm_s != held.corner_velocity_mm_s ||
      move.minimum_cruise_ratio != held.minimum_cruise_ratio) {
    text += fmt::format(
        "SET_VELOCITY_LIMIT ACCEL={:.9g} SQUARE_CORNER_VELOCITY={:.9g} "
        "MINIMUM_CRUISE_RATIO={:.9g}\n",
        move.acceleration_mm_s2, move.corner_velocity_mm_s, move.minimum_cruise_ratio);
    held.acceleration_mm_s2 = move.acceleration_mm_s2;
    held.corner_velocity_mm_s = move.corner_velocity_mm_s;
    held.minimum_cruise_ratio = move.minimum_cruise_ratio;
  }
}

}  // namespace

std::string ExecutedGcode(const History& history, double from_s, double until_s) {
  std::string text = "G90\nM83\n";
  Settings held;
  Position place{1e9, 0, 0};
  for (const ExecutedMove& executed : history.moves) {
    const TimedMove& timed = executed.timed;
    const Move& move = timed.move;
    if (timed.start_s < from_s || timed.end_s() > until_s) continue;
    const bool goes_on = std::hypot(move.from.x_mm - place.x_mm, move.from.y_mm - place.y_mm,
                                    move.from.z_mm - place.z_mm) < 1e-6;
    if (!goes_on) {
      text += fmt::format("M400\nG0 X{:.9f} Y{:.9f} Z{:.9f} F6000\nM400\n", move.from.x_mm,
                          move.from.y_mm, move.from.z_mm);
    } else if (timed.start_v_mm_s == 0) {
      text += "M400\n";
    }
    AppendSettings(move, held, text);
    text += fmt::format("G1 X{:.9f} Y{:.9f} Z{:.9f}", move.to.x_mm, move.to.y_mm, move.to.z_mm);
    if (move.e_mm != 0) text += fmt::format(" E{:.9f}", move.e_mm);
    text += fmt::format(" F{:.9g}\n", move.feed_mm_s * 60);
    place = move.to;
  }
  return text;
}

}  // namespace trammel::sim
