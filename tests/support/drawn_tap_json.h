// A tap as a printer sends it, drawn with a ruler.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>

namespace trammel::test {

/// A straight press of 45 um at 3500 gf/mm onto a bed at `contact_mm`, pulled back at 0.3 mm/s,
/// with noise of 1 gf that is the same each time: without any there is nothing to weigh.
inline nlohmann::json DrawnTap(double contact_mm) {
  using nlohmann::json;
  json tap = {{"time", json::array()}, {"force", json::array()}};
  const double low = contact_mm - 0.045;
  for (int i = 0; i < 640; ++i) {
    const double t = 10 + i / 320.0;
    const double z = t < 10.6   ? low + 2 * (10.6 - t)
                     : t < 10.9 ? low
                                : std::min(low + 0.3 * (t - 10.9), low + 0.12);
    const double noise = ((i * 7919) % 101 - 50) / 30.0;
    tap["time"].push_back(t);
    tap["force"].push_back(noise + 3500 * std::max(0.0, contact_mm - z));
  }
  const auto move = [](double time, double duration, double speed, double accel, double z,
                       int way) {
    return json{{"print_time", time}, {"move_t", duration}, {"start_v", speed}, {"accel", accel},
                {"start_x", 10},      {"start_y", 20},      {"start_z", z},     {"z_r", way}};
  };
  tap["moves"] = {move(9, 1.6, 2, 0, low + 3.2, -1), move(10.6, 0, 0, 0, low, 0),
                  move(10.9, 0.0005, 0, 600, low, 1),
                  move(10.9005, 0.3995, 0.3, 0, low + 0.000075, 1),
                  move(11.3, 0.0005, 0.3, -600, low + 0.119925, 1)};
  return tap;
}

}  // namespace trammel::test
