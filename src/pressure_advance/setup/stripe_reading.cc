#include "pressure_advance/setup/stripe_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "base/square.h"
#include "base/statistics.h"
#include "geometry/robust_line.h"
#include "pressure_advance/setup/stripe_profile.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kSmallest_px = 32;
constexpr int kLearningRows = 120;    // from which the stripe's looks are learnt
constexpr double kLeastContrast = 3;  // the best path through pure noise reaches 2
constexpr double kLeastSeen = 0.5;    // of the rows
constexpr double kLeastPeak = 20;     // grey levels; below, JPEG's quantisation shapes the profile
constexpr double kStraight = 1.5;     // stripe sigmas that rows may stand off, in the median

const vision::LaserLineOptions kLine{.row_smoothing = 0, .as_good = 1.15};

Frame Turned(const BgrView& view) {
  Frame turned(view.height, view.width);
  for (int y = 0; y < view.height; ++y) {
    const std::uint8_t* from = view.row(y);
    for (int x = 0; x < view.width; ++x) {
      std::copy_n(from + 3 * x, 3, turned.row(x) + 3 * y);
    }
  }
  return turned;
}

vision::StripeModel Learn(const BgrView& frame, vision::LaserLineWorkspace& workspace) {
  BgrView thinned = frame;
  const int step = std::max(1, frame.height / kLearningRows);
  thinned.height = frame.height / step;
  thinned.stride = frame.stride * step;
  return vision::LearnStripe({&thinned, 1}, kLine, workspace);
}

// Rows with a stripe, from the picture's middle, and the columns there.
struct Centres {
  std::vector<double> row;
  std::vector<double> column;
};

struct Straight {
  double at_middle = 0;
  double slope = 0;
  double sigma_px = 0;    // of at_middle
  double scatter_px = 0;  // median distance of all rows
};

// Least squares over the rows near a robust line; its error from what pieces of the stripe say.
Straight FitStraight(const Centres& centres) {
  std::vector<double> scratch;
  const auto robust = geometry::FitRobustLine(centres.row, centres.column, scratch);
  const double reach = std::max(0.5, 4 * 1.4826 * robust.median_residual);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < centres.row.size(); ++i) {
    if (std::abs(centres.column[i] - robust.at(centres.row[i])) > reach) continue;
    const double x = centres.row[i], y = centres.column[i];
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  Straight line;
  line.scatter_px = robust.median_residual;
  const double spread = sxx - sx * sx / n;
  line.slope = spread > 0 ? (sxy - sx * sy / n) / spread : robust.slope;
  line.at_middle = (sy - line.slope * sx) / n;
  constexpr int kPieces = 24;
  std::vector<double> sum(kPieces), count(kPieces), mean;
  const double first = centres.row.front(), length = centres.row.back() - first + 1;
  for (std::size_t i = 0; i < centres.row.size(); ++i) {
    const double off = centres.column[i] - line.at_middle - line.slope * centres.row[i];
    if (std::abs(off) > reach) continue;
    const auto piece = static_cast<std::size_t>(kPieces * (centres.row[i] - first) / length);
    sum[piece] += off, count[piece] += 1;
  }
  for (std::size_t piece = 0; piece < kPieces; ++piece) {
    if (count[piece] > 0) mean.push_back(sum[piece] / count[piece]);
  }
  line.sigma_px = StandardDeviation(mean) / std::sqrt(std::max<double>(1, double(mean.size())));
  return line;
}

StripeReading Fault(std::string why, StripeReading reading = {}) {
  reading.fault = std::move(why);
  return reading;
}

StripeReading ReadUpright(const BgrView& frame, vision::LaserLineWorkspace& workspace) {
  if (frame.width < kSmallest_px || frame.height < kSmallest_px) {
    return Fault(fmt::format("a picture of {} x {} px is too small: at least {} x {} are needed",
                             frame.width, frame.height, kSmallest_px, kSmallest_px));
  }
  const vision::StripeModel model = Learn(frame, workspace);
  vision::LaserLine line;
  vision::FindLaserLine(frame, model, kLine, workspace, line);
  Centres centres;
  const double middle_row = 0.5 * (frame.height - 1), middle_column = 0.5 * (frame.width - 1);
  for (std::size_t y = 0; y < line.centre_px.size(); ++y) {
    if (!line.found(y)) continue;
    centres.row.push_back(static_cast<double>(y) - middle_row);
    centres.column.push_back(line.centre_px[y]);
  }
  const double seen = static_cast<double>(centres.row.size()) / frame.height;
  if (line.contrast < kLeastContrast || seen < kLeastSeen) {
    return Fault(fmt::format(
        "no laser stripe goes through the picture (contrast {:.1f} of {:.0f}, in {:.0f} % of the "
        "rows): check that the laser shines, that the stripe falls into the picture, and the "
        "camera's exposure",
        line.contrast, kLeastContrast, 100 * seen));
  }
  const Straight straight = FitStraight(centres);
  if (straight.scatter_px > kStraight * std::max(1.0F, model.sigma_px)) {
    return Fault(fmt::format(
        "the brightest line of the picture is not straight (rows stand off by {:.1f} px): it is no "
        "laser stripe, or something lies on the plate",
        straight.scatter_px));
  }
  StripeReading reading;
  reading.at_middle_px = straight.at_middle;
  reading.slope = straight.slope;
  const double cosine = 1 / std::hypot(1.0, straight.slope);
  reading.across_px = (straight.at_middle - middle_column) * cosine;
  reading.across_sigma_px = straight.sigma_px * cosine;
  const StripeProfile profile =
      MeasureProfile(frame, model, straight.at_middle - straight.slope * middle_row, straight.slope,
                     model.sigma_px);
  reading.width_px = profile.sigma_px * cosine;
  reading.width_sigma_px = profile.sigma_uncertainty_px * cosine;
  reading.peak = profile.peak;
  reading.background = profile.background;
  reading.saturated_px = profile.saturated_px * cosine;
  if (profile.peak < kLeastPeak) {
    return Fault(
        fmt::format("the laser stripe is too dark: {:.0f} grey levels over its "
                    "surroundings, at least {:.0f} are needed; raise the camera's exposure",
                    profile.peak, kLeastPeak),
        reading);
  }
  if (!(profile.sigma_px > 0)) {
    return Fault("the laser stripe has no measurable width: its profile is no single peak",
                 reading);
  }
  constexpr double kMostSaturated = 0.7;  // of the width at half height: five times full scale
  const double half_height_px = 2.355 * reading.width_px;
  if (reading.saturated_px > kMostSaturated * half_height_px) {
    return Fault(
        fmt::format(
            "the laser stripe is overexposed: {:.0f} px of its width of {:.0f} px are at the "
            "sensor's full scale; lower the camera's exposure or dim the laser",
            reading.saturated_px, half_height_px),
        reading);
  }
  return reading;
}

}  // namespace

bool StripeRunsDown(const BgrView& frame) {
  std::vector<double> column(static_cast<std::size_t>(frame.width));
  std::vector<double> row(static_cast<std::size_t>(frame.height));
  for (int y = 0; y < frame.height; ++y) {
    const std::uint8_t* pixel = frame.row(y);
    for (int x = 0; x < frame.width; ++x, pixel += 3) {
      const double redder = std::max(0.0, pixel[2] - 0.5 * (pixel[0] + pixel[1]));
      column[static_cast<std::size_t>(x)] += redder / frame.height;
      row[static_cast<std::size_t>(y)] += redder / frame.width;
    }
  }
  if (column.empty() || row.empty()) return true;
  // A stripe is a peak in the means along it, and spread out in the means across it.
  const auto peak = [](const std::vector<double>& means) {
    return *std::max_element(means.begin(), means.end()) - Median(means);
  };
  return peak(column) >= peak(row);
}

StripeReading ReadStripe(const BgrView& frame, bool down, vision::LaserLineWorkspace& workspace) {
  StripeReading reading;
  if (down) {
    reading = ReadUpright(frame, workspace);
  } else {
    const Frame turned = Turned(frame);
    reading = ReadUpright(turned.view(), workspace);
  }
  reading.down = down;
  return reading;
}

}  // namespace trammel::pressure_advance
