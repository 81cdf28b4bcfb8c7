#include "pressure_advance/laser/stripe_sight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kFullScale = 250;   // of 255: JPEG does not keep 255
constexpr int kPlateShare = 5;    // the fifth of the rows at either end has no bead
constexpr double kLeastPeak = 8;  // grey levels; less is no line
constexpr double kTop = 0.15;     // of the peak, below it: the middle there is the line's
// Where answers scatter more, or more lines are refused, over virtual prints (its study):
constexpr double kWide_mm = 0.4;     // and
constexpr double kSteep_per_px = 8;  // grey levels per pixel of width: a bright line may be wider
constexpr double kBurnt_mm = 0.24;
constexpr double kBurntShare = 0.6;  // of the width: no lens makes that line narrower
constexpr double kDim = 40;          // grey levels

/// Columns of the mean of some rows.
struct MeanRow {
  std::vector<double> red;
  std::vector<double> saturated;  // share of the pixels
};

MeanRow MeanOf(std::span<const BgrView> frames, int first, int end) {
  const auto width = static_cast<std::size_t>(frames[0].width);
  MeanRow mean{std::vector<double>(width), std::vector<double>(width)};
  const double share = 1.0 / (static_cast<double>(frames.size()) * (end - first));
  for (const BgrView& frame : frames) {
    for (int y = first; y < end; ++y) {
      const std::uint8_t* pixel = frame.row(y);
      for (std::size_t x = 0; x < width; ++x, pixel += 3) {
        mean.red[x] += share * pixel[2];
        mean.saturated[x] += pixel[2] >= kFullScale ? share : 0;
      }
    }
  }
  return mean;
}

/// How far from its top a profile falls to `level`; to the picture's end where it does not.
double ReachTo(double level, const std::vector<double>& profile, std::ptrdiff_t top,
               std::ptrdiff_t step) {
  const auto size = static_cast<std::ptrdiff_t>(profile.size());
  const auto at = [&](std::ptrdiff_t i) { return profile[static_cast<std::size_t>(i)]; };
  std::ptrdiff_t i = top;
  while (i + step >= 0 && i + step < size && at(i + step) > level) i += step;
  const auto whole = static_cast<double>(std::abs(i - top));
  if (i + step < 0 || i + step >= size) return whole;
  return whole + (at(i) - level) / (at(i) - at(i + step));
}

StripeSight SightOf(const MeanRow& row) {
  StripeSight sight;
  const auto top = std::max_element(row.red.begin(), row.red.end()) - row.red.begin();
  const double most = row.red[static_cast<std::size_t>(top)];
  sight.peak = most - *std::min_element(row.red.begin(), row.red.end());
  if (sight.peak < kLeastPeak) return sight;
  const double half = most - 0.5 * sight.peak;
  const double before = ReachTo(half, row.red, top, -1);
  const double behind = ReachTo(half, row.red, top, 1);
  // A plate's halo lies to one side: the other side's half counts twice.
  const double high = most - kTop * sight.peak;
  const double middle = 0.5 * (ReachTo(high, row.red, top, 1) - ReachTo(high, row.red, top, -1));
  sight.width_px = 2 * std::min(before + middle, behind - middle);
  for (const double share : row.saturated) sight.burnt_px += share;
  return sight;
}

}  // namespace

StripeSight SeeStripe(std::span<const BgrView> frames) {
  TRAMMEL_CHECK(!frames.empty() && frames[0].width > 0 && frames[0].height > 0, "{} frames",
                frames.size());
  const int height = frames[0].height;
  const int rows = std::max(1, height / kPlateShare);
  const StripeSight upper = SightOf(MeanOf(frames, 0, rows));
  const StripeSight lower = SightOf(MeanOf(frames, height - rows, height));
  if (upper.width_px == 0 || lower.width_px == 0) {
    return upper.width_px > lower.width_px ? upper : lower;
  }
  return {0.5 * (upper.width_px + lower.width_px), 0.5 * (upper.peak + lower.peak),
          0.5 * (upper.burnt_px + lower.burnt_px)};
}

std::string FaultOfWidth(const StripeSight& sight, int picture_width_px) {
  constexpr double kMostShare = 1.0 / 3;  // of the picture: beyond, little is left beside it
  if (sight.width_px <= kMostShare * picture_width_px) return {};
  return fmt::format(
      "the laser line is {:.0f} px wide at half its height, too wide for a picture of {} px; {}",
      sight.width_px, picture_width_px,
      sight.burnt_px >= kBurntShare * sight.width_px
          ? "it is overexposed: lower the camera's exposure or dim the laser"
          : "it is out of focus: turn the laser's lens, check [camera] focus_height, or make "
            "crop_px wider");
}

std::vector<std::string> NoticesOfSight(std::span<const StripeSight> sweeps,
                                        std::optional<double> px_per_mm) {
  std::vector<double> widths, peaks, burnt;
  for (const StripeSight& sweep : sweeps) {
    if (sweep.width_px <= 0) continue;
    widths.push_back(sweep.width_px);
    peaks.push_back(sweep.peak);
    burnt.push_back(sweep.burnt_px);
  }
  if (widths.empty()) return {};
  std::vector<std::string> notices;
  const double burnt_px = Median(burnt);
  const double width_px = Median(widths);
  const double peak = Median(peaks);
  const double width_mm = px_per_mm ? width_px / *px_per_mm : 0;
  if (width_mm >= kWide_mm && peak < kSteep_per_px * width_px &&
      burnt_px < kBurntShare * width_px) {
    notices.push_back(fmt::format(
        "the laser line is out of focus: {:.1f} px ({:.2f} mm) wide at half its height, where 0.15 "
        "to 0.3 mm are usual, and only {:.0f} grey levels bright; answers scatter more. Turn the "
        "laser's lens, or check [camera] focus_height (trammel pa setup)",
        width_px, width_mm, peak));
  }
  if (px_per_mm && burnt_px / *px_per_mm >= kBurnt_mm) {
    notices.push_back(fmt::format(
        "the laser line is overexposed: {:.1f} px ({:.2f} mm) of its width are at the sensor's "
        "full "
        "scale, from {} mm on more lines are refused; lower the camera's exposure or dim the laser",
        burnt_px, burnt_px / *px_per_mm, kBurnt_mm));
  }
  if (peak < kDim) {
    notices.push_back(fmt::format(
        "the laser line is dim: {:.0f} grey levels over the plate, below {:.0f} more lines are "
        "refused; raise the camera's exposure or darken the room",
        peak, kDim));
  }
  return notices;
}

}  // namespace trammel::pressure_advance
