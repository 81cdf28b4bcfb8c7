// Paper on the bed: its wrinkles shift the drawing once it is flat on the glass.
#pragma once

#include <array>
#include <vector>

#include "base/random.h"
#include "sim/sheet/sheet_machine.h"

namespace trammel::sim {

/// Smooth wave of displacement in the plane of the paper.
struct WrinkleWave {
  PlaneMm amplitude_mm;       ///< displacement in x and in y
  double wavelength_mm = 50;  ///< > 0
  double direction_rad = 0;   ///< wave direction, from +x
  double phase_x_rad = 0;
  double phase_y_rad = 0;
};

/// Crease across the whole sheet, pressed flat again: it has consumed paper, and its ridge is a
/// darker line.
struct PaperFold {
  PlaneMm through;           ///< a place on it, bed
  double direction_rad = 0;  ///< crease direction, from +x
  double taken_up_mm = 0;    ///< approach of both sides, -1 … 1
  double ridge_mm = 1;       ///< half width over which they approach, 0.05 … 20
  double darkness = 0;       ///< opacity of the crease's line, 0 … 1
};

/// The defaults are flat, clean and white.
struct SheetPaper {
  std::vector<WrinkleWave> wrinkle;
  LinearRgb reflectance = {0.82, 0.82, 0.81};
  int dirt_count = 0;  ///< specks around the print, 0 … 10000
  std::vector<PaperFold> folds;
  int hair_count = 0;  ///< hairs on the print, 20 … 80 mm long and curled, 0 … 100
};

/// Computes the displacement of a point of the bed once the paper is flat, by wrinkles and folds.
[[nodiscard]] PlaneMm WrinkleAt(const SheetPaper& paper, const PlaneMm& place);

/// Draws a scene's paper: wrinkles whose displacement has an rms of 20 um / sqrt(2) in x and in y
/// (that of one sine of 20 um) in five directions with wavelengths of 40 … 70 mm, and up to 40
/// specks.
[[nodiscard]] SheetPaper DrawSheetPaper(SheetScene scene, Random& random);

}  // namespace trammel::sim
