#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "geometry/robust_line.h"
#include "pressure_advance/laser/plate.h"

namespace trammel::pressure_advance {
namespace {

/// Minimum number of plate rows that determine its level in one frame.
constexpr std::size_t kFewestPlateRows = 4;

/// Returns level and slope of each frame separately, valid if the bead covers less than half the
/// rows.
Plate CoarsePlate(const HeightMap& lines) {
  Plate plate;
  plate.pivot = 0.5 * static_cast<double>(lines.rows);
  plate.level.resize(lines.frames);
  plate.sigma.resize(lines.frames);
  std::vector<double> rows, columns, slopes, scratch;
  for (std::size_t f = 0; f < lines.frames; ++f) {
    rows.clear();
    columns.clear();
    for (std::size_t r = 0; r < lines.rows; ++r) {
      if (lines.sigma_px[lines.index(f, r)] > 0) {
        rows.push_back(static_cast<double>(r) - plate.pivot);
        columns.push_back(lines.height_px[lines.index(f, r)]);
      }
    }
    if (rows.size() < 2 * kFewestPlateRows) {
      continue;
    }
    const geometry::RobustLine line = geometry::FitRobustLine(rows, columns, scratch);
    plate.level[f] = line.offset;
    plate.sigma[f] = 1;
    slopes.push_back(line.slope);
  }
  plate.slope = slopes.empty() ? 0 : Median(slopes);
  return plate;
}

TypicalFrame MedianFrame(const HeightMap& lines, const Plate& plate) {
  TypicalFrame result{std::vector<double>(lines.rows), std::vector<bool>(lines.rows)};
  std::vector<double> sample;
  for (std::size_t r = 0; r < lines.rows; ++r) {
    sample.clear();
    for (std::size_t f = 0; f < lines.frames; ++f) {
      if (plate.sigma[f] > 0 && lines.sigma_px[lines.index(f, r)] > 0) {
        sample.push_back(lines.height_px[lines.index(f, r)] - plate.at(f, static_cast<double>(r)));
      }
    }
    if (sample.size() * 5 >= lines.frames && !sample.empty()) {
      result.height[r] = Median(sample);
      result.seen[r] = true;
    }
  }
  return result;
}

/// If the typical frame's line is not straight: refits the plate's slope and level through the
/// medians, and takes the lower part where the bead had the majority.
void RefitThroughMedians(const TypicalFrame& typical, Plate& plate) {
  std::vector<double> rows, heights, scratch;
  for (std::size_t r = 0; r < typical.height.size(); ++r) {
    if (typical.seen[r]) {
      rows.push_back(static_cast<double>(r) - plate.pivot);
      heights.push_back(typical.height[r]);
    }
  }
  if (rows.size() < 2 * kFewestPlateRows) {
    return;
  }
  geometry::RobustLine line = geometry::FitRobustLine(rows, heights, scratch);
  double above = 0;
  double below = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double residual = heights[i] - line.at(rows[i]);
    (residual > 0 ? above : below) += std::abs(residual);
  }
  if (below > 3 * above && below / static_cast<double>(rows.size()) > 3 * line.median_residual) {
    const double half = 0.5 * (*std::min_element(heights.begin(), heights.end()) + Median(heights));
    std::vector<double> low_rows, low_heights;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (heights[i] < half) {
        low_rows.push_back(rows[i]);
        low_heights.push_back(heights[i]);
      }
    }
    if (low_rows.size() >= kFewestPlateRows) {
      line = geometry::FitRobustLine(low_rows, low_heights, scratch);
    }
  }
  plate.slope += line.slope;
  for (double& level : plate.level) {
    level += line.offset;
  }
}

/// Plate on one side of the bead, weighted.
struct Side {
  double weight = 0;
  double sum = 0;
};

/// Returns the sides' difference, scaled to the scatter of their weighted mean; NaN if one is
/// missing.
double Contrast(const Side& low, const Side& high) {
  return (high.sum / high.weight - low.sum / low.weight) * std::sqrt(low.weight * high.weight) /
         (low.weight + high.weight);
}

/// Refines the plate's level beside the bead per frame, robustly (Huber by reweighting), and one
/// slope.
void RefinePlate(const HeightMap& lines, const BeadBand& band, Plate& plate) {
  std::vector<double> slopes;
  plate.sides.assign(lines.frames, NAN);
  for (std::size_t f = 0; f < lines.frames; ++f) {
    std::vector<double> x, y, s;
    const double centre = band.centre(f) - plate.pivot;
    for (std::size_t r = 0; r < lines.rows; ++r) {
      const float sigma = lines.sigma_px[lines.index(f, r)];
      if (sigma > 0 && OnPlate(band, f, r)) {
        x.push_back(static_cast<double>(r) - plate.pivot);
        y.push_back(lines.height_px[lines.index(f, r)] - plate.slope * x.back());
        s.push_back(sigma);
      }
    }
    if (x.size() < kFewestPlateRows) {
      plate.sigma[f] = 0;
      continue;
    }
    double level = Median(y);
    double variance = 0;
    for (int pass = 0; pass < 4; ++pass) {
      double sum = 0;
      double total = 0;
      double square = 0;
      double slope_sum = 0;
      double slope_total = 0;
      Side low, high;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const double pull = std::abs(y[i] - level) / (2 * s[i]);
        const double weight = (pull > 1 ? 1 / pull : 1) / (s[i] * s[i]);
        sum += weight * y[i];
        total += weight;
        square += weight * weight * s[i] * s[i];
        slope_sum += weight * x[i] * (y[i] - level);
        slope_total += weight * x[i] * x[i];
        Side& side = x[i] < centre ? low : high;
        side.weight += weight;
        side.sum += weight * y[i];
      }
      level = sum / total;
      variance = square / (total * total);
      plate.sides[f] = Contrast(low, high);
      if (pass == 3 && slope_total > 0) {
        slopes.push_back(slope_sum / slope_total);
      }
    }
    plate.level[f] = level;
    plate.sigma[f] = std::sqrt(variance);
  }
  if (slopes.size() >= 3) {
    plate.slope += Median(slopes);
  }
}

/// Standardised residuals on the plate: their robust scale, and the ratio of a row sum's scatter to
/// that of independent rows.
struct PlateNoise {
  double scale = 1;
  double row_correlation = 1;
  double noise_px = 0;
};

PlateNoise MeasureNoise(const HeightMap& lines, const BeadBand& band, const Plate& plate) {
  const std::size_t lags = std::min<std::size_t>(lines.rows / 2, 24);
  std::vector<double> product(lags + 1), count(lags + 1), residuals, sigmas;
  std::vector<double> row(lines.rows);
  for (std::size_t f = 0; f < lines.frames; ++f) {
    for (std::size_t r = 0; r < lines.rows; ++r) {
      const double sigma = lines.sigma_px[lines.index(f, r)];
      row[r] = 0;
      if (plate.sigma[f] > 0 && sigma > 0 && OnPlate(band, f, r)) {
        const double pull =
            (lines.height_px[lines.index(f, r)] - plate.at(f, static_cast<double>(r))) / sigma;
        residuals.push_back(pull);
        sigmas.push_back(sigma);
        row[r] = std::clamp(pull, -3.0, 3.0);
      }
    }
    for (std::size_t k = 0; k <= lags; ++k) {
      for (std::size_t r = 0; r + k < lines.rows; ++r) {
        if (row[r] != 0 && row[r + k] != 0) {
          product[k] += row[r] * row[r + k];
          count[k] += 1;
        }
      }
    }
  }
  PlateNoise noise;
  if (residuals.size() < 16 || product[0] <= 0) {
    return noise;
  }
  noise.scale = std::max(0.02, RobustStandardDeviation(residuals));
  noise.noise_px = noise.scale * Median(sigmas);
  for (std::size_t k = 1; k <= lags && count[k] > 0; ++k) {
    const double correlation = (product[k] / count[k]) / (product[0] / count[0]);
    if (correlation < 0.05) {
      break;
    }
    noise.row_correlation += 2 * correlation;
  }
  return noise;
}

HeightMap Relative(const HeightMap& lines, const Plate& plate, double scale) {
  HeightMap heights = lines;
  for (std::size_t f = 0; f < lines.frames; ++f) {
    for (std::size_t r = 0; r < lines.rows; ++r) {
      const std::size_t i = lines.index(f, r);
      if (plate.sigma[f] <= 0 || lines.sigma_px[i] <= 0) {
        heights.height_px[i] = 0;
        heights.sigma_px[i] = 0;
        continue;
      }
      heights.height_px[i] -= static_cast<float>(plate.at(f, static_cast<double>(r)));
      heights.sigma_px[i] *= static_cast<float>(scale);
    }
  }
  return heights;
}

}  // namespace

PlateHeights FindPlate(const HeightMap& lines) {
  PlateHeights result;
  Plate plate = CoarsePlate(lines);
  RefitThroughMedians(MedianFrame(lines, plate), plate);
  const FoundBand found = FindBand(MedianFrame(lines, plate));
  result.band = found.band;
  result.bead_px = found.peak_px;
  PlateNoise noise;
  for (int pass = 0; pass < 2; ++pass) {
    RefinePlate(lines, result.band, plate);
    const std::vector<bool> hidden = BridgeSwells(result.band, found.peak_px, plate);
    noise = MeasureNoise(lines, result.band, plate);
    ShrinkToTrend(noise.row_correlation * noise.scale * noise.scale, plate);
    result.heights = Relative(lines, plate, noise.scale);
    result.noise_px = noise.noise_px;
    result.row_correlation = noise.row_correlation;
    // The median of n frames is good to 1.25 noise / sqrt n; half a row's noise and a quarter pixel
    // allow for a plate that is not quite straight.
    const double least =
        std::max({0.25, 0.5 * noise.noise_px,
                  6 * noise.noise_px /
                      std::sqrt(static_cast<double>(std::max<std::size_t>(1, lines.frames)))});
    if (!(found.peak_px > least)) {
      result.fault = fmt::format(
          "no bead in the picture: the laser line rises by {:.2f} px at most, with {:.2f} px of "
          "noise in a row; check crop_px and height_direction",
          found.peak_px, noise.noise_px);
      return result;
    }
    FollowBead(result.heights, found.peak_px, result.band);
    WidenBand(result.heights, noise.noise_px, found.peak_px, result.band);
    result.cut_off = FollowSwells(result.heights, noise.noise_px, found.peak_px, result.band);
    for (std::size_t f = 0; f < lines.frames; ++f) {
      if (hidden[f]) result.cut_off[f] = true;
    }
  }
  result.plate_sigma_px = plate.sigma;
  return result;
}

}  // namespace trammel::pressure_advance
