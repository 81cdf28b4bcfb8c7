#include "sim/laser/laser_traits.h"

#include <algorithm>

namespace trammel::sim {
namespace {

void DrawPlate(const Condition& condition, Random& random, LaserTraits& traits) {
  Sheen& plate = traits.plate;
  const double light = random.Uniform(0.6, 1.2);  // room light
  const double rest = random.Uniform(0.6, 1.2);   // status LEDs and the like, in the dark
  const auto look = [&](std::array<double, 3> bright, std::array<double, 3> dark) {
    for (std::size_t i = 0; i < 3; ++i) {
      plate.ambient_bgr[i] = condition.ambient ? light * bright[i] : rest * dark[i];
    }
  };
  switch (condition.plate) {
    case Plate::kMatte:
      plate.peak = random.Uniform(0.90, 1.20);
      plate.speckle = random.Uniform(0.14, 0.22);
      plate.glow = random.Uniform(0.08, 0.16);
      plate.glow_sigma_px = random.Uniform(6, 9);
      look({48, 42, 31}, {6, 15, 14});
      break;
    case Plate::kTextured:
      plate.peak = random.Uniform(0.75, 1.05);
      plate.speckle = random.Uniform(0.28, 0.42);
      plate.glow = random.Uniform(0.08, 0.18);
      plate.glow_sigma_px = random.Uniform(7, 12);
      look({19, 17, 14}, {4, 8, 8});
      break;
    case Plate::kPei:
      plate.peak = random.Uniform(0.45, 0.75);
      plate.speckle = random.Uniform(0.12, 0.20);
      plate.glow = random.Uniform(0.40, 0.60);
      plate.glow_sigma_px = random.Uniform(7, 11);
      plate.glow_shift_px = random.Uniform(4, 9);
      look({66, 77, 82}, {8, 14, 16});
      break;
  }
}

void DrawFilament(const Condition& condition, Random& random, LaserTraits& traits) {
  Sheen& filament = traits.filament;
  if (condition.filament == Filament::kBlack) {
    filament.peak = random.Uniform(0.36, 0.50);
    filament.speckle = random.Uniform(0.15, 0.25);
    filament.glow = random.Uniform(0.01, 0.04);
    const double look = condition.ambient ? random.Uniform(10, 22) : random.Uniform(1, 4);
    filament.ambient_bgr = {look * 1.1, look, look * 0.9};
    return;
  }
  filament.peak = random.Uniform(1.05, 1.45);
  filament.speckle = random.Uniform(0.08, 0.15);
  filament.glow = random.Uniform(0.30, 0.50);
  filament.glow_sigma_px = random.Uniform(5, 8);
  filament.glow_shift_px = random.Uniform(0.5, 2.5);
  const double look = condition.ambient ? random.Uniform(55, 100) : random.Uniform(18, 32);
  filament.ambient_bgr = {look * 0.9, look * 0.97, look};
}

}  // namespace

LaserTraits DrawLaserTraits(const Condition& condition, Random& random) {
  constexpr double kDegree = 0.017453292519943;
  LaserTraits traits;
  traits.px_per_mm = 41 * random.Uniform(0.97, 1.03);
  traits.stripe_column_px = 872 + random.Uniform(-3, 3);
  traits.line_row_px = 371 + random.Uniform(-4, 4);
  traits.stripe_tilt_rad = random.Uniform(-0.5, 0.5) * kDegree;
  traits.plate_slope = random.Uniform(-0.0004, 0.0004);
  traits.fan_offset_mm = random.Uniform(-10, 10);
  traits.position_error_mm = random.Uniform(-0.1, 0.1);
  traits.stripe_sigma_px = random.Uniform(2.4, 3.4);
  traits.textured = true;
  DrawPlate(condition, random, traits);
  DrawFilament(condition, random, traits);
  traits.exposure_s =
      condition.ambient ? random.Uniform(0.006, 0.012) : random.Uniform(0.010, 0.025);
  traits.gain_drift = random.Uniform(0, 0.06);
  traits.gain_period_s = random.Uniform(1, 6);
  traits.noise_floor = random.Uniform(1.0, 2.0);
  traits.noise_shot = random.Uniform(0.05, 0.15);
  traits.frame_jitter_s = random.Uniform(0.0005, 0.002);
  traits.jpeg_quality = 82 + static_cast<int>(random.Below(8));
  return traits;
}

}  // namespace trammel::sim
