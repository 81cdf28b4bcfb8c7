#include "pressure_advance/laser/bead_band.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "geometry/robust_line.h"

namespace trammel::pressure_advance {
namespace {

/// What the mean of a row over three frames must exceed to be bead rather than plate.
double ClearHeight(double noise_px, double peak_px) {
  return std::max(3 * noise_px / std::sqrt(3.0), 0.15 * peak_px);
}

/// A row so far from the bead's centre over a frame and those next to it.
struct Neighbourhood {
  bool in_picture = true;
  int seen = 0;     ///< frames that see the row
  double mean = 0;  ///< of their heights; 0 where none does

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
  // Whatever happens, a quarter of the rows stays with the plate.
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
  constexpr int kFootRows = 2;  // where a swell's flank runs out below what is clear
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

}  // namespace trammel::pressure_advance
