#include "pressure_advance/laser/plate.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "geometry/robust_line.h"

namespace trammel::pressure_advance {
namespace {

/// Computes the threshold of a row's mean over three frames, above which it is bead, not plate.
double ClearHeight(double noise_px, double peak_px) {
  return std::max(3 * noise_px / std::sqrt(3.0), 0.15 * peak_px);
}

/// Row at a distance from the bead's centre, over a frame and its neighbours.
struct Neighbourhood {
  bool in_picture = true;
  int seen = 0;     ///< frames that see the row
  double mean = 0;  ///< mean of their heights; 0 if none

  [[nodiscard]] bool tells() const { return in_picture && seen >= 2; }
};

Neighbourhood Around(const HeightMap& heights, const BeadBand& band, std::size_t frame,
                     int offset) {
  Neighbourhood around;
  const std::size_t last = std::min(frame + 1, heights.frames - 1);
  for (std::size_t g = frame > 0 ? frame - 1 : 0; g <= last; ++g) {
    const double row = std::round(band.centre(g) + offset);
    if (row < 0 || row >= static_cast<double>(heights.rows)) {
      around.in_picture = false;
      continue;
    }
    const std::size_t i = heights.index(g, static_cast<std::size_t>(row));
    if (heights.sigma_px[i] > 0) {
      around.mean += heights.height_px[i];
      ++around.seen;
    }
  }
  around.mean /= std::max(1, around.seen);
  return around;
}

}  // namespace

bool OnPlate(const BeadBand& band, std::size_t frame, std::size_t row) {
  return std::abs(static_cast<double>(row) - band.centre(frame)) > band.half(frame) + 1;
}

FoundBand FindBand(const TypicalFrame& typical) {
  const auto rows = static_cast<std::ptrdiff_t>(typical.height.size());
  double peak = 0;
  std::ptrdiff_t top = 0;
  for (std::ptrdiff_t r = 1; r + 1 < rows; ++r) {
    const auto i = static_cast<std::size_t>(r);
    const double smooth = (typical.height[i - 1] + typical.height[i] + typical.height[i + 1]) / 3;
    if (typical.seen[i] && smooth > peak) {
      peak = smooth;
      top = r;
    }
  }
  const auto high = [&](std::ptrdiff_t r) {
    return r >= 0 && r < rows &&
           (!typical.seen[static_cast<std::size_t>(r)] ||
            typical.height[static_cast<std::size_t>(r)] > 0.15 * peak);
  };
  std::ptrdiff_t lo = top;
  std::ptrdiff_t hi = top;
  while (high(lo - 1) || high(lo - 2)) --lo;
  while (high(hi + 1) || high(hi + 2)) ++hi;
  FoundBand found;
  found.band.first_centre = 0.5 * static_cast<double>(lo + hi);
  found.band.half_width = 0.5 * static_cast<double>(hi - lo) + 1;
  found.peak_px = peak;
  return found;
}

void FollowBead(const HeightMap& heights, double peak_px, BeadBand& band) {
  std::vector<double> x, y, scratch;
  for (std::size_t f = 0; f < heights.frames; ++f) {
    double sum = 0;
    double weight = 0;
    for (std::size_t r = 0; r < heights.rows; ++r) {
      const std::size_t i = heights.index(f, r);
      if (heights.sigma_px[i] > 0 && !OnPlate(band, f, r)) {
        const double h = std::clamp<double>(heights.height_px[i], 0, 1.5 * peak_px);
        sum += h * static_cast<double>(r);
        weight += h;
      }
    }
    if (weight > 0.5 * peak_px * band.half_width) {
      x.push_back(static_cast<double>(f));
      y.push_back(sum / weight);
    }
  }
  if (x.size() < 12) {
    return;
  }
  const geometry::RobustLine line = geometry::FitRobustLine(x, y, scratch);
  // Less than a row over the whole sweep is within the noise of a centroid.
  if (std::abs(line.slope) * static_cast<double>(heights.frames) > 1) {
    band.first_centre = line.offset;
    band.drift = line.slope;
  }
}

void WidenBand(const HeightMap& heights, double noise_px, double peak_px, BeadBand& band) {
  // A quarter of the rows is always reserved for the plate.
  const int reach = static_cast<int>(3 * heights.rows / 8);
  const double clear = ClearHeight(noise_px, peak_px);
  std::vector<double> sample;
  const auto high = [&](int offset) {
    sample.clear();
    for (std::size_t f = 1; f + 1 < heights.frames; ++f) {
      const Neighbourhood around = Around(heights, band, f, offset);
      if (!around.in_picture) return false;
      if (around.tells()) sample.push_back(around.mean);
    }
    return sample.size() >= 5 && Quantile(sample, 0.95) > clear;
  };
  int widest = 0;
  for (const int side : {-1, 1}) {
    int k = static_cast<int>(0.7 * band.half_width);
    while (k < reach && (high(side * (k + 1)) || high(side * (k + 2)))) {
      ++k;
    }
    widest = std::max(widest, k);
  }
  band.half_width = widest + 1;
}

std::vector<bool> FollowSwells(const HeightMap& heights, double noise_px, double peak_px,
                               BeadBand& band) {
  const double clear = ClearHeight(noise_px, peak_px);
  const auto rows = static_cast<int>(heights.rows);
  constexpr int kFootRows = 2;  // foot of a bulge, below the clear height
  const int base = static_cast<int>(band.half_width);
  std::vector<double> swell(heights.frames);
  std::vector<bool> cut_off(heights.frames);
  for (std::size_t f = 0; f < heights.frames; ++f) {
    const auto high = [&](int offset) {
      const Neighbourhood around = Around(heights, band, f, offset);
      return around.tells() && around.mean > clear;
    };
    const int centre = static_cast<int>(std::round(band.centre(f)));
    for (const int side : {-1, 1}) {
      int k = base;
      while (high(side * (k + 1)) || high(side * (k + 2))) ++k;
      if (k == base) continue;
      swell[f] = std::max(swell[f], k + kFootRows - band.half_width);
      const int row = centre + side * k;
      if (row <= 1 || row >= rows - 2) cut_off[f] = true;
    }
  }
  band.swell = std::move(swell);
  return cut_off;
}

namespace {

/// A plate's level drifts with the bed over millimetres; frames are fractions of one.
constexpr std::size_t kTrendReach = 12;

/// Returns the local straight-line trend of the level at frame f over its neighbours, itself
/// included.
double Trend(const Plate& plate, std::size_t f) {
  const std::size_t lo = f > kTrendReach ? f - kTrendReach : 0;
  const std::size_t hi = std::min(plate.level.size() - 1, f + kTrendReach);
  std::vector<double> x, y, scratch;
  for (std::size_t i = lo; i <= hi; ++i) {
    if (plate.sigma[i] > 0) {
      x.push_back(static_cast<double>(i) - static_cast<double>(f));
      y.push_back(plate.level[i]);
    }
  }
  if (x.size() < 5) {
    return plate.level[f];
  }
  // Fits about the centre of the points: LMedS rejects outliers, followed by its own least squares
  // step.
  return geometry::FitRobustLine(x, y, scratch).at(0);
}

/// Returns the variance of a level, from the frame-to-frame changes of the difference of its sides,
/// which a bed's twist does not affect; 0 if too few frames show both.
double NoiseOfSides(const Plate& plate) {
  std::vector<double> steps;
  for (std::size_t f = 1; f < plate.sides.size(); ++f) {
    const double step = plate.sides[f] - plate.sides[f - 1];
    if (std::isfinite(step)) steps.push_back(step);
  }
  if (steps.size() < 8) return 0;
  const double sigma = RobustStandardDeviation(steps);
  return sigma * sigma / 2;
}

}  // namespace

void ShrinkToTrend(double row_correlation, Plate& plate) {
  std::vector<double> trend(plate.level.size()), off, predicted;
  for (std::size_t f = 0; f < plate.level.size(); ++f) {
    trend[f] = Trend(plate, f);
    if (plate.sigma[f] > 0) {
      off.push_back(plate.level[f] - trend[f]);
      predicted.push_back(plate.sigma[f] * plate.sigma[f] * row_correlation);
    }
  }
  if (off.size() < 8) {
    return;
  }
  const double seen = RobustStandardDeviation(off);
  const double noise = std::max(Median(predicted), NoiseOfSides(plate));
  // Up to twice the predicted variance counts as noise: the prediction is no better than that.
  const double keep = seen * seen > 2 * noise ? 1 - noise / (seen * seen) : 0;
  for (std::size_t f = 0; f < plate.level.size(); ++f) {
    if (plate.sigma[f] > 0) {
      const double own = plate.sigma[f] * std::sqrt(row_correlation);
      plate.level[f] = trend[f] + keep * (plate.level[f] - trend[f]);
      plate.sigma[f] = own * std::max(keep, 1 / std::sqrt(2.0 * kTrendReach));
    } else {
      plate.level[f] = trend[f];
    }
  }
}

namespace {

/// Finds frames whose level may be raised: those with a swell, and those above the straight line
/// through all levels.
std::vector<bool> Suspects(const BeadBand& band, double min_px, const Plate& plate) {
  const std::size_t frames = plate.level.size();
  std::vector<bool> suspect(frames);
  std::vector<double> x, y, off, scratch;
  for (std::size_t f = 0; f < frames; ++f) {
    if (plate.sigma[f] > 0) {
      x.push_back(static_cast<double>(f));
      y.push_back(plate.level[f]);
    }
  }
  if (x.size() < kTrendReach) return suspect;
  const geometry::RobustLine line = geometry::FitRobustLine(x, y, scratch);
  for (std::size_t i = 0; i < x.size(); ++i) off.push_back(y[i] - line.at(x[i]));
  const double most = std::max(min_px, 5 * RobustStandardDeviation(off));
  for (std::size_t f = 0; f < frames; ++f) {
    suspect[f] = band.half(f) > band.half_width ||
                 (plate.sigma[f] > 0 && plate.level[f] - line.at(static_cast<double>(f)) > most);
  }
  return suspect;
}

/// Level from the nearest frames that are not suspect.
struct Bridge {
  double level = 0;
  double scatter_px = 0;
  bool found = false;
};

Bridge BridgeAt(std::size_t frame, const std::vector<bool>& suspect, const Plate& plate) {
  std::vector<std::pair<std::size_t, std::size_t>> near;  // sorted by distance
  for (std::size_t f = 0; f < suspect.size(); ++f) {
    if (!suspect[f] && plate.sigma[f] > 0) near.emplace_back(f > frame ? f - frame : frame - f, f);
  }
  Bridge bridge;
  if (near.size() < kTrendReach) return bridge;
  std::sort(near.begin(), near.end());
  near.resize(std::min(near.size(), 2 * kTrendReach));
  std::sort(near.begin(), near.end(),
            [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<double> x, y, scratch;
  for (const auto& [distance, f] : near) {
    x.push_back(static_cast<double>(f) - static_cast<double>(frame));
    y.push_back(plate.level[f]);
  }
  const geometry::RobustLine line = geometry::FitRobustLine(x, y, scratch);
  bridge.level = line.at(0);
  bridge.scatter_px = 1.4826 * line.median_residual;
  bridge.found = true;
  return bridge;
}

}  // namespace

std::vector<bool> BridgeSwells(const BeadBand& band, double peak_px, Plate& plate) {
  const double min_px = peak_px / 6;
  const std::vector<bool> suspect = Suspects(band, min_px, plate);
  std::vector<bool> replaced(suspect.size());
  Plate bridged = plate;
  for (std::size_t f = 0; f < suspect.size(); ++f) {
    if (!suspect[f]) continue;
    const Bridge bridge = BridgeAt(f, suspect, plate);
    if (!bridge.found) continue;
    const bool unseen = plate.sigma[f] <= 0;
    if (unseen || plate.level[f] - bridge.level > std::max(min_px, 5 * bridge.scatter_px)) {
      bridged.level[f] = bridge.level;
      bridged.sigma[f] = std::max(bridge.scatter_px, 1e-3);
      replaced[f] = true;
    }
  }
  plate = bridged;
  return replaced;
}

}  // namespace trammel::pressure_advance
