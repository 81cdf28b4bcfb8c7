// A tap with all that was recorded around it.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tap/samples/tap.h"

namespace trammel::tap {

/// What a file or a printer gave. Nothing is assumed of it but equal lengths.
struct Recording {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::string name;  ///< For people: the file, and which of its taps.
  std::vector<double> time_s;
  std::vector<double> force_g;  ///< As long as time_s; NaN where a sample has no number.
  std::vector<double> z_mm;     ///< As long as time_s, or empty.
  std::vector<Move> moves;
  double x_mm = kUnknown;  ///< Where on the bed.
  double y_mm = kUnknown;
  double nozzle_temperature_c = kUnknown;
  std::optional<double> firmware_z_mm;  ///< What the printer made of the tap itself.
  std::vector<std::string> notices;     ///< Of the reader, as that moves come from z.

  [[nodiscard]] TapView View() const { return {time_s, force_g, moves}; }
};

}  // namespace trammel::tap
