#include "sim/scanner/scanner_traits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/print/field_bound.h"
#include "sim/scanner/scanner_map.h"

namespace trammel::sim {
namespace {

constexpr double kA4WidthMm = 210;
constexpr double kA4HeightMm = 297;
constexpr double kMarginMm = 5;

}  // namespace

Result<void> Validate(const ScannerTraits& traits) {
  for (const PeriodicError& error : traits.bar) {
    TRY(CheckBounds("scan bar error", {{"amplitude_mm", error.amplitude_mm, 0, 0.5},
                                       {"period_mm", error.period_mm, 1, 1e4},
                                       {"phase_rad", error.phase_rad, -100, 100}}));
  }
  TRY(CheckBounds("scanner", {{"dpi", traits.dpi, 50, 4800},
                              {"rotation_rad", traits.rotation_rad, -10, 10},
                              {"shift_x_mm", traits.shift_x_mm, -500, 500},
                              {"shift_y_mm", traits.shift_y_mm, -500, 500},
                              {"area_width_mm", traits.area_width_mm, 0, 1000},
                              {"area_height_mm", traits.area_height_mm, 0, 1000},
                              {"crop_left_mm", traits.crop_left_mm, 0, 500},
                              {"crop_right_mm", traits.crop_right_mm, 0, 500},
                              {"crop_top_mm", traits.crop_top_mm, 0, 500},
                              {"crop_bottom_mm", traits.crop_bottom_mm, 0, 500}}));
  TRY(CheckBounds("scanner", {{"scale_x", traits.scale_x, 0.9, 1.1},
                              {"scale_y", traits.scale_y, 0.9, 1.1},
                              {"skew", traits.skew, -0.05, 0.05},
                              {"perspective_x", traits.perspective_x, -0.5, 0.5},
                              {"perspective_y", traits.perspective_y, -0.5, 0.5},
                              {"shadow_strength", traits.shadow_strength, 0, 1},
                              {"shadow_mm", traits.shadow_mm, 0, 1},
                              {"blur_mm", traits.blur_mm, 0, 0.5},
                              {"lamp_falloff", traits.lamp_falloff, 0, 0.5},
                              {"texture", traits.texture, 0, 0.2},
                              {"texture_mm", traits.texture_mm, 0, 0.5},
                              {"noise", traits.noise, 0, 0.2},
                              {"gamma", traits.gamma, 0.5, 3},
                              {"cast red", traits.cast[0], 0.2, 1.2},
                              {"cast green", traits.cast[1], 0.2, 1.2},
                              {"cast blue", traits.cast[2], 0.2, 1.2}}));
  const int bits = traits.bits;
  return bits == 8 || bits == 16
             ? Result<void>{}
             : Fail(fmt::format("scanner bits is {}; it must be 8 or 16", bits));
}

void PlaceOnA4(const PrintedSheet& sheet, ScannerTraits& traits, Random& random) {
  const double across = random.Uniform(-0.8, 0.8);
  const double along = random.Uniform(-0.8, 0.8);
  const TurnedPrint print = Turned(sheet, traits.rotation_rad);
  const auto fits = [&](double width_mm, double height_mm) {
    return print.half_width_mm + kMarginMm <= width_mm / 2 &&
           print.half_height_mm + kMarginMm <= height_mm / 2;
  };
  const bool upright = fits(kA4WidthMm, kA4HeightMm);
  if (!upright && !fits(kA4HeightMm, kA4WidthMm)) return;
  traits.area_width_mm = upright ? kA4WidthMm : kA4HeightMm;
  traits.area_height_mm = upright ? kA4HeightMm : kA4WidthMm;
  traits.shift_x_mm = across * (traits.area_width_mm / 2 - print.half_width_mm - kMarginMm);
  traits.shift_y_mm = along * (traits.area_height_mm / 2 - print.half_height_mm - kMarginMm);
}

ScannerTraits DrawScannerTraits(const PrintedSheet& sheet, Random& random) {
  constexpr double kDegree = std::numbers::pi / 180;
  constexpr double kTurn = 360 * kDegree;
  ScannerTraits traits;
  traits.rotation_rad =
      (90 * static_cast<double>(random.Below(4)) + random.Uniform(-8, 8)) * kDegree;
  traits.scale_x = 1 + random.Uniform(-0.005, 0.005);
  traits.scale_y = 1 + random.Uniform(-0.005, 0.005);
  traits.skew = random.Uniform(-0.0015, 0.0015);
  traits.bar = {{random.Uniform(0, 0.030), random.Uniform(150, 400), random.Uniform(0, kTurn)},
                {random.Uniform(0, 0.010), random.Uniform(40, 120), random.Uniform(0, kTurn)},
                {random.Uniform(0, 0.005), random.Uniform(5, 20), random.Uniform(0, kTurn)}};
  traits.shadow_strength = random.Uniform(0.1, 0.5);
  traits.shadow_mm = random.Uniform(0.05, 0.2);
  traits.shadow_below = random.Below(2) == 0;
  traits.blur_mm = random.Uniform(0.015, 0.045);
  traits.lamp_falloff = random.Uniform(0, 0.05);
  traits.texture = random.Uniform(0.002, 0.012);
  traits.texture_mm = random.Uniform(0.04, 0.15);
  traits.noise = random.Uniform(0.001, 0.006);
  traits.gamma = random.Uniform(1.8, 2.4);
  for (double& gain : traits.cast) gain = random.Uniform(0.92, 1.05);
  PlaceOnA4(sheet, traits, random);
  return traits;
}

}  // namespace trammel::sim
