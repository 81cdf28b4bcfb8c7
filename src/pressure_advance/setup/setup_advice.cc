#include "pressure_advance/setup/setup_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::pressure_advance {
namespace {

constexpr double kFullScale = 255;

std::string OnExposure(const Exposure& exposure) {
  constexpr double kFaint = 60;     // three times the least that is read
  constexpr double kBright = 0.15;  // of the width: a peak that is just cut off
  const std::string figures = fmt::format(
      "the stripe stands {:.0f} of {:.0f} levels over the plate, {:.1f} of its {:.1f} "
      "px at half height are at full scale",
      exposure.peak, kFullScale, exposure.saturated_px, exposure.width_px);
  if (exposure.saturated_px > kBright * exposure.width_px) {
    return figures + ": shorten the camera's exposure, or dim the laser";
  }
  if (exposure.peak < kFaint) {
    return figures + ": lengthen the camera's exposure, and darken the room";
  }
  return figures + ": well exposed";
}

void OnCrop(const SetupResult& result, const PictureSize& picture, SetupAdvice& advice) {
  if (!result.crop) {
    if (result.scale.px_per_mm.good() && result.height.px_per_height_mm.good()) {
      advice.lines.emplace_back(
          "the stripe stands too near to the picture's edge for a crop: turn laser or camera so "
          "that it runs nearer to the middle");
    }
    return;
  }
  const PixelRect& crop = *result.crop;
  const bool cut = crop.x == 0 || crop.y == 0 || crop.x + crop.width >= picture.width_px ||
                   crop.y + crop.height >= picture.height_px;
  if (cut) {
    advice.lines.emplace_back(
        "the crop ends at the picture's edge, so that a large bead may be cut off: let the stripe "
        "run nearer to the middle");
  }
}

void OnTurn(const SetupResult& result, SetupAdvice& advice) {
  constexpr double kDegree = std::numbers::pi / 180;
  constexpr double kTurned_rad = 2 * kDegree;  // a bead's two edges, 0.02 mm apart along the line
  if (!result.laser_turn_rad.good()) return;
  const double turn_rad = result.laser_turn_rad.quantity().value;
  const double from_axis_rad =
      turn_rad - std::numbers::pi / 2 * std::round(turn_rad / (std::numbers::pi / 2));
  if (std::abs(from_axis_rad) < kTurned_rad) return;
  advice.lines.push_back(
      fmt::format("the laser's sheet stands {:.1f} degrees off the printer's axes: turn it, so "
                  "that it meets a printed line square",
                  from_axis_rad / kDegree));
}

}  // namespace

SetupAdvice AdviseSetup(const SetupResult& result, const PictureSize& picture) {
  SetupAdvice advice;
  if (result.exposure) {
    advice.lines.push_back(OnExposure(*result.exposure));
    advice.threshold = static_cast<int>(std::lround(
        std::clamp(result.exposure->background + 0.5 * result.exposure->peak, 1.0, kFullScale)));
  }
  OnCrop(result, picture, advice);
  OnTurn(result, advice);
  return advice;
}

}  // namespace trammel::pressure_advance
