// Where on the plate nothing else may lie while a sliced print is made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "base/result.h"

namespace trammel::gcode {

/// A rectangle along the axes, in the printer's coordinates.
struct PlateArea {
  double min_x_mm = 0;
  double min_y_mm = 0;
  double max_x_mm = 0;
  double max_y_mm = 0;
};

/// The cells of a plate that a print needs, of 1 mm, larger on plates of more than 2 m.
class Footprint {
 public:
  /// Of nothing yet. REQUIRES finite bounds, min < max.
  explicit Footprint(const PlateArea& plate);

  /// Marks what the nozzle's way touches; what lies beside the plate is left out.
  /// REQUIRES finite ends. @returns how many cells were looked at
  std::size_t Mark(double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm);

  /// Whether no marked cell touches the area.
  [[nodiscard]] bool Clear(const PlateArea& area) const;

  /// The marked cells' outer edge; nothing where none is marked.
  [[nodiscard]] std::optional<PlateArea> Bounds() const;

 private:
  void Sum() const;

  PlateArea plate_;
  double cell_mm_;
  int columns_;
  int rows_;
  std::vector<std::uint8_t> cells_;
  // Of all cells to the left of each corner and in front of it; empty: not counted yet.
  mutable std::vector<std::uint32_t> sums_;
};

/// Reads the moves of a print in G-code, line by line, in the dialects of Klipper, Marlin and
/// RepRapFirmware: G0 to G3, absolute and relative, in millimetres. Marks where filament is laid,
/// and where the nozzle passes low. What the printer's own macros do (PRINT_START) is not in the
/// file, and not seen.
class FootprintReader {
 public:
  /// @param low_mm  z below which a nozzle that passes would touch what lies there
  FootprintReader(const PlateArea& plate, double low_mm) : footprint_(plate), low_mm_(low_mm) {}

  /// Takes the next line, without its end. Errors (kInput), with the line's number: a coordinate
  /// that is no number or beyond 1e6 mm; a command behind which nobody can tell where the print
  /// lies (inches, splines, a shifted or copied origin, a state that the file did not keep); more
  /// filament than any print lays.
  [[nodiscard]] Result<void> Line(std::string_view line);

  /// Error (kInput): no line laid filament on the plate.
  [[nodiscard]] Result<Footprint> Done() &&;

 private:
  struct Words;
  [[nodiscard]] Result<void> Carry(std::string_view command, std::string_view rest);
  [[nodiscard]] Result<void> Save(std::string name);
  [[nodiscard]] Result<void> Restore(const std::string& name, std::string_view rest);
  [[nodiscard]] Result<void> Move(const Words& words, int kind);
  void MarkArc(const Words& words, double to_x_mm, double to_y_mm, bool clockwise);

  Footprint footprint_;
  double low_mm_;
  bool lays_ = false;
  std::size_t line_ = 0;
  std::size_t looked_at_ = 0;
  std::optional<double> x_mm_, y_mm_, z_mm_;  // absent: not known, as after homing
  double e_mm_ = 0;
  bool relative_ = false;
  bool relative_e_ = false;
  std::map<std::string, std::tuple<bool, bool, double>> saved_;  // both of these, and e_mm_
};

}  // namespace trammel::gcode
