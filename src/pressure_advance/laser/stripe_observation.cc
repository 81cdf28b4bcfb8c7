#include "pressure_advance/laser/stripe_observation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/robust_line.h"
#include "pressure_advance/laser/laser_reader.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kFullScale = 250;  // of 255: JPEG does not preserve 255
constexpr int kPlateShare = 5;   // the fifth of the rows at either end has no bead
constexpr double kMinPeak = 8;   // grey levels; less is no line
constexpr double kTop = 0.15;    // of the peak, below it: the middle there is the line's
// Limits from virtual prints (its study): beyond, answers scatter more or lines are refused.
constexpr double kWide_mm = 0.4;     // and
constexpr double kSteep_per_px = 8;  // grey levels per pixel of width: a bright line may be wider
constexpr double kBurnt_mm = 0.24;
constexpr double kBurntShare = 0.6;  // of the width: optics cannot make it narrower
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

/// Computes a profile's distance from top to `level`; to the picture's end if it does not fall
/// there.
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

StripeObservation StripeObservationOf(const MeanRow& row) {
  StripeObservation observation;
  const auto top = std::max_element(row.red.begin(), row.red.end()) - row.red.begin();
  const double most = row.red[static_cast<std::size_t>(top)];
  observation.peak = most - *std::min_element(row.red.begin(), row.red.end());
  if (observation.peak < kMinPeak) return observation;
  const double half = most - 0.5 * observation.peak;
  const double before = ReachTo(half, row.red, top, -1);
  const double behind = ReachTo(half, row.red, top, 1);
  // A plate's halo is on one side: the other side's half counts twice.
  const double high = most - kTop * observation.peak;
  const double middle = 0.5 * (ReachTo(high, row.red, top, 1) - ReachTo(high, row.red, top, -1));
  observation.width_px = 2 * std::min(before + middle, behind - middle);
  for (const double share : row.saturated) observation.burnt_px += share;
  return observation;
}

}  // namespace

StripeObservation SeeStripe(std::span<const BgrView> frames) {
  TRAMMEL_CHECK(!frames.empty() && frames[0].width > 0 && frames[0].height > 0, "{} frames",
                frames.size());
  const int height = frames[0].height;
  const int rows = std::max(1, height / kPlateShare);
  const StripeObservation upper = StripeObservationOf(MeanOf(frames, 0, rows));
  const StripeObservation lower = StripeObservationOf(MeanOf(frames, height - rows, height));
  if (upper.width_px == 0 || lower.width_px == 0) {
    return upper.width_px > lower.width_px ? upper : lower;
  }
  return {0.5 * (upper.width_px + lower.width_px), 0.5 * (upper.peak + lower.peak),
          0.5 * (upper.burnt_px + lower.burnt_px)};
}

std::string FaultOfWidth(const StripeObservation& observation, int picture_width_px) {
  constexpr double kMaxShare = 1.0 / 3;  // of the picture: beyond, little background remains
  if (observation.width_px <= kMaxShare * picture_width_px) return {};
  return fmt::format(
      "the laser line is {:.0f} px wide at half its height, too wide for a picture of {} px; {}",
      observation.width_px, picture_width_px,
      observation.burnt_px >= kBurntShare * observation.width_px
          ? "it is overexposed: lower the camera's exposure or dim the laser"
          : "it is out of focus: turn the laser's lens, check [camera] focus_height, or make "
            "crop_px wider");
}

std::vector<std::string> ObservationNotices(std::span<const StripeObservation> sweeps,
                                            std::optional<double> px_per_mm) {
  std::vector<double> widths, peaks, burnt;
  for (const StripeObservation& sweep : sweeps) {
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

namespace {

/// Number of rows from which the stripe's appearance is estimated; more cost time without benefit.
constexpr int kLearningRows = 180;
/// Half the crop's rows per row of bead. A swell of six times the typical area that rises to one
/// and a half times the typical height is four times as wide, with a tapering foot; the plate needs
/// room beside it.
constexpr double kRowsPerBeadRow = 2.7;
/// Columns above the plate per column of bead: a swell of constant shape rises by the root of its
/// area.
constexpr double kColumnsPerBeadColumn = 2.5;

/// Returns the frames' mean, thinned to kLearningRows rows: the laser line is static in it, all
/// else is blurred.
Frame MeanFrame(std::span<const Frame> frames) {
  const int step = std::max(1, frames[0].height / kLearningRows);
  Frame mean(frames[0].width, frames[0].height / step);
  const std::size_t row_bytes = static_cast<std::size_t>(mean.width) * 3;
  for (int y = 0; y < mean.height; ++y) {
    for (std::size_t i = 0; i < row_bytes; ++i) {
      std::size_t sum = 0;
      for (const Frame& frame : frames) {
        sum += frame.view().row(y * step)[i];
      }
      mean.row(y)[i] = static_cast<std::uint8_t>(sum / frames.size());
    }
  }
  return mean;
}

/// Median height of each row over the frames, above a straight plate.
struct Relief {
  std::vector<double> height;
  geometry::RobustLine plate;  ///< signed column over row
  double noise_px = 0;
};

std::optional<Relief> MedianRelief(std::span<const Frame> frames, const vision::StripeModel& stripe,
                                   const vision::LaserLineOptions& options, double sign,
                                   vision::LaserLineWorkspace& workspace) {
  const auto rows = static_cast<std::size_t>(frames[0].height);
  std::vector<std::vector<double>> columns(rows);
  vision::LaserLine line;
  for (const Frame& frame : frames) {
    vision::FindLaserLine(frame.view(), stripe, options, workspace, line);
    for (std::size_t r = 0; r < rows; ++r) {
      if (line.found(r)) {
        columns[r].push_back(sign * line.centre_px[r]);
      }
    }
  }
  std::vector<double> x, y, scratch;
  for (std::size_t r = 0; r < rows; ++r) {
    if (2 * columns[r].size() >= frames.size()) {
      x.push_back(static_cast<double>(r));
      y.push_back(Median(columns[r]));
    }
  }
  if (2 * x.size() < rows || x.size() < 8) {
    return std::nullopt;
  }
  Relief relief;
  relief.plate = geometry::FitRobustLine(x, y, scratch);
  relief.noise_px = 1.4826 * relief.plate.median_residual;
  relief.height.assign(rows, 0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    relief.height[static_cast<std::size_t>(x[i])] = y[i] - relief.plate.at(x[i]);
  }
  return relief;
}

struct Bead {
  int first = 0;
  int last = 0;
  double peak = 0;

  [[nodiscard]] double centre() const { return 0.5 * (first + last); }
  [[nodiscard]] int rows() const { return last - first + 1; }
};

std::vector<Bead> FindBeads(const Relief& relief) {
  const double highest = Quantile(relief.height, 0.995);
  const double level = std::max({0.5, 4 * relief.noise_px, 0.3 * highest});
  std::vector<Bead> beads;
  const int rows = static_cast<int>(relief.height.size());
  for (int r = 0; r < rows; ++r) {
    const double height = relief.height[static_cast<std::size_t>(r)];
    if (height < level) {
      continue;
    }
    // Two rows without laser do not divide a bead.
    if (beads.empty() || r - beads.back().last > 3) {
      beads.push_back({r, r, height});
    } else {
      beads.back().last = r;
      beads.back().peak = std::max(beads.back().peak, height);
    }
  }
  std::erase_if(beads, [](const Bead& bead) { return bead.rows() < 4; });
  return beads;
}

/// Returns rows and columns around one bead, clear of the others, within the frame.
PixelRect Around(const Bead& bead, const std::vector<Bead>& beads, const Relief& relief,
                 double stripe_sigma_px, double sign, const Frame& frame) {
  double first = bead.centre() - kRowsPerBeadRow * bead.rows() - 2;
  double last = bead.centre() + kRowsPerBeadRow * bead.rows() + 2;
  for (const Bead& other : beads) {
    if (other.last < bead.first) {
      first = std::max(first, static_cast<double>(other.last) + 3);
    } else if (other.first > bead.last) {
      last = std::min(last, static_cast<double>(other.first) - 3);
    }
  }
  first = std::clamp(std::floor(first), 0.0, static_cast<double>(bead.first));
  last = std::clamp(std::ceil(last), static_cast<double>(bead.last), frame.height - 1.0);
  const double margin = 6 * stripe_sigma_px + 4;
  const double lowest = std::min(relief.plate.at(first), relief.plate.at(last));
  const double highest = std::max(relief.plate.at(first), relief.plate.at(last));
  double left = lowest - margin;
  double right = highest + kColumnsPerBeadColumn * bead.peak + margin;
  if (sign < 0) {
    left = -right;
    right = margin - lowest;
  }
  left = std::clamp(std::floor(left), 0.0, frame.width - 9.0);
  right = std::clamp(std::ceil(right), left + 8, frame.width - 1.0);
  return {static_cast<int>(left), static_cast<int>(first), static_cast<int>(right - left) + 1,
          static_cast<int>(last - first) + 1};
}

}  // namespace

FoundCrop FindCrop(std::span<const Frame> frames, AxisDirection height_direction,
                   vision::LaserLineWorkspace& workspace) {
  TRAMMEL_CHECK(!frames.empty(), "no frames");
  // Below this, a stripe has no background beside it, and a crop no room.
  constexpr int kSmallest_px = 16;
  const int width = frames[0].width;
  const int height = frames[0].height;
  if (width < kSmallest_px || height < kSmallest_px) {
    const bool turned = !AlongX(height_direction);
    return {
        std::nullopt,
        fmt::format("the picture has only {}x{} px, too few for a laser line: at least {}x{} "
                    "are needed; check the video",
                    turned ? height : width, turned ? width : height, kSmallest_px, kSmallest_px)};
  }
  const double sign = Sign(height_direction);
  const vision::LaserLineOptions options = LaserReaderOptions{}.line;
  const Frame mean = MeanFrame(frames);
  const BgrView view = mean.view();
  const vision::StripeModel stripe = vision::LearnStripe({&view, 1}, options, workspace);
  const auto relief = MedianRelief(frames, stripe, options, sign, workspace);
  if (!relief || relief->noise_px > 2 * stripe.sigma_px) {
    return {std::nullopt,
            "no laser line runs through the picture; check the laser, or set crop_px"};
  }
  const std::vector<Bead> beads = FindBeads(*relief);
  if (beads.empty()) {
    return {std::nullopt,
            fmt::format("no printed line is seen: the laser line rises nowhere by more than {:.1f} "
                        "px; is the pattern on the bed, where its plan has it? If it is, check "
                        "height_direction, or set crop_px",
                        std::max(0.5, 4 * relief->noise_px))};
  }
  const double middle = 0.5 * (frames[0].height - 1);
  const Bead bead =
      *std::min_element(beads.begin(), beads.end(), [&](const Bead& a, const Bead& b) {
        return std::abs(a.centre() - middle) < std::abs(b.centre() - middle);
      });
  PixelRect crop = Around(bead, beads, *relief, stripe.sigma_px, sign, frames[0]);
  if (!AlongX(height_direction)) {
    crop = {crop.y, crop.x, crop.height, crop.width};
  }
  return {crop, {}};
}

}  // namespace trammel::pressure_advance
