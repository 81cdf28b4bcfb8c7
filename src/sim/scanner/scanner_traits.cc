#include "sim/scanner/scanner_traits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/check.h"

namespace trammel::sim {

namespace {

constexpr double kA4WidthMm = 210;
constexpr double kA4HeightMm = 297;
constexpr double kMarginMm = 5;

}  // namespace

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

namespace {

constexpr double kAroundMm = 10;
constexpr double kMmPerInch = 25.4;
constexpr double kMaxPixels = 60'000;  // per side: 630 mm at 2400 dpi

struct Box {
  double lo_x = std::numeric_limits<double>::infinity();
  double hi_x = -std::numeric_limits<double>::infinity();
  double lo_y = std::numeric_limits<double>::infinity();
  double hi_y = -std::numeric_limits<double>::infinity();
};

Box BoxAround(const PrintedSheet& sheet, double cosine, double sine) {
  Box box;
  for (const InkStroke& stroke : sheet.strokes) {
    if (stroke.ink == kDirtInk && box.lo_x < box.hi_x) continue;
    for (const StrokePoint& point : stroke.points) {
      const double x = cosine * point.centre.x_mm - sine * point.centre.y_mm;
      const double y = sine * point.centre.x_mm + cosine * point.centre.y_mm;
      box.lo_x = std::min(box.lo_x, x);
      box.hi_x = std::max(box.hi_x, x);
      box.lo_y = std::min(box.lo_y, y);
      box.hi_y = std::max(box.hi_y, y);
    }
  }
  return box;
}

}  // namespace

TurnedPrint Turned(const PrintedSheet& sheet, double rotation_rad) {
  TRAMMEL_CHECK(!sheet.strokes.empty(), "the sheet is empty");
  const double cosine = std::cos(rotation_rad);
  const double sine = std::sin(rotation_rad);
  const Box box = BoxAround(sheet, cosine, sine);
  const double x = (box.lo_x + box.hi_x) / 2;
  const double y = (box.lo_y + box.hi_y) / 2;
  return {{cosine * x + sine * y, cosine * y - sine * x},
          (box.hi_x - box.lo_x) / 2,
          (box.hi_y - box.lo_y) / 2};
}

Result<ScannerMap> ScannerMap::Make(const PrintedSheet& sheet, const ScannerTraits& traits) {
  const TurnedPrint print = Turned(sheet, traits.rotation_rad);
  ScannerMap map;
  map.traits_ = traits;
  map.middle_ = print.middle;
  map.cosine_ = std::cos(traits.rotation_rad);
  map.sine_ = std::sin(traits.rotation_rad);
  const auto area = [](double given_mm, double half_mm) {
    return given_mm > 0 ? given_mm : 2 * (half_mm + kAroundMm);
  };
  map.area_width_mm_ = area(traits.area_width_mm, print.half_width_mm);
  map.area_height_mm_ = area(traits.area_height_mm, print.half_height_mm);
  const double px_per_mm = traits.dpi / kMmPerInch;
  const double width_px = std::floor((map.area_width_mm_ - traits.crop_left_mm) * px_per_mm);
  const double height_px = std::floor((map.area_height_mm_ - traits.crop_top_mm) * px_per_mm);
  if (!(width_px >= 8 && width_px <= kMaxPixels && height_px >= 8 && height_px <= kMaxPixels)) {
    return Fail(
        fmt::format("the scan would have {} x {} px; it must have 8 … {} a side: choose "
                    "another area or resolution",
                    width_px, height_px, kMaxPixels));
  }
  map.width_px_ = static_cast<int>(width_px);
  map.height_px_ = static_cast<int>(height_px);
  return map;
}

PixelPlace ScannerMap::PixelOf(const PlaneMm& bed) const {
  const double x = bed.x_mm - middle_.x_mm;
  const double y = bed.y_mm - middle_.y_mm;
  const double right_mm = cosine_ * x - sine_ * y;
  const double up_mm = sine_ * x + cosine_ * y;
  // Central projection about the area's middle: nearer parts are larger.
  const double from_x_mm = traits_.shift_x_mm + right_mm;
  const double from_y_mm = traits_.shift_y_mm - up_mm;
  const double larger = 1 / (1 - traits_.perspective_x * from_x_mm / area_width_mm_ -
                             traits_.perspective_y * from_y_mm / area_height_mm_);
  // Errors of scale and skew grow from the glass's corner, where the bar starts.
  const double glass_x_mm = area_width_mm_ / 2 + larger * from_x_mm;
  const double glass_y_mm = area_height_mm_ / 2 + larger * from_y_mm;
  double seen_x_mm = traits_.scale_x * glass_x_mm + traits_.skew * glass_y_mm;
  double seen_y_mm = traits_.scale_y * glass_y_mm;
  for (const PeriodicError& error : traits_.bar) {
    seen_y_mm += error.amplitude_mm *
                 std::sin(2 * std::numbers::pi * glass_y_mm / error.period_mm + error.phase_rad);
  }
  if (traits_.mirrored) seen_x_mm = area_width_mm_ - seen_x_mm;
  const double px_per_mm = traits_.dpi / kMmPerInch;
  return {(seen_x_mm - traits_.crop_left_mm) * px_per_mm,
          (seen_y_mm - traits_.crop_top_mm) * px_per_mm};
}

}  // namespace trammel::sim
