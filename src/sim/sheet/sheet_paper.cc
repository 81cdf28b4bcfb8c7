#include "sim/sheet/sheet_paper.h"

#include <cmath>
#include <numbers>

namespace trammel::sim {

PlaneMm WrinkleAt(const SheetPaper& paper, const PlaneMm& place) {
  PlaneMm moved;
  for (const WrinkleWave& wave : paper.wrinkle) {
    const double along_mm =
        place.x_mm * std::cos(wave.direction_rad) + place.y_mm * std::sin(wave.direction_rad);
    const double angle_rad = 2 * std::numbers::pi * along_mm / wave.wavelength_mm;
    moved.x_mm += wave.amplitude_mm.x_mm * std::sin(angle_rad + wave.phase_x_rad);
    moved.y_mm += wave.amplitude_mm.y_mm * std::sin(angle_rad + wave.phase_y_rad);
  }
  for (const PaperFold& fold : paper.folds) {
    const PlaneMm across{-std::sin(fold.direction_rad), std::cos(fold.direction_rad)};
    const double off_mm = (place.x_mm - fold.through.x_mm) * across.x_mm +
                          (place.y_mm - fold.through.y_mm) * across.y_mm;
    const double by_mm = -fold.taken_up_mm / 2 * std::tanh(off_mm / fold.ridge_mm);
    moved.x_mm += by_mm * across.x_mm;
    moved.y_mm += by_mm * across.y_mm;
  }
  return moved;
}

SheetPaper DrawSheetPaper(SheetScene scene, Random& random) {
  constexpr int kWaves = 5;
  constexpr double kPi = std::numbers::pi;
  SheetPaper paper;
  const double amplitude_mm = 0.020 / std::sqrt(kWaves);
  const double first_rad = random.Uniform(0, kPi);
  for (int i = 0; i < kWaves; ++i) {
    WrinkleWave wave;
    wave.amplitude_mm = {amplitude_mm, amplitude_mm};
    wave.wavelength_mm = random.Uniform(40, 70);
    wave.direction_rad = first_rad + kPi * (i + random.Uniform(-0.4, 0.4)) / kWaves;
    wave.phase_x_rad = random.Uniform(0, 2 * kPi);
    wave.phase_y_rad = random.Uniform(0, 2 * kPi);
    paper.wrinkle.push_back(wave);
  }
  if (scene == SheetScene::kWhiteOnBlack) {
    const double dark = random.Uniform(0.02, 0.05);
    paper.reflectance = {dark, dark, dark};
  } else {
    const double light = random.Uniform(0.75, 0.88);
    paper.reflectance = {light, light, light * random.Uniform(0.94, 1.0)};
  }
  paper.dirt_count = static_cast<int>(random.Below(41));
  return paper;
}

}  // namespace trammel::sim
