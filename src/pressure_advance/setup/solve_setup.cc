#include "pressure_advance/setup/solve_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/square.h"
#include "base/statistics.h"
#include "pressure_advance/setup/camera_scale.h"

namespace trammel::pressure_advance {
namespace {

constexpr std::size_t kFewestStripes = 10;  // four values of the way, three of the focus
constexpr std::size_t kFewestMarks = 10;    // of sixteen

std::vector<SeenStripe> Sound(std::span<const PlacedStripe> stripes) {
  std::vector<SeenStripe> sound;
  for (const PlacedStripe& stripe : stripes) {
    if (!stripe.reading.fault.empty()) continue;
    sound.push_back({stripe.head, stripe.reading.across_px, stripe.reading.width_px});
  }
  return sound;
}

// Returns the fault of most pictures.
std::string CommonestFault(std::span<const PlacedStripe> stripes) {
  std::map<std::string, int> count;
  std::string commonest = "the stripe was not looked at";
  int most = 0;
  for (const PlacedStripe& stripe : stripes) {
    const std::string& fault = stripe.reading.fault;
    const std::string kind = fault.substr(0, fault.find('('));  // figures removed
    if (fault.empty() || ++count[kind] <= most) continue;
    most = count[kind], commonest = fault;
  }
  return commonest;
}

Perspective PerspectiveOf(const std::vector<SeenStripe>& sound) {
  double middle_mm = 0;
  for (const SeenStripe& stripe : sound) {
    middle_mm += stripe.head.z_mm / static_cast<double>(sound.size());
  }
  const StripeHeight way = FitStripeHeight(sound, middle_mm, Measured());
  return way.perspective.value_or(Perspective{});
}

// Computes the mark's relative error in scale: its edges are between the plate and the beads' top.
double MarkHeightUncertainty(const std::vector<SeenStripe>& sound, double layer_height_mm) {
  const double inverse_mm = sound.empty() ? 0 : PerspectiveOf(sound).inverse_mm;
  return std::abs(inverse_mm) * layer_height_mm / std::sqrt(3.0);
}

const PlacedStripe* NearestTo(std::span<const PlacedStripe> stripes, double height_mm) {
  const PlacedStripe* nearest = nullptr;
  for (const PlacedStripe& stripe : stripes) {
    if (!stripe.reading.fault.empty()) continue;
    const auto off = [&](const PlacedStripe& s) { return std::abs(s.head.z_mm - height_mm); };
    if (nearest == nullptr || off(stripe) < off(*nearest)) nearest = &stripe;
  }
  return nearest;
}

Measured ScanAngle(const StripeHeight& height, const Measured& px_per_mm) {
  if (!height.px_per_height_mm.good()) return height.px_per_height_mm;
  if (!px_per_mm.good()) return px_per_mm;
  const Quantity& shift = height.px_per_height_mm.quantity();
  const Quantity& scale = px_per_mm.quantity();
  const double tangent = std::abs(shift.value) / scale.value;
  const double gain = tangent / (1 + Square(tangent));  // d angle / d ln tangent
  const double variance = Square(gain) * (Square(shift.standard_uncertainty / shift.value) +
                                          Square(scale.standard_uncertainty / scale.value));
  constexpr double kKnown = 1;  // the parts' degrees of freedom already cover it
  return MeasuredFrom(std::atan(tangent), 0, variance, kKnown);
}

// Returns the stripe's direction on the bed, from +y.
Measured LaserTurn(std::span<const PlacedStripe> stripes, const Measured& rotation_rad) {
  if (!rotation_rad.good()) return rotation_rad;
  std::vector<double> slopes;
  bool down = true;
  for (const PlacedStripe& stripe : stripes) {
    if (!stripe.reading.fault.empty()) continue;
    slopes.push_back(stripe.reading.slope);
    down = stripe.reading.down;
  }
  if (slopes.size() < 3) return Measured::CannotTell("too few pictures of the stripe");
  // Down the picture the tilt is counter-clockwise from +y, as rows count downwards; across it,
  // clockwise from +x.
  const double lean =
      down ? std::atan(Mean(slopes)) : -std::atan(Mean(slopes)) - std::numbers::pi / 2;
  const double turn = rotation_rad.quantity().value + lean;
  const double half_turn = std::numbers::pi;
  const double wrapped = turn - half_turn * std::round(turn / half_turn);
  const auto count = static_cast<double>(slopes.size());
  return MeasuredFrom(wrapped, Square(StandardDeviation(slopes)) / count,
                      Square(rotation_rad.quantity().standard_uncertainty), count - 1);
}

// Returns a crop with room for a bead and for the largest swell that a scan reads: the same reach
// as a crop found in frames.
std::optional<PixelRect> CropAround(const SetupResult& result, const SetupObservations& seen,
                                    double slope, double stripe_sigma_px) {
  if (!result.scale.px_per_mm.good() || !result.height.px_per_height_mm.good()) return {};
  constexpr double kBeads = 2.7, kHeights = 2.5, kSigmas = 6;
  const double along = kBeads * seen.line_width_mm * result.scale.px_per_mm.quantity().value + 2;
  const double rise =
      kHeights * seen.layer_height_mm * std::abs(result.height.px_per_height_mm.quantity().value);
  const double beside = kSigmas * stripe_sigma_px + 4 + std::abs(slope) * along;
  const bool down = AlongX(result.height_direction);
  const double sign = Sign(result.height_direction);
  const double across = down ? result.spot_column_px : result.spot_row_px;
  const double middle = down ? result.spot_row_px : result.spot_column_px;
  const double low = across - beside - (sign < 0 ? rise : 0);
  const double high = across + beside + (sign > 0 ? rise : 0);
  const auto whole = [](double from, double to, int limit) {
    const int first = std::clamp(static_cast<int>(std::floor(from)), 0, limit - 1);
    const int last = std::clamp(static_cast<int>(std::ceil(to)), first, limit - 1);
    return std::pair{first, last - first + 1};
  };
  const int width = seen.picture.width_px, height = seen.picture.height_px;
  const auto [x, w] = down ? whole(low, high, width) : whole(middle - along, middle + along, width);
  const auto [y, h] =
      down ? whole(middle - along, middle + along, height) : whole(low, high, height);
  constexpr int kSmallest_px = 16;
  if (w < kSmallest_px || h < kSmallest_px) return {};
  return PixelRect{x, y, w, h};
}

// Computes the spot, and returns its uncertainty along the stripe's normal.
double PlaceSpot(const SetupObservations& seen, bool down, double slope, SetupResult& result) {
  const double middle_x = 0.5 * (seen.picture.width_px - 1);
  const double middle_y = 0.5 * (seen.picture.height_px - 1);
  const double along_normal = result.height.across_px * std::hypot(1.0, slope);
  result.spot_column_px = down ? middle_x + along_normal : middle_x;
  result.spot_row_px = down ? middle_y : middle_y + along_normal;
  const double shift = std::abs(result.height.px_per_height_mm.quantity().value);
  const double backlash = std::abs(result.height.backlash_z_mm.quantity().value);
  return std::hypot(result.height.across_uncertainty_px, shift * backlash / std::sqrt(12.0));
}

}  // namespace

StripeSweep SolveSweep(std::span<const PlacedStripe> stripes) {
  StripeSweep sweep;
  const std::vector<SeenStripe> sound = Sound(stripes);
  if (sound.size() < kFewestStripes) {
    sweep.focus_mm =
        Measured::Refused(fmt::format("the stripe was read in {} of {} pictures: {}", sound.size(),
                                      stripes.size(), CommonestFault(stripes)));
  }
  if (sound.empty()) return sweep;
  const Perspective perspective = PerspectiveOf(sound);
  const auto width = [&](const SeenStripe& stripe) {
    return stripe.width_px * perspective.Shrinks(stripe.head.z_mm);
  };
  sweep.sharpest_mm = std::ranges::min(sound, {}, width).head.z_mm;
  if (sound.size() >= kFewestStripes) sweep.focus_mm = FitFocusHeight(sound, perspective);
  return sweep;
}

std::vector<const Measured*> SetupResult::Needed() const {
  return {&focus_mm,    &scale.px_per_mm,         &offset.x_mm,
          &offset.y_mm, &height.px_per_height_mm, &scan_angle_rad};
}

Verdict SetupResult::verdict() const {
  Verdict worst = Verdict::kGood;
  for (const Measured* value : Needed()) worst = std::max(worst, value->verdict());
  return worst;
}

std::string SetupResult::reason() const {
  for (const Measured* value : Needed()) {
    if (!value->good() && value->verdict() == verdict()) return value->reason();
  }
  return {};
}

void CheckSpot(const MarkReading& mark, SetupResult& result) {
  if (!result.offset.x_mm.good() || !result.scale.px_per_mm.good()) return;
  const auto doubt = [&result](const std::string& why) {
    result.offset.x_mm = result.offset.y_mm = Measured::CannotTell(why);
  };
  if (!mark.fault.empty()) {
    doubt("the mark was brought to the laser and is not seen there: " + mark.fault);
    return;
  }
  const double off_px =
      std::hypot(mark.column_px - result.spot_column_px, mark.row_px - result.spot_row_px);
  result.check_mm = off_px / result.scale.px_per_mm.quantity().value;
  const double uncertainty_mm = std::hypot(result.offset.x_mm.quantity().standard_uncertainty,
                                           result.offset.y_mm.quantity().standard_uncertainty);
  const double backlash_mm = std::abs(result.scale.backlash_x_mm.quantity().value) +
                             std::abs(result.scale.backlash_y_mm.quantity().value);
  const double borne_mm = 0.02 + 3 * uncertainty_mm + backlash_mm;
  if (*result.check_mm <= borne_mm) return;
  doubt(
      fmt::format("the mark was brought to the laser and stands {:.3f} mm beside it, where {:.3f} "
                  "mm are borne: "
                  "something moved while it was measured",
                  *result.check_mm, borne_mm));
}

SetupResult SolveSetup(const SetupObservations& seen) {
  SetupResult result;
  result.focus_mm = SolveSweep(seen.stripes).focus_mm;
  const std::vector<SeenStripe> sound = Sound(seen.stripes);
  if (seen.marks.size() >= kFewestMarks || seen.mark_fault.empty()) {
    result.scale = FitCameraScale(seen.marks, MarkHeightUncertainty(sound, seen.layer_height_mm));
  } else {
    const auto fault = Measured::Refused(seen.mark_fault);
    result.scale.px_per_mm = result.scale.rotation_rad = fault;
    result.scale.backlash_x_mm = result.scale.backlash_y_mm = fault;
  }
  const PlacedStripe* example = NearestTo(seen.stripes, seen.height_mm);
  if (example == nullptr || sound.size() < kFewestStripes) {
    result.height.px_per_height_mm = result.height.laser_angle_rad = result.height.backlash_z_mm =
        result.scan_angle_rad = result.laser_turn_rad = result.offset.x_mm = result.offset.y_mm =
            result.focus_mm;
    return result;
  }
  const StripeReading& shown = example->reading;
  result.exposure = {shown.peak, shown.background, shown.saturated_px, 2.355 * shown.width_px};
  result.height = FitStripeHeight(sound, seen.height_mm, result.scale.px_per_mm);
  result.scan_angle_rad = ScanAngle(result.height, result.scale.px_per_mm);
  result.laser_turn_rad = LaserTurn(seen.stripes, result.scale.rotation_rad);
  if (!result.height.px_per_height_mm.good()) {
    result.offset.x_mm = result.offset.y_mm = result.height.px_per_height_mm;
    return result;
  }
  // The stripe moves one way as the head rises, and the other as the surface does.
  const bool plus = result.height.px_per_height_mm.quantity().value < 0;
  result.height_direction = shown.down ? (plus ? AxisDirection::kPlusX : AxisDirection::kMinusX)
                                       : (plus ? AxisDirection::kPlusY : AxisDirection::kMinusY);
  const double pixel_u = PlaceSpot(seen, shown.down, shown.slope, result);
  constexpr double kMark_mm = 0.02;  // a bead's middle, as light from one side shifts it
  result.offset =
      FindCameraOffset(result.scale, {seen.mark_x_mm, seen.mark_y_mm, kMark_mm,
                                      result.spot_column_px, result.spot_row_px, pixel_u});
  result.crop = CropAround(result, seen, shown.slope, shown.width_px);
  return result;
}

namespace {

constexpr double kFullScale = 255;

std::string OnExposure(const Exposure& exposure) {
  constexpr double kFaint = 60;     // three times the least that is read
  constexpr double kBright = 0.15;  // of the width: a peak just clipped
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
