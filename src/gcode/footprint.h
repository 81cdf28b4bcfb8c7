// Where on the plate nothing else may lie while a sliced print is made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

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

}  // namespace trammel::gcode
