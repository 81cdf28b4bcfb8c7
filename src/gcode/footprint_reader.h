// The footprint of a print from its G-code.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "gcode/footprint.h"

namespace trammel::gcode {

/// Reads the moves of a print in G-code, line by line, in the dialects of Klipper, Marlin and
/// RepRapFirmware: G0 to G3, absolute and relative, in millimetres. Marks where filament is laid,
/// and where the nozzle passes or comes down low. What the printer's own macros do (PRINT_START) is
/// not in the file, and not seen: a low way that begins where they left the nozzle is taken to
/// begin anywhere at the left or the front edge of the plate, where printers prime. So it is after
/// each macro before the first filament; one behind it is taken to bring the nozzle back.
class FootprintReader {
 public:
  /// @param plate  REQUIRES finite bounds, min < max
  /// @param low_mm  z below which a nozzle that passes would touch what lies there
  FootprintReader(const PlateArea& plate, double low_mm)
      : plate_(plate), footprint_(plate), low_mm_(low_mm) {}

  /// Takes the next line, without its end. Errors (kInput), with the line's number: a coordinate
  /// that is no number or beyond 1e6 mm; a command behind which nobody can tell where the print
  /// lies (inches, splines, a shifted or copied origin, a state that the file did not keep); more
  /// filament than any print lays.
  [[nodiscard]] Result<void> Line(std::string_view line);

  /// Error (kInput): no line laid filament on the plate.
  [[nodiscard]] Result<Footprint> Done() &&;

 private:
  struct Words;
  struct Modes {
    bool relative = false;
    bool relative_e = false;
    double e_mm = 0;
  };

  [[nodiscard]] Result<void> Carry(std::string_view statement);
  [[nodiscard]] Result<void> CarryLong(std::string_view command, std::string_view rest);
  [[nodiscard]] Result<void> Restore(std::string_view rest);
  [[nodiscard]] Result<void> SetPlace(const Words& words);
  [[nodiscard]] Result<void> Move(const Words& words, int kind);
  [[nodiscard]] std::optional<double> Target(std::optional<double> from,
                                             std::optional<double> word) const;
  void Mark(double to_x_mm, double to_y_mm);
  void MarkArc(const Words& words, double to_x_mm, double to_y_mm, bool clockwise);

  PlateArea plate_;
  Footprint footprint_;
  double low_mm_;
  bool lays_ = false;
  bool plane_xy_ = true;  // of arcs
  std::size_t line_ = 0;
  std::size_t looked_at_ = 0;
  std::optional<double> x_mm_, y_mm_;  // absent: not known, as after homing
  double z_mm_ = 0;                    // as low as it can be where it is not known
  Modes modes_;
  std::map<std::string, Modes, std::less<>> named_;  // Klipper's
  std::vector<Modes> pushed_;                        // RepRapFirmware's
};

}  // namespace trammel::gcode
